"""What a batch of views costs: `python benchmarks/batches.py [--device NAME] [--views N] [--size N] [--rounds N]`.

machine_world with default settings from cameras beside one another, which move before each picture: all views by one
renderer, then by a renderer each, one after the other. Both are measured in turn. Prints pictures a second (median of
the rounds), milliseconds a picture of the host and of all processors, which depend little on other programs, and
megabytes of device memory. `--batches N` renders so many, and prints by how much device memory and the process grew
in their second half. `--randomized`: each view has places, visibility, a material, lights and an environment of its
own, by arrays that are set before each batch.
"""

import argparse
import resource
import time
from collections.abc import Callable

import numpy as np

import pica
from pica.rhi.device import open_device
from pica.scenes.placing import move


def cameras(scene: pica.Scene, views: int, step: int) -> list[pica.Camera]:
    """Beside one another, all a little farther on in each step."""
    camera = scene.default_camera(1.0)
    places = [move(0.02 * view + 0.01 * step, 0.005 * step, 0) for view in range(views)]
    return [pica.Camera(transform=place @ camera.transform, vertical_fov=camera.vertical_fov) for place in places]


def randomize(views: pica.SceneViews, step: int) -> None:
    """Values for each view by arrays."""
    random, count = np.random.default_rng(step), len(views)
    x, z = random.uniform(-0.3, 0.3, (2, count)).tolist()
    views.set_transforms("hopper", np.stack([move(*place) for place in zip(x, [0] * count, z, strict=True)]))
    views.set_visible("cross belt", random.random(count) < 0.5)
    views.set_material("navy plastic", base_color=random.random((count, 4)), roughness=random.random(count))
    views.set_light("sun", illuminance=random.uniform(0.5, 5.0, count), color=random.random((count, 3)))
    views.set_environment(strength=random.random(count), rotation=random.uniform(0, 6, count))


def timed(call: Callable[[], object]) -> tuple[float, float]:
    """Seconds of the clock, and of all processors."""
    started = time.perf_counter(), time.process_time()
    call()
    return time.perf_counter() - started[0], time.process_time() - started[1]


def resident() -> float:
    """Megabytes of the process at their highest."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--device")
    parser.add_argument("--views", type=int, default=64)
    parser.add_argument("--size", type=int, default=128)
    parser.add_argument("--rounds", type=int, default=8)
    parser.add_argument("--batches", type=int, default=0)
    parser.add_argument("--randomized", action="store_true")
    arguments = parser.parse_args()
    device, scene, views = open_device(arguments.device), pica.scenes.machine_world(), arguments.views
    size = arguments.size, arguments.size
    start = device.memory
    copies = pica.SceneViews(scene, views) if arguments.randomized else None
    together = pica.Renderer(copies or scene, size=size, device=device, views=views)
    together.render(1, camera=cameras(scene, views, 0), aovs=())
    print(f"{device.name}, {views} views of {size[0]}x{size[1]}: {(device.memory - start) / 2**20:.0f} MiB")

    def batch(step: int) -> object:
        if copies is not None:
            randomize(copies, step)
        return together.render(1, camera=cameras(scene, views, step), aovs=()).color

    if arguments.batches:
        for step in range(arguments.batches):
            if step == arguments.batches // 2:
                memory, process = device.memory, resident()
            batch(step)
        grown = device.memory - memory, resident() - process
        print(
            f"{arguments.batches} batches, second half: device memory {grown[0]:+} bytes, process {grown[1]:+.1f} MiB"
        )
        return
    alone = [pica.Renderer(each, size=size, device=device) for each in copies or [scene] * views]

    def one_by_one(step: int) -> object:
        if copies is not None:
            randomize(copies, step)
        looks = zip(alone, cameras(scene, views, step), strict=True)
        return [renderer.render(1, camera=camera, aovs=()).color for renderer, camera in looks]

    one_by_one(0)
    rounds = range(1, arguments.rounds + 1)
    times = np.array(
        [(timed(lambda step=step: batch(step)), timed(lambda step=step: one_by_one(step))) for step in rounds]
    )
    medians = np.median(times, axis=0)
    hosts = together.host_seconds / views, alone[0].host_seconds
    for name, (clock, processors), host in zip(("batch", "one by one"), medians.tolist(), hosts, strict=True):
        print(
            f"{name}: {views / clock:.2f} pictures a second; a picture takes {1e3 * processors / views:.1f} ms of"
            f" processors, {1e3 * host:.2f} ms of the host"
        )
    clock, processors = np.median(times[:, 1] / times[:, 0], axis=0)
    print(f"one by one over batch, median of the rounds: {clock:.3f} by the clock, {processors:.3f} by processors")


if __name__ == "__main__":
    main()

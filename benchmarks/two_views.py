"""What a second renderer of a scene costs: `python benchmarks/two_views.py [--device NAME] [--size WxH] [--frames N]`.

machine_world with smoke and its animation running, seen by one renderer, then by two of different size and camera, then
by two that stand still. Prints megabytes of device memory, host milliseconds a frame (median), and FLIP between each
view's picture after N still frames and that of a renderer which saw the same with a scene of its own.
"""

import argparse

import numpy as np

import pica
from pica.quality.metrics import flip
from pica.rhi.device import Device, open_device
from pica.scene.emitter import Emitter
from pica.scene.material import AlphaMode, Material
from pica.scene.model import Scene
from pica.scene.particles import Sprites

SMOKE = Emitter(300, 2.0, origin=(0.5, 1.0, 0.5), velocity=(0, 0.8, 0), spread=0.3, size=(0.08, 0.25))


class Moving:
    """A machine_world of its own, with smoke."""

    def __init__(self) -> None:
        self.scene: Scene = pica.scenes.machine_world()
        grey = Material(base_color=(0.7, 0.7, 0.7, 0.4), metallic=0.0, alpha_mode=AlphaMode.BLEND, double_sided=True)
        self.smoke = Sprites(SMOKE.count, grey, "smoke")
        assert self.smoke.node is not None
        self.scene.add(self.smoke.node)
        self.at(0.0)

    def at(self, time: float) -> None:
        """Everything as it is at `time` seconds."""
        self.scene.animate(time)
        self.smoke.particles = SMOKE.at(time)


def seen(moving: Moving, renderers: dict[pica.Renderer, pica.Camera], steps: int) -> list[float]:
    """Median host milliseconds a frame of each renderer, all rendering every step."""
    spent: list[list[float]] = [[] for _ in renderers]
    for step in range(steps):
        moving.at(step / 30)
        for times, (renderer, camera) in zip(spent, renderers.items(), strict=True):
            renderer.advance(camera)
            times.append(1e3 * renderer.host_seconds)
    return [float(np.median(times[2:])) for times in spent]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--device")
    parser.add_argument("--size", default="160x90")
    parser.add_argument("--frames", type=int, default=64)
    parser.add_argument("--steps", type=int, default=10)
    arguments = parser.parse_args()
    device: Device = open_device(arguments.device)
    width, height = map(int, arguments.size.split("x"))
    sizes = (width, height), (width * 3 // 4, height * 3 // 4)
    moving = Moving()
    first = moving.scene.default_camera(width / height)
    low, high = moving.scene.bounds()
    second = pica.Camera.framing(low, high, aspect=width / height)
    start = device.memory
    one = {pica.Renderer(moving.scene, size=sizes[0], device=device): first}
    print(f"one renderer: host {seen(moving, one, arguments.steps)} ms, {(device.memory - start) / 2**20:.1f} MiB")
    (renderer,) = one
    both = {renderer: first, pica.Renderer(moving.scene, size=sizes[1], device=device): second}
    print(f"two: host {seen(moving, both, arguments.steps)} ms, {(device.memory - start) / 2**20:.1f} MiB")
    pictures = [renderer.render(arguments.frames, camera=camera) for renderer, camera in both.items()]
    for picture, (shared, camera) in zip(pictures, both.items(), strict=True):
        alone, before = Moving(), device.memory
        with pica.Renderer(alone.scene, size=shared.size, device=device) as lone:
            for _ in range(2 if camera is first else 1):
                seen(alone, {lone: camera}, arguments.steps)
            error, _ = flip(lone.render(arguments.frames, camera=camera).color, picture.color)
            taken = (device.memory - before) / 2**20
        print(f"{shared.size}: FLIP {error:.4f} to a lone renderer, which takes {taken:.1f} MiB")
    for used in both:
        used.close()
    print(f"closed: {(device.memory - start) / 2**20:.1f} MiB")


if __name__ == "__main__":
    main()

"""What geometry that changes costs: host and GPU milliseconds. `python benchmarks/dynamic_geometry.py`."""

import time
from collections.abc import Callable

import numpy as np

import pica
from pica.gpu_scene.view import SceneView
from pica.rhi.device import Device
from pica.rhi.passes import DeviceRecording
from pica.scene.emitter import Emitter
from pica.scene.landscape import Landscape
from pica.scene.material import Material
from pica.scene.model import Mesh, Node, Scene
from pica.scene.particles import Sprites
from pica.scene.spline import Spline, bend
from pica.scenes.basic_meshes import box
from pica.scenes.terrain import fractal_heights

ROUNDS = 25
CAMERA = pica.Camera.look_at((0, 3, 6), (0, 1, 0))


def host(work: Callable[[int], object]) -> float:
    """Median milliseconds of the host."""
    seconds = []
    for turn in range(ROUNDS):
        start = time.perf_counter()
        work(turn)
        seconds.append(time.perf_counter() - start)
    return 1e3 * float(np.median(seconds))


def measured(device: Device, node: Node, change: Callable[[int], object]) -> None:
    """Print what a change costs to make, to record, and on the GPU."""
    scene = Scene("benchmark")
    scene.add(node)
    gpu = SceneView(device, scene, pica.Settings())

    def update() -> None:
        with device.record() as recording:
            gpu.update(recording, CAMERA)

    update()
    made = host(change)

    def changed(turn: int) -> None:
        change(turn)
        update()

    device.profiler.flush()
    both = host(changed)
    device.profiler.begin_frame()
    change(ROUNDS)
    encoder = device.handle.create_command_encoder()
    gpu.update(DeviceRecording(encoder, device.profiler), CAMERA)
    device.profiler.end_frame(device.handle.submit_command_buffer(encoder.finish()))
    times = {name: round(value, 2) for name, value in device.profiler.flush().items()}
    triangles = scene.triangle_count()
    print(f"{node.name}: {triangles} triangles, change {made:.2f} ms, update {both - made:.2f} ms, GPU {times}")


def landscape(device: Device) -> None:
    """Print what a step of the camera over 1024 patches costs."""
    hills = Landscape(fractal_heights(1025, 80, 9.0), 0.5, Material(), levels=5)
    scene = Scene("benchmark")
    scene.add(hills.node)
    gpu = SceneView(device, scene, pica.Settings())
    costs, still = [], []
    before = hills.levels_for(pica.Camera.look_at((-100, 12, 0), (-100, 0, -10)))
    for x in np.arange(-100, 100, 1.0):
        camera = pica.Camera.look_at((x, 12, 0), (x, 0, -10))
        start = time.perf_counter()
        with device.record() as recording:
            gpu.update(recording, camera)
        spent = 1e3 * (time.perf_counter() - start)
        levels = hills.levels_for(camera)
        changed, before = len(hills.differing(levels, before)), levels
        (costs if changed else still).append((changed, spent))
    shares, quiet = np.array(costs[1:]), float(np.median(np.array(still)[:, 1]))
    each = float(np.median(shares[:, 1] / shares[:, 0]))
    print(f"landscape: {scene.triangle_count()} of {2 * 1024**2} triangles, a step without a change {quiet:.2f} ms")
    print(f"with one {each:.2f} ms a patch, {np.median(shares[:, 0]):.0f} patches at a time")


def main() -> None:
    """Measure every kind."""
    device = Device()
    print(device.name)
    cloth = Material(double_sided=True)
    many = Emitter(10_000, 3.0, velocity=(0, 2, 0), spread=1.0, size=(0.05, 0.02))
    moments = [many.at(turn * 0.033) for turn in range(ROUNDS + 1)]
    print(f"10,000 particles of an emitter: {host(lambda turn: many.at(0.1 * turn)):.2f} ms")
    sprites = Sprites(10_000, cloth, "10,000 sprites")
    assert sprites.node is not None
    measured(device, sprites.node, lambda turn: setattr(sprites, "particles", moments[turn]))
    few = Emitter(1000, 3.0, velocity=(0, 2, 0), spread=1.0, size=(0.05, 0.02))
    bits = Node("1000 mesh particles", mesh=Mesh([box(1.0, cloth)]))
    few.at(0).place(bits)
    measured(device, bits, lambda turn: few.at(turn * 0.033).place(bits))
    points = np.random.default_rng(0).uniform(-2, 2, (12, 3))
    spline = Spline(points)
    measured(
        device,
        bend(Mesh([box((0.2, 0.2, 1), cloth, 0.05, 8)]), spline, 40, "spline mesh"),
        lambda turn: spline.set(points + 0.01 * turn),
    )
    landscape(device)


if __name__ == "__main__":
    main()

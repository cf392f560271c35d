"""Scenes that move: host time with 100,000 instances of which 100 move, and refit against rebuild.

    python benchmarks/living_scenes.py [--instances 100000] [--size 1920x1080] [--device NAME]

Prints one JSON line a measurement: the figures of docs/measurements/performance.md.
"""

import argparse
import json
import time
from collections.abc import Callable, Iterable
from statistics import median
from typing import Any
from unittest.mock import patch

import numpy as np

import pica
from pica.gpu_scene.deformation import deformation
from pica.quality.benchmark import benchmark
from pica.rhi.device import Device
from pica.scene.light import DirectionalLight, PointLight
from pica.scene.material import Material
from pica.scene.model import Mesh, Node, Scene
from pica.scenes.basic_meshes import plane, sphere


def crowd(instances: int, meshes: int = 50, rings: int = 12) -> tuple[Scene, list[Node]]:
    """Spheres on a grid, each its own node; many share a mesh."""
    scene = Scene("crowd")
    shapes = [Mesh([sphere(0.4, Material(base_color=(*color, 1.0), metallic=0.0), rings)]) for color in _colors(meshes)]
    side = int(np.ceil(np.sqrt(instances)))
    nodes = []
    for index in range(instances):
        node = Node(mesh=shapes[index % meshes])
        place = np.eye(4)
        place[:3, 3] = index % side - side / 2, 0.0, index // side - side / 2
        node.transform = place
        nodes.append(scene.add(node))
    sun = Node(light=DirectionalLight(illuminance=3.0, angular_diameter=0.01))
    sun.transform = pica.Camera.look_at((0.4, 1.0, 0.3), (0.0, 0.0, 0.0)).transform
    scene.add(sun)
    return scene, nodes


def _colors(count: int) -> np.ndarray:
    return np.random.default_rng(1).uniform(0.2, 0.9, (count, 3))


def measure_crowd(device: Device, instances: int, moving: int = 100, frames: int = 100) -> dict[str, object]:
    """Host milliseconds a frame with everything still and with some moving, setting the transforms included."""
    scene, nodes = crowd(instances)
    started = time.perf_counter()
    renderer = pica.Renderer(scene, size=(640, 360), device=device)
    built = time.perf_counter() - started
    camera = pica.Camera.look_at((0.0, 30.0, 60.0), (0.0, 0.0, 0.0), vertical_fov=np.radians(50.0))
    for _ in range(10):
        renderer.advance(camera)
    chosen = nodes[:: max(len(nodes) // moving, 1)][:moving]
    times: dict[str, list[float]] = {"still": [], "moving": []}
    for name, group in (("still", []), ("moving", chosen)):
        for frame in range(frames):
            device.handle.wait_for_idle()
            begun = time.perf_counter()
            for node in group:
                place = node.transform.copy()
                place[1, 3] = np.sin(0.1 * frame)
                node.transform = place
            set_up = time.perf_counter() - begun
            renderer.advance(camera)
            times[name].append((set_up + renderer.host_seconds) * 1e3)
    return {
        "instances": instances,
        "moving": moving,
        "build_s": built,
        "host_ms": {name: median(values) for name, values in times.items()},
        "gpu_ms": device.profiler.flush(),
    }


def copies(instances: int) -> tuple[Scene, list[Node]]:
    """The same grid as one node's copies of one mesh (EXT_mesh_gpu_instancing)."""
    scene, nodes = crowd(instances, meshes=1, rings=3)
    alike = Scene("copies")
    alike.add(Node(mesh=nodes[0].mesh, instances=np.array([node.transform for node in nodes])))
    alike.add(scene.roots[-1])
    return alike, nodes


def measure_coming(device: Device, kind: str, instances: int, rounds: int = 7) -> dict[str, object]:
    """Processor milliseconds that the host takes for a frame in which one more thing comes, or goes again, by raster.

    Those of its thread alone: other programs of a busy machine, and lavapipe's threads, do not count.
    """
    scene, _ = copies(instances) if kind == "copies" else crowd(instances, rings=3)
    settings = pica.Settings().with_values({"visibility.primary": "raster"})
    renderer = pica.Renderer(scene, size=(64, 36), settings=settings, device=device)
    camera = pica.Camera.look_at((0.0, 30.0, 60.0), (0.0, 0.0, 0.0), vertical_fov=np.radians(50.0))
    matt, glowing = Material(metallic=0.0), Material(metallic=0.0, emission=(5.0, 4.0, 3.0))
    new: dict[str, Callable[[], Node]] = {
        "mesh": lambda: Node(mesh=Mesh([sphere(0.4, matt, 12)])),
        "light": lambda: Node(light=PointLight(intensity=20.0)),
        "emissive mesh": lambda: Node(mesh=Mesh([sphere(0.4, glowing, 12)])),
    }
    times: dict[str, list[float]] = {"still": []}
    for name, make in new.items():
        for _ in range(rounds):
            node = make()
            steps = (
                ("still", lambda: None),
                (f"{name} comes", _adding(scene, node)),
                (f"{name} goes", _removing(scene, node)),
            )
            for step, change in steps:
                begun = time.thread_time()
                change()
                renderer.advance(camera)
                times.setdefault(step, []).append((time.thread_time() - begun) * 1e3)
                device.handle.wait_for_idle()
    return {
        "kind": kind,
        "instances": instances,
        "host_cpu_ms": {name: round(median(v), 2) for name, v in times.items()},
    }


def _adding(scene: Scene, node: Node) -> Callable[[], object]:
    return lambda: scene.add(node)


def _removing(scene: Scene, node: Node) -> Callable[[], object]:
    return lambda: scene.remove(node)


def twisting(cells: int = 400) -> tuple[Scene, Node]:
    """A sheet of 2 cells² triangles that a morph target rolls up, and its node."""
    section = plane(4.0, 4.0, Material(metallic=0.0), cells)
    x, z = section.positions[:, 0], section.positions[:, 2]
    angle, radius = 2.5 * x, 0.2 + 0.1 * (x + 2) + 0.1 * np.sin(9 * z)
    rolled = np.stack([radius * np.cos(angle), radius * np.sin(angle), z], 1)
    section.morph_positions = (rolled - section.positions)[None].astype(np.float32)
    scene = Scene(environment=pica.Environment(np.ones((1, 2, 3), np.float32)))
    node = scene.add(Node(mesh=Mesh([section])))
    node.weights = [0.0]
    return scene, node


_REBUILDS: dict[str, dict[str, Any]] = {
    "refit only": {"_REBUILD_AT": 100.0},
    "default": {"_REBUILD_AT": 1.5},
    "build each frame": {"_REBUILD_AT": 0.0, "_CHECK_EVERY": 1},
}


def measure_deforming(device: Device, size: tuple[int, int]) -> list[dict[str, object]]:
    """Refits only, the default, and a build each frame: milliseconds, and rays per second after 100 frames."""
    results: list[dict[str, object]] = []
    camera = pica.Camera.look_at((0.0, 3.0, 4.0), (0.0, 0.0, 0.0), vertical_fov=np.radians(45.0))
    for name, constants in _REBUILDS.items():
        scene, node = twisting()
        settings = pica.Settings().with_values({"visibility.primary": "rays"})
        renderer = pica.Renderer(scene, size=size, settings=settings, device=device)
        bottom = []
        with patch.multiple(deformation, **constants):
            for frame in range(100):
                node.weights = [frame / 99]
                renderer.advance(camera)
                bottom.append(device.profiler.flush().get("bottom level", 0.0))
            measured = benchmark(renderer, camera, frames=50, warm_up=5)
        results.append(
            {
                "mode": name,
                "triangles": scene.triangle_count(),
                "bottom_level_ms": {"median": median(bottom), "mean": float(np.mean(bottom)), "largest": max(bottom)},
                "builds": int(np.sum(np.array(bottom) > 3 * min(bottom))) if name == "default" else None,
                "rays_per_second": measured["rays_per_second"],
            }
        )
    return results


def measure_small_deforming(device: Device, count: int = 1000, frames: int = 20) -> list[dict[str, object]]:
    """A frame in which every one of many small meshes bends: milliseconds of the host's thread and of the device."""
    shape = sphere(0.4, Material(metallic=0.0), 8)
    shape.morph_positions = (0.3 * np.sin(7 * shape.positions))[None].astype(np.float32)
    scene, nodes = Scene("wobbling"), []
    side = int(np.ceil(np.sqrt(count)))
    for index in range(count):
        node = Node(mesh=Mesh([shape]))
        place = np.eye(4)
        place[:3, 3] = index % side - side / 2, 0.0, index // side - side / 2
        node.transform = place
        node.weights = [0.0]
        nodes.append(scene.add(node))
    before = device.memory
    renderer = pica.Renderer(scene, size=(64, 36), device=device)
    camera = pica.Camera.look_at((0.0, 20.0, 30.0), (0.0, 0.0, 0.0), vertical_fov=np.radians(50.0))
    host, passes = [], []
    for frame in range(frames + 3):
        for node in nodes:
            node.weights = [np.sin(0.1 * frame)]
        begun = time.thread_time()
        renderer.advance(camera)
        host.append((time.thread_time() - begun) * 1e3)
        passes.append(device.profiler.flush())
    result = {
        "deforming": count,
        "triangles": len(shape.indices),
        "host_cpu_ms": median(host[3:]),
        # The profiler times the first passes of a frame, no more than it has room for.
        "gpu_ms": {name: median(times[name] for times in passes[3:]) for name in passes[-1] if name != "deform"},
        "memory_mb": (device.memory - before) / 1e6,
    }
    return [result]


def main() -> None:
    """Measure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--instances", type=int, default=100_000)
    parser.add_argument("--only", choices=("moving", "coming", "refit", "small"), help="one of the measurements")
    parser.add_argument("--size", default="1920x1080")
    parser.add_argument("--device")
    arguments = parser.parse_args()
    device = Device(arguments.device)
    width, height = (int(length) for length in arguments.size.split("x"))
    measurements: dict[str, Callable[[], Iterable[dict[str, object]]]] = {
        "moving": lambda: [measure_crowd(device, arguments.instances)],
        "coming": lambda: (
            measure_coming(device, kind, count)
            for kind, count in (("copies", arguments.instances), ("nodes", arguments.instances // 5))
        ),
        "refit": lambda: measure_deforming(device, (width, height)),
        "small": lambda: measure_small_deforming(device),
    }
    for name, measure in measurements.items():
        if arguments.only in (None, name):
            for result in measure():
                print(json.dumps({"device": device.name, **result}), flush=True)


if __name__ == "__main__":
    main()

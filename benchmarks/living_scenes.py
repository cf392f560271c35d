"""Scenes that move: host time with 100,000 instances of which 100 move, and refit against rebuild.

    python benchmarks/living_scenes.py [--instances 100000] [--fox Fox.glb] [--device NAME]

Prints one JSON line a measurement: the figures of docs/performance.md.
"""

import argparse
import json
import time
from statistics import median

import numpy as np

import pica
from pica.quality.benchmark import benchmark
from pica.rhi.device import Device
from pica.scene.light import DirectionalLight
from pica.scene.material import Material
from pica.scene.model import Mesh, Node, Scene
from pica.scene.procedural.primitives import sphere


def crowd(instances: int, meshes: int = 50) -> tuple[Scene, list[Node]]:
    """Spheres on a grid, each its own node; many share a mesh."""
    scene = Scene("crowd")
    shapes = [Mesh([sphere(0.4, Material(base_color=(*color, 1.0), metallic=0.0), 12)]) for color in _colors(meshes)]
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
    camera = pica.Camera.look_at((0.0, 30.0, 60.0), (0.0, 0.0, 0.0), 50.0)
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


def measure_fox(device: Device, path: str) -> list[dict[str, object]]:
    """Refits only, the default, and a rebuild each frame: milliseconds and rays per second after 100 frames."""
    results = []
    for name, rebuild_at in (("refit only", "100"), ("default", "1.5"), ("rebuild", "1.0")):
        scene = pica.load(path, environment=pica.Environment(np.ones((1, 2, 3), np.float32)))
        settings = pica.Settings().with_values({"geometry.rebuild_at": rebuild_at})
        renderer = pica.Renderer(scene, size=(1920, 1080), settings=settings, device=device)
        camera = scene.default_camera(16 / 9)
        bottom = []
        for frame in range(100):
            scene.animate(frame / 60, "Run")
            renderer.advance(camera)
            bottom.append(device.profiler.flush().get("bottom level", 0.0))
        measured = benchmark(renderer, camera, frames=50, warm_up=5)
        results.append(
            {
                "mode": name,
                "bottom_level_ms": median(bottom),
                "bottom_level_ms_largest": max(bottom),
                "rays_per_second": measured["rays_per_second"],
            }
        )
    return results


def main() -> None:
    """Measure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--instances", type=int, default=100_000)
    parser.add_argument("--fox")
    parser.add_argument("--device")
    arguments = parser.parse_args()
    device = Device(arguments.device)
    print(json.dumps({"device": device.name, **measure_crowd(device, arguments.instances)}), flush=True)
    for result in measure_fox(device, arguments.fox) if arguments.fox else ():
        print(json.dumps({"device": device.name, **result}), flush=True)


if __name__ == "__main__":
    main()

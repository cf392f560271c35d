"""A thousand point lights: what sampling them costs, and how noisy one frame of direct light is.

    python benchmarks/many_lights.py [--size 1920x1080] [--device NAME] [--frames 200] [--reference 0]

Prints one JSON line for each number of lights and of candidates. `noise` is the mean absolute difference of a single
frame and the mean of 256, over that mean. `--reference N` also compares that mean with N path traced samples.
"""

import argparse
import json

import numpy as np

import pica
from pica.quality.benchmark import benchmark
from pica.rhi.device import Device
from pica.scene.light import PointLight
from pica.scene.material import Material
from pica.scene.model import Mesh, Node, Scene
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import move

CAMERA = pica.Camera.look_at((0.0, 6.0, 14.0), (0.0, 0.5, 0.0), vertical_fov=np.radians(50.0))
DIRECT = {"reflections.mode": "off", "global_illumination.mode": "off"}
"""Settings without what paths of depth 2 do not have."""
RUNS = ((8, 16), (100, 16), (1000, 1), (1000, 8), (1000, 16), (1000, 32))
"""Lights and candidates."""


def bazaar(lights: int) -> Scene:
    """Twenty metres of floor with boxes and balls, and small lights of many colours above it."""
    random = np.random.default_rng(7)
    scene = Scene("bazaar")
    scene.add(Node(mesh=Mesh([plane(24, 24, Material(base_color=(0.6, 0.6, 0.6, 1), metallic=0.0, roughness=0.5))])))
    for index in range(100):
        color = (*random.uniform(0.2, 0.9, 3), 1.0)
        material = Material(base_color=color, metallic=float(index % 3 == 0), roughness=random.uniform(0.2, 0.8))
        node = Node(mesh=Mesh([box(0.6, material) if index % 2 else sphere(0.35, material, 24)]))
        node.transform = move(random.uniform(-10, 10), 0.35, random.uniform(-10, 10))
        scene.add(node)
    for _ in range(lights):
        color = tuple(float(part) for part in random.uniform(0.1, 1, 3))
        node = Node(light=PointLight(color, intensity=200 / lights))
        node.transform = move(random.uniform(-10, 10), random.uniform(0.8, 2), random.uniform(-10, 10))
        scene.add(node)
    return scene


def measure(device: Device, size: tuple[int, int], lights: int, candidates: int, frames: int) -> dict[str, object]:
    """Times of the passes and the noise of one frame."""
    settings = pica.Settings().with_values({**DIRECT, "lighting.candidates": str(candidates)})
    renderer = pica.Renderer(bazaar(lights), size=size, settings=settings, device=device)
    times = benchmark(renderer, CAMERA, frames, warm_up=min(frames, 50))
    renderer.reset()
    single = renderer.render(1, camera=CAMERA).color
    mean = renderer.render(255, camera=CAMERA).color
    return {
        "device": device.name,
        "size": size,
        "lights": lights,
        "candidates": candidates,
        "gpu_ms": {name: round(time, 3) for name, time in times["gpu_ms"].items()},
        "host_ms": round(times["host_ms"], 3),
        "noise": round(float(np.abs(single - mean).mean() / mean.mean()), 3),
        "mean": [round(float(part), 5) for part in mean.mean((0, 1))],
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", default="1920x1080")
    parser.add_argument("--device")
    parser.add_argument("--frames", type=int, default=200)
    parser.add_argument("--reference", type=int, default=0)
    arguments = parser.parse_args()
    width, height = (int(length) for length in arguments.size.split("x"))
    device = Device(arguments.device)
    references: dict[int, list[float]] = {}
    for lights, candidates in RUNS:
        found = measure(device, (width, height), lights, candidates, arguments.frames)
        if arguments.reference:
            if lights not in references:
                tracer = pica.PathTracer(bazaar(lights), size=(width, height), max_depth=2, device=device)
                mean = tracer.render(arguments.reference, camera=CAMERA).color.mean((0, 1))
                references[lights] = [round(float(part), 5) for part in mean]
            found["reference mean"] = references[lights]
        print(json.dumps(found), flush=True)


if __name__ == "__main__":
    main()

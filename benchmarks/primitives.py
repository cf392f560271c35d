"""Primitives against fine meshes of the same shapes: the pictures' difference, and what rays cost.

PYTHONPATH=. python benchmarks/primitives.py
"""

import time

import numpy as np

from pica.quality.metrics import flip
from pica.rhi.device import Device
from pica.scene.primitives import spheres
from pica.scenes.basic_meshes import sphere
from pica.scenes.placing import move
from tests.building import CAMERA, RAYS, lambert, placed, render, scene_of
from tests.primitive_scenes import lit, meshes, primitives_node
from tests.rays import RayCaster

SIZE, FRAMES, COUNT, ROUNDS = (320, 180), 16, 200_000, 3


def main() -> None:
    """Measure and print."""
    device = Device()
    reference, coarser, ours = (
        render(device, lit(*nodes), FRAMES, CAMERA, SIZE, RAYS).color
        for nodes in (meshes(segments=256), meshes(segments=128), [primitives_node()])
    )
    print(f"{device.name}: FLIP against meshes of 256 segments")
    print(f"  primitives {flip(reference, ours)[0]:.4f}, meshes of 128 segments {flip(reference, coarser)[0]:.4f}")

    random = np.random.default_rng(1)
    centers = random.uniform(-1, 1, (1000, 3))
    copies = placed(sphere(0.05, lambert(), 32))
    copies.instances = np.stack([move(*center) for center in centers])
    nodes = {"spheres": primitives_node([spheres(centers, 0.05, lambert())]), "instances of 32 segments": copies}
    casters = {name: RayCaster(device, scene_of(node)) for name, node in nodes.items()}
    origins = random.normal(size=(COUNT, 3))
    origins *= 4 / np.linalg.norm(origins, axis=1, keepdims=True)
    directions = random.uniform(-1, 1, (COUNT, 3)) - origins
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    times: dict[str, list[float]] = {name: [] for name in casters}
    for cast in casters.values():
        cast(origins[:10], directions[:10])
    for _ in range(ROUNDS):
        for name, cast in casters.items():
            start = time.process_time()
            cast(origins, directions)
            times[name].append(time.process_time() - start)
    for name, seconds in times.items():
        print(f"  1000 {name}: {COUNT} rays in {min(seconds):.2f} s of processor time, copies included")


if __name__ == "__main__":
    main()

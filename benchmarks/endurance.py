"""Objects come and go for thousands of frames: does memory stay flat?

    python benchmarks/endurance.py [--frames 20000] [--device NAME]

Prints the process's resident memory and pica's own count of device memory twenty times.
"""

import argparse
import os
from collections import deque
from pathlib import Path

import numpy as np

import pica
from pica.rhi.device import Device
from pica.scene.environment import Environment
from pica.scene.material import Image, Material, Texture
from pica.scene.model import Mesh, Node, Scene
from pica.scenes.basic_meshes import plane, sphere
from pica.scenes.placing import move


def resident() -> float:
    """Megabytes that the process holds (Linux)."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def guest(seed: int) -> Node:
    """A ball with a material and a texture of its own; every fourth one morphs, every seventh one shines."""
    random = np.random.default_rng(seed)
    pixels = random.integers(0, 255, (8 << seed % 3, 16, 4)).astype(np.uint8)
    shine = (2.0, 1.0, 0.5) if seed % 7 == 0 else (0.0, 0.0, 0.0)
    material = Material(metallic=0.0, base_color_texture=Texture(Image(pixels)), emission=shine)
    section = sphere(0.3, material, 6 + seed % 9)
    node = Node(mesh=Mesh([section]))
    if seed % 4 == 0:
        section.morph_positions = random.normal(0, 0.1, (1, len(section.positions), 3)).astype(np.float32)
        node.weights = [0.0]
    node.transform = move(*random.uniform(-2, 2, 3))
    return node


def main() -> None:
    """Run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=20_000)
    parser.add_argument("--device")
    arguments = parser.parse_args()
    scene = Scene(environment=Environment(np.ones((2, 4, 3), np.float32)))
    scene.add(Node(mesh=Mesh([plane(6, 6, Material())])))
    renderer = pica.Renderer(scene, size=(64, 36), device=Device(arguments.device))
    camera = pica.Camera.look_at((0, 3, 6), (0, 0, 0), 45)
    guests: deque[Node] = deque()
    for frame in range(1, arguments.frames + 1):
        guests.append(scene.add(guest(frame)))
        if len(guests) > 5 + frame % 11:
            scene.remove(guests.popleft())
        if len(guests) > 12:
            scene.remove(guests.popleft())
        for node in guests:
            if node.weights is not None:
                node.weights = [np.sin(0.1 * frame)]
        renderer.advance(camera)
        if frame % max(arguments.frames // 20, 1) == 0:
            print(
                f"{frame} frames: resident {resident():.1f} MB, device {renderer.device.memory / 2**20:.2f} MB",
                flush=True,
            )


if __name__ == "__main__":
    main()

"""A film that goes once round what a file shows.

`pica render helmet.glb -o helmet.mp4 --turntable` does this too; here it can be changed:

    python examples/turntable.py helmet.glb helmet.mp4
"""

import argparse
import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

import pica
from pica.images.films import write_video

FPS = 25
FOV = math.radians(35)


def main() -> None:
    """Write the film."""
    parser = argparse.ArgumentParser(description="A film that goes once round what a file shows.")
    parser.add_argument("scene", help="a .gltf or .glb")
    parser.add_argument("output", help="an .mp4")
    parser.add_argument("--size", default="640x360")
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--frames", type=int, default=4, help="rendered for each picture, which is their mean")
    arguments = parser.parse_args()
    width, height = (int(length) for length in arguments.size.split("x"))

    scene = pica.load(arguments.scene)
    low, high = scene.subject_bounds()
    center, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    distance = radius / math.sin(FOV / 2) * max(1, height / width)
    count = max(round(arguments.seconds * FPS), 1)

    def pictures() -> Iterator[NDArray[np.uint8]]:
        with pica.Renderer(scene, size=(width, height)) as renderer:
            for step in range(count):
                angle = 2 * math.pi * step / count
                eye = center + distance * np.array([math.sin(angle), 0.3, math.cos(angle)])
                camera = pica.Camera.look_at(eye, center, vertical_fov=FOV, near=distance / 100)
                yield renderer.render(arguments.frames, camera=camera, aovs=()).display

    write_video(arguments.output, pictures(), FPS)


if __name__ == "__main__":
    main()

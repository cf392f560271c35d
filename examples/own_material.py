"""A material type of one's own, bricks.slang, on a wall.

Its parameters can be set at any time, as all fields of a material can:

    python examples/own_material.py wall.png
"""

import argparse
from pathlib import Path

import numpy as np

import pica


def main() -> None:
    """Render it."""
    parser = argparse.ArgumentParser(description="A material type of one's own.")
    parser.add_argument("output", help="a .png or .exr")
    parser.add_argument("--size", default="640x360")
    parser.add_argument("--frames", type=int, default=32)
    parser.add_argument("--preset", default="quality")
    arguments = parser.parse_args()
    width, height = (int(length) for length in arguments.size.split("x"))

    pica.register_material("bricks", Path(__file__).with_name("bricks.slang"))
    bricks = pica.Material(
        "bricks",
        type="bricks",
        base_color=(0.45, 0.12, 0.07, 1.0),
        parameters={"mortar": (0.5, 0.48, 0.45), "width": 0.24, "height": 0.08, "joint": 0.012},
    )
    corners = [[-2, 0, 0], [2, 0, 0], [2, 2, 0], [-2, 2, 0]]
    wall = pica.Node("wall", mesh=pica.Mesh.from_arrays(corners, [[0, 1, 2], [0, 2, 3]], material=bricks))
    scene = pica.Scene("wall", pica.Environment(np.full((4, 8, 3), 0.3)))
    scene.add(wall)
    sun = scene.add(pica.Node("sun", light=pica.DirectionalLight(illuminance=3.0)))
    sun.transform = pica.Camera.look_at((2, 3, 2), (0, 0, 0)).transform

    settings = pica.Settings.preset(arguments.preset)
    camera = pica.Camera.look_at((0.8, 1.2, 2.5), (0, 1, 0))
    with pica.Renderer(scene, size=(width, height), settings=settings) as renderer:
        renderer.render(1, camera=camera)
        bricks.parameters = {**bricks.parameters, "joint": 0.02}  # in the next frame
        renderer.render(arguments.frames, camera=camera).save(arguments.output)


if __name__ == "__main__":
    main()

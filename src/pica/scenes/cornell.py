"""The Cornell box: two boxes in a room with a red and a green wall.

After C. Goral et al., "Modeling the Interaction of Light Between Diffuse Surfaces", SIGGRAPH 1984, and the
measured box at https://www.graphics.cornell.edu/online/box/data.html; sizes and colours here are rounder.
"""

import numpy as np

from pica.scene.camera import Camera
from pica.scene.material import Material
from pica.scene.model import Node, Scene
from pica.scenes.basic_meshes import box, plane
from pica.scenes.placing import mesh, move, place, rotate


def cornell() -> Scene:
    """A room of 2 x 2 x 2 metres, open towards +Z, lit by an emissive quad under its ceiling."""

    def lambert(name: str, red: float, green: float, blue: float) -> Material:
        return Material(name, base_color=(red, green, blue, 1.0), metallic=0.0, roughness=1.0, specular=0.0)

    white = lambert("white", 0.74, 0.73, 0.70)
    red, green = lambert("red", 0.61, 0.06, 0.05), lambert("green", 0.12, 0.42, 0.10)
    lamp = lambert("lamp", 0.78, 0.78, 0.78)
    lamp.emission = (18.0, 13.5, 7.5)

    scene = Scene("cornell")
    room = scene.add(Node("room"))
    for name, material, placement in (
        ("floor", white, np.eye(4)),
        ("ceiling", white, move(0, 2, 0) @ rotate("x", 180)),
        ("back wall", white, move(0, 1, -1) @ rotate("x", 90)),
        ("left wall", red, move(-1, 1, 0) @ rotate("z", -90)),
        ("right wall", green, move(1, 1, 0) @ rotate("z", 90)),
    ):
        place(room, name, mesh(name, [plane(2, 2, material)]), placement)
    place(room, "lamp", mesh("lamp", [plane(0.5, 0.4, lamp)]), move(0, 1.99, 0) @ rotate("x", 180))
    place(room, "short box", mesh("short box", [box(0.6, white)]), move(0.34, 0.3, 0.36) @ rotate("y", -17))
    place(room, "tall box", mesh("tall box", [box((0.6, 1.2, 0.6), white)]), move(-0.34, 0.6, -0.28) @ rotate("y", 18))

    camera = Camera.look_at((0, 1, 4.9), (0, 1, 0), vertical_fov=np.radians(30.0), name="front")
    node = scene.add(Node("camera", camera=camera))
    node.transform = camera.transform
    return scene

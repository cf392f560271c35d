"""Scenes whose light is mostly indirect: two rooms with a door between them, and a court under a sun."""

import math

import numpy as np

from pica.scene.camera import Camera
from pica.scene.light import DirectionalLight, RectangleLight
from pica.scene.material import Material
from pica.scene.model import Node, Scene
from pica.scenes.basic_meshes import box, sphere
from pica.scenes.placing import aim, mesh, move, place, rotate

_WALL = 0.1
"""Metres."""


def rooms(door: float = 1.0) -> Scene:
    """Two closed rooms of 4 x 2.5 x 4 metres side by side. The lamp hangs under the ceiling of the left one; its light
    reaches the right one only through a door that is open by `door` of a right angle, 0 to 1."""
    white, warm, blue = (_matte(*color) for color in ((0.75, 0.74, 0.7), (0.75, 0.45, 0.25), (0.25, 0.35, 0.7)))
    scene = Scene("rooms")
    inside = scene.add(Node("rooms"))
    slabs = {
        "floor": ((8, _WALL, 4), (0, -_WALL / 2, 0), white),
        "ceiling": ((8, _WALL, 4), (0, 2.5 + _WALL / 2, 0), white),
        "back wall": ((8, 2.5, _WALL), (0, 1.25, -2), white),
        "front wall": ((8, 2.5, _WALL), (0, 1.25, 2), white),
        "left wall": ((_WALL, 2.5, 4), (-4, 1.25, 0), warm),
        "right wall": ((_WALL, 2.5, 4), (4, 1.25, 0), blue),
        "wall behind the door": ((_WALL, 2.5, 1.5), (0, 1.25, -1.25), white),
        "wall before the door": ((_WALL, 2.5, 1.6), (0, 1.25, 1.2), white),
        "wall over the door": ((_WALL, 0.5, 0.9), (0, 2.25, -0.05), white),
    }
    for name, (size, center, material) in slabs.items():
        place(inside, name, mesh(name, [box(size, material)]), move(*center))
    hinge = move(0, 1, -0.5) @ rotate("y", 90 * door)
    place(inside, "door", mesh("door", [box((0.04, 2.0, 0.9), warm)]), hinge @ move(0, 0, 0.45))
    place(inside, "ball", mesh("ball", [sphere(0.5, white)]), move(2.4, 0.5, -0.8))
    place(inside, "box", mesh("box", [box((0.8, 1.0, 0.8), blue)]), move(-2.6, 0.5, -0.9) @ rotate("y", 20))
    lamp = scene.add(Node("lamp", light=RectangleLight(radiance=20.0, width=0.8, height=0.8)))
    lamp.transform = move(-2, 2.45, 0) @ rotate("x", -90)
    return _seen(scene, Camera.look_at((1.2, 1.5, 1.8), (-0.2, 1.0, -1.2), vertical_fov=math.radians(75)))


def court() -> Scene:
    """A court between inside of 6 metres, one of them in the sun, under a black sky."""
    stone, red, green = (_matte(*color) for color in ((0.7, 0.66, 0.58), (0.7, 0.3, 0.22), (0.35, 0.55, 0.3)))
    scene = Scene("court")
    inside = scene.add(Node("court"))
    slabs = {
        "ground": ((12, _WALL, 12), (0, -_WALL / 2, 0), stone),
        "left wall": ((0.4, 6, 12), (-4, 3, 0), red),
        "right wall": ((0.4, 6, 12), (4, 3, 0), stone),
        "back wall": ((8, 6, 0.4), (0, 3, -5), stone),
        "front wall": ((8, 6, 0.4), (0, 3, 5), stone),
        "bench": ((2.2, 0.5, 0.6), (-2.2, 0.25, -2.5), stone),
        "hedge": ((0.8, 1.2, 4), (3, 0.6, 1), green),
    }
    for name, (size, center, material) in slabs.items():
        place(inside, name, mesh(name, [box(size, material)]), move(*center))
    for number, along in enumerate(np.linspace(-3.5, 3.5, 5)):
        place(inside, f"ball {number}", mesh("ball", [sphere(0.45, stone)]), move(-0.8, 0.45, along))
    sun = scene.add(Node("sun", light=DirectionalLight(illuminance=30.0, angular_diameter=math.radians(0.5))))
    sun.transform = aim((8, 9, 2), (0, 0, 0))
    return _seen(scene, Camera.look_at((1.8, 1.7, 4.2), (-1.0, 1.3, -2.0), vertical_fov=math.radians(65)))


def _matte(red: float, green: float, blue: float) -> Material:
    return Material(base_color=(red, green, blue, 1.0), metallic=0.0, roughness=1.0, specular=0.0)


def _seen(scene: Scene, camera: Camera) -> Scene:
    scene.add(Node("camera", camera=camera)).transform = camera.transform
    return scene

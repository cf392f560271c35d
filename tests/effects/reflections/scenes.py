"""Scenes whose reflections are tested."""

import numpy as np

import pica
from pica.scene.camera import Camera
from pica.scene.environment import Environment
from pica.scene.light import DiskLight, PointLight, RectangleLight, SphereLight, TubeLight
from pica.scene.material import AlphaMode, Material
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import move, rotate
from tests.building import lambert, placed, scene_of, shining, uniform

VIEW = Camera.look_at((0, 1.2, 3.4), (0, 0.6, 0), vertical_fov=np.radians(50))


def metal(roughness, *color):
    return Material(base_color=(*(color or (0.9, 0.8, 0.7)), 1), metallic=1.0, roughness=roughness)


def clouds():
    """A sky without a sun, whose light few rays would find."""
    fields = np.random.default_rng(0).choice([0.05, 2.0], (16, 32, 1), p=[0.7, 0.3]) * np.float32([1.0, 0.8, 0.6])
    return Environment(fields.astype(np.float32))


def furnace():
    """White metals and dielectrics under the same light from everywhere."""
    glossy = Material(base_color=(1, 1, 1, 1), metallic=0.0, roughness=0.3)
    balls = [
        placed(sphere(0.4, material), move(x, 0.5, 0)) for x, material in ((-0.9, metal(0.2, 1, 1, 1)), (0, glossy))
    ]
    return scene_of(*balls, placed(plane(3, 3, metal(0.6, 1, 1, 1))), environment=uniform(1, 1, 1)), VIEW


def glossy_room():
    """An open room of glossy walls with a lamp, a bulb and a sky through its roof."""
    wall, floor = Material(base_color=(0.7, 0.6, 0.5, 1), metallic=0.0, roughness=0.5), metal(0.5)
    bulb = lambert(0.2, emission=(6.0, 5.0, 3.0))
    return (
        scene_of(
            placed(plane(4, 4, floor)),
            placed(plane(4, 3, wall), move(0, 1.5, -2) @ rotate("x", 90)),
            placed(plane(3, 4, wall), move(-2, 1.5, 0) @ rotate("z", -90)),
            placed(sphere(0.4, metal(0.35)), move(0.4, 0.4, -0.4)),
            placed(sphere(0.2, bulb), move(-0.9, 0.5, 0.2)),
            shining(RectangleLight(radiance=8.0, width=0.8, height=0.5), move(0.8, 2.2, 0.5) @ rotate("x", -90)),
            shining(PointLight(intensity=3.0), move(-1, 1.6, -1)),
            environment=clouds(),
        ),
        VIEW,
    )


def striped_floor(alpha):
    """A metal floor before boxes that shine and a board as wide as the picture."""
    shapes = ((0.6, 1.0, 0.3), (-0.6, 0.5, -0.6), (3.0, 0.4, 0.3)), ((0.2, 0.8, 0.2), (0.5, 0.4, -0.3), (0.4, 2.0, 2.0))
    boxes = [placed(box(size, lambert(0, emission=light)), move(*place)) for size, place, light in shapes]
    board = placed(box((40, 30, 0.1), lambert(0, emission=(0.3, 0.4, 0.5))), move(0, 0, -4))
    return scene_of(placed(plane(12, 12, metal(alpha**0.5))), *boxes, board), VIEW


POLISHED = Material(base_color=(0.05, 0.05, 0.06, 1), metallic=0.0, roughness=0.15, ior=2.0)
"""Mirrors sharply, and little: area lights are shared by rays and light samples."""


def lamps(roughness=0.4, floor=None):
    """A glossy floor, or one of another material, walls and a ball below lamps of all shapes, one behind a board."""
    floor, wall = floor or metal(0.55), Material(base_color=(0.7, 0.6, 0.5, 1), metallic=0.0, roughness=0.5)
    return (
        scene_of(
            placed(plane(4, 4, floor)),
            placed(plane(4, 3, wall), move(0, 1.5, -2) @ rotate("x", 90)),
            placed(sphere(0.4, metal(roughness)), move(0.4, 0.4, -0.4)),
            placed(box((0.8, 0.8, 0.05), wall), move(-0.7, 0.4, -1.2)),
            shining(RectangleLight(radiance=3.0, width=1.4, height=1.0), move(0.8, 1.7, -1.2) @ rotate("x", -30)),
            shining(DiskLight(radiance=3.0, radius=0.7), move(-0.7, 0.9, -1.0)),
            shining(SphereLight(radiance=2.0, radius=0.45), move(-0.9, 1.5, 0)),
            shining(TubeLight(radiance=2.0, radius=0.2, length=1.0), move(0.3, 1.7, -0.6) @ rotate("z", 20)),
        ),
        VIEW,
    )


def transmissive():
    """The glossy room with a coloured pane, a rough solid, a blended layer and a leaf, each before opaque surfaces."""
    pane = Material(base_color=(0.6, 0.9, 0.7, 1), metallic=0.0, roughness=0.0, transmission=1.0, thin_walled=True)
    solid = Material(base_color=(0.9, 0.9, 0.9, 1), metallic=0.0, roughness=0.25, transmission=0.7)
    layer = Material(base_color=(0.8, 0.4, 0.3, 0.5), metallic=0.0, roughness=0.6, alpha_mode=AlphaMode.BLEND)
    leaf = lambert(0.6, 0.7, 0.2, diffuse_transmission=0.6, thin_walled=True)
    scene, camera = glossy_room()
    for node in (
        placed(plane(0.9, 0.7, pane), move(-0.45, 0.5, 1.0) @ rotate("x", 80)),
        placed(sphere(0.28, solid), move(0.75, 0.35, 0.9)),
        placed(plane(0.6, 0.5, layer), move(0.5, 1.3, 0.6) @ rotate("x", 70)),
        placed(plane(0.5, 0.5, leaf), move(-0.6, 1.4, 0.2) @ rotate("x", 60)),
    ):
        scene.add(node)
    return scene, camera


SCENES = {
    "furnace": furnace,
    "cornell": lambda: (pica.scenes.cornell(), None),
    "glossy room": glossy_room,
    "lamps": lamps,
    "lamps in a mirror": lambda: lamps(0.05),
    "lamps over a polished floor": lambda: lamps(floor=POLISHED),
    "transmissive": transmissive,
}


def under_clouds(roughness):
    """A metal floor and a ball of it, below bright and dark fields."""
    material = metal(roughness)
    nodes = placed(plane(8, 8, material)), placed(sphere(0.6, material), move(0, 0.6, 0))
    return scene_of(*nodes, environment=clouds()), VIEW

"""Scenes that are hard in motion: a room lit through its door alone, mirroring metal, a thin ring before the sky, a
yard with moving shadows, a stage with moving light."""

import math
from collections.abc import Iterable
from typing import Any

import pica
from benchmarks.textured_room import textured_room as textured_room
from pica.scene.animation import Animation
from pica.scene.camera import Camera
from pica.scene.light import DirectionalLight, RectangleLight
from pica.scene.material import Material
from pica.scene.mesh import Section
from pica.scene.model import Node, Scene
from pica.scenes.basic_meshes import box, plane, sphere, torus
from pica.scenes.motion import spin
from pica.scenes.placing import Matrix, aim, at, mesh, move, place, rotate
from pica.scenes.sky import gradient_sky

_WALL = 0.1
"""Metres."""
_ROUGHNESS = 0.0, 0.1, 0.2, 0.35, 0.6
"""Of the metal balls."""


def machine_world() -> Scene:
    """Without what lets light through, as earlier figures have it."""
    return pica.scenes.machine_world(glass=False)


def translucent() -> Scene:
    """Wax of three thicknesses, leaves and a ball on a table, lit from behind."""
    scene = Scene("translucent", gradient_sky((0.5, 0.6, 0.8), (0.6, 0.55, 0.5), (0.2, 0.17, 0.15)))
    table = scene.add(Node("table"))
    place(table, "top", mesh("top", [box((4, 0.1, 4), _matte(0.5, 0.4, 0.3))]), move(0, -0.05, 0))
    wax = {"metallic": 0.0, "roughness": 0.4, "diffuse_transmission": 1.0, "thin_walled": False}
    for x, scattering in ((-0.9, 8.0), (0.0, 25.0), (0.9, 80.0)):
        material = Material(scattering=(scattering,) * 3, absorption=(0.1, 0.6, 2.0), **wax)
        place(table, f"wax {scattering:g}", mesh("wax", [sphere(0.35, material, 48)]), move(x, 0.4, 0))
        place(table, f"block {scattering:g}", mesh("block", [box(0.4, material, 0.05)]), move(x, 0.25, -0.9))
    leaf = Material(
        base_color=(0.15, 0.4, 0.08, 1.0), metallic=0.0, roughness=0.5, double_sided=True,
        diffuse_transmission=0.5, diffuse_transmission_color=(0.5, 0.8, 0.15),
    )  # fmt: skip
    for x in (-0.5, 0.4):
        place(table, "leaf", mesh("leaf", [plane(0.5, 0.7, leaf)]), move(x, 0.45, 0.7) @ rotate("x", 60))
    sun = scene.add(Node("sun", light=DirectionalLight(illuminance=4.0, angular_diameter=math.radians(2))))
    sun.transform = aim((1.5, 2.5, -3.0), (0, 0, 0))
    return _seen(scene, Camera.look_at((1.2, 1.5, 3.2), (0, 0.3, 0), vertical_fov=math.radians(40)))


def stained_glass() -> Scene:
    """A lamp of coloured panes between dark bars, and a window of such before the sun, in a corner of a room."""
    white, wood, lead = _matte(0.7, 0.68, 0.62), _matte(0.35, 0.2, 0.1), _metal(0.15, 0.4)
    colors = (0.9, 0.3, 0.1), (0.95, 0.75, 0.2), (0.25, 0.6, 0.3), (0.2, 0.35, 0.8), (0.7, 0.2, 0.35)
    panes = [
        Material(
            base_color=(*color, 1.0), metallic=0.0, roughness=(0.0, 0.12, 0.25)[number % 3], transmission=1.0,
            thin_walled=True, double_sided=True,
        )
        for number, color in enumerate(colors)
    ]  # fmt: skip
    scene = Scene("stained glass", gradient_sky((0.5, 0.6, 0.8), (0.6, 0.55, 0.5), (0.2, 0.17, 0.15)))
    room = scene.add(Node("room"))
    _put(room, "floor", plane(4, 4, wood), move(0, 0, 0))
    _put(room, "back", plane(4, 2.6, white), move(0, 1.3, -1.5) @ rotate("x", 90))
    sides, radius, height = 12, 0.32, 0.22
    width = 2 * radius * math.tan(math.pi / sides)
    for row in range(3):
        for side in range(sides):
            turned = move(-0.5, 0.55 + row * height, 0) @ rotate("y", 360 * side / sides)
            out = turned @ move(0, 0, radius)
            pane = plane(0.9 * width, 0.92 * height, panes[(2 * side + row) % len(panes)])
            _put(room, "pane", pane, out @ rotate("x", 90))
            _put(room, "bar", box((0.1 * width, height, 0.02), lead), out @ move(width / 2, 0, 0))
            _put(room, "ring", box((width, 0.08 * height, 0.02), lead), out @ move(0, height / 2, 0))
    _put(room, "bulb", sphere(0.09, _glowing(30, 24, 15)), move(-0.5, 0.8, 0))
    for column in range(4):
        for row in range(4):
            at = move(0.75 + 0.3 * column, 0.35 + 0.32 * row, -0.6) @ rotate("y", -25)
            _put(room, "window", plane(0.27, 0.29, panes[(column + 2 * row) % len(panes)]), at @ rotate("x", 90))
            _put(room, "frame", box((0.03, 0.32, 0.03), lead), at @ move(0.15, 0, 0))
            _put(room, "frame", box((0.3, 0.03, 0.03), lead), at @ move(0, 0.16, 0))
    sun = scene.add(Node("sun", light=DirectionalLight(illuminance=6.0, angular_diameter=math.radians(0.5))))
    sun.transform = aim((2.2, 2.6, -3.0), (0.8, 0, 0.6))
    return _seen(scene, Camera.look_at((0.5, 1.4, 3.4), (0.2, 0.7, 0), vertical_fov=math.radians(36)))


def door() -> Scene:
    """A closed room of 4 x 2.5 x 4 metres; the sun shines into the yard behind its door and through it on the floor."""
    white, red, green = _matte(0.75, 0.74, 0.7), _matte(0.7, 0.3, 0.22), _matte(0.3, 0.55, 0.3)
    scene = _of_boxes(
        "door",
        ((6.4, _WALL, 4.2), (1.2, -_WALL / 2, 0), white),
        ((4.2, _WALL, 4.2), (0, 2.5 + _WALL / 2, 0), white),
        ((4.2, 2.5, _WALL), (0, 1.25, -2.05), red),
        ((4.2, 2.5, _WALL), (0, 1.25, 2.05), white),
        ((_WALL, 2.5, 4), (-2.05, 1.25, 0), green),
        ((_WALL, 2.5, 1.5), (2.05, 1.25, -1.25), white),
        ((_WALL, 2.5, 1.5), (2.05, 1.25, 1.25), white),
        ((_WALL, 0.5, 1.0), (2.05, 2.25, 0), white),
        ((_WALL, 2.5, 4.2), (4.45, 1.25, 0), white),
        ((0.7, 0.7, 0.7), (-1.1, 0.35, -1.1), white),
    )
    place(scene.roots[0], "ball", mesh("ball", [sphere(0.4, white)]), move(0.4, 0.4, -1.2))
    sun = scene.add(Node("sun", light=DirectionalLight(illuminance=30.0, angular_diameter=math.radians(0.5))))
    sun.transform = aim((3, 4.5, 1.2), (0, 0, 0))
    return _seen(scene, Camera.look_at((-1.2, 1.5, 1.7), (0.6, 0.9, -1.0), vertical_fov=math.radians(70)))


def metal() -> Scene:
    """A closed room of 5 x 2.5 x 5 metres with a mirroring floor, and balls from a mirror to rough metal."""
    white, red, blue = _matte(0.75, 0.74, 0.7), _matte(0.7, 0.25, 0.2), _matte(0.2, 0.3, 0.65)
    scene = _of_boxes(
        "metal",
        ((5.2, _WALL, 5.2), (0, -_WALL / 2, 0), _metal(0.9, 0.05)),
        ((5.2, _WALL, 5.2), (0, 2.5 + _WALL / 2, 0), white),
        ((5.2, 2.5, _WALL), (0, 1.25, -2.55), white),
        ((5.2, 2.5, _WALL), (0, 1.25, 2.55), white),
        ((_WALL, 2.5, 5), (-2.55, 1.25, 0), red),
        ((_WALL, 2.5, 5), (2.55, 1.25, 0), blue),
        ((0.6, 1.2, 0.6), (1.6, 0.6, -1.7), white),
    )
    for number, roughness in enumerate(_ROUGHNESS):
        ball = mesh("ball", [sphere(0.35, _metal(0.8, roughness))])
        place(scene.roots[0], f"ball {number}", ball, move(0.85 * (number - 2), 0.35, -0.9 + 0.3 * (number % 2)))
    lamp = scene.add(Node("lamp", light=RectangleLight(radiance=15.0, width=1.2, height=0.8)))
    lamp.transform = move(0, 2.45, 0) @ rotate("x", -90)
    return _seen(scene, Camera.look_at((0.3, 1.4, 2.2), (0, 0.5, -1.0), vertical_fov=math.radians(70)))


def mirrored_panel() -> Scene:
    """A wall of light, mirrored by six floors."""
    panel = box((3.6, 1.0, 0.05), _glowing(3, 2, 1))
    return _mirrored("mirrored panel", [(panel, (0.0, 1.0, -2.8))])


def mirrored_tubes() -> Scene:
    """Six neon tubes of 2 centimetres, mirrored by six floors."""
    colors = (30.0, 3.0, 10.0), (3.0, 20.0, 30.0), (20.0, 20.0, 3.0)
    tubes = [box((0.5, 0.02, 0.02), _glowing(*color)) for color in colors]
    return _mirrored("mirrored tubes", [(tubes[k % 3], (-2 + 0.8 * k, 0.5 + 0.2 * (k % 2), -2.5)) for k in range(6)])


def mirrored_bulbs() -> Scene:
    """Twelve bulbs of 8 centimetres, mirrored by six floors."""
    colors = (60.0, 30.0, 10.0), (10.0, 40.0, 60.0), (50.0, 50.0, 13.0)
    bulbs = [sphere(0.04, _glowing(*color), 16) for color in colors]
    return _mirrored("mirrored bulbs", [(bulbs[k % 3], (-2.2 + 0.4 * k, 0.4 + 0.3 * (k % 3), -2.4)) for k in range(12)])


def ring() -> Scene:
    """An upright ring with a tube of 3 centimetres, before a smooth sky."""
    sky = gradient_sky(zenith=(0.25, 0.4, 0.8), horizon=(0.8, 0.85, 0.9), nadir=(0.3, 0.28, 0.25))
    scene = Scene("ring", sky)
    violet = Material("violet", base_color=(0.9, 0.3, 0.8, 1.0), metallic=0.0, roughness=0.5)
    place(scene.add(Node("ring")), "torus", mesh("torus", [torus(1.0, 0.03, violet, segments=96)]), rotate("x", 90))
    sun = scene.add(Node("sun", light=DirectionalLight(illuminance=3.0, angular_diameter=math.radians(0.5))))
    sun.transform = aim((3, 5, 4), (0, 0, 0))
    return _seen(scene, Camera.look_at((0, 0, 4), (0, 0, 0), vertical_fov=math.radians(45)))


def yard() -> Scene:
    """A ball on an arm, a board and a fan that turn in the sun before a mirror: shadows and images move."""
    scene = Scene("yard", gradient_sky(zenith=(0.25, 0.45, 1.0), horizon=(0.9, 0.95, 1.0), nadir=(0.3, 0.28, 0.25)))
    ground = scene.add(Node("ground"))
    _put(ground, "floor", box((40, 0.2, 40), _matte(0.55, 0.53, 0.5)), move(0, -0.1, 0))
    _put(ground, "wall", box((6, 3, 0.2), _matte(0.8, 0.75, 0.7)), move(0, 1.5, -3))
    _put(ground, "mirror", box((2, 1.4, 0.05), _metal(0.95, 0.02)), move(1.8, 1.3, -2.85))
    sun = scene.add(Node("sun", light=DirectionalLight(illuminance=6.0, angular_diameter=math.radians(0.53))))
    sun.transform = aim((4, 6, 3), (0, 0, 0))
    turning = {
        "arm": ([at(sphere(0.25, _matte(0.9, 0.6, 0.1)), move(0.9, 0.4, 0))], move(-1.2, 0, 0.6), (0, 1, 0), 12),
        "board": ([box((1, 1, 0.03), _matte(0.15, 0.4, 0.8))], move(2.0, 0.7, 0.4), (0, 1, 0), 10),
        "fan": (
            [at(box((1.4, 0.06, 0.02), _matte(0.9, 0.9, 0.9)), rotate("z", 60 * blade)) for blade in range(3)],
            move(-2.2, 2.4, -1), (0, 0, 1), 14,
        ),
    }  # fmt: skip
    for name, (sections, where, axis, turns) in turning.items():
        node = place(ground, name, mesh(name, sections), where)
        scene.animations = [*scene.animations, Animation(spin(node, axis, turns), name)]
    return _seen(scene, Camera.look_at((0, 1.7, 4.6), (0, 0.9, -1.2), vertical_fov=math.radians(55)))


def stage() -> Scene:
    """Two sticks and a bulb that glow turn over a polished floor, before a wall and past three balls: light moves."""
    sky = gradient_sky(zenith=(0.01, 0.01, 0.02), horizon=(0.02, 0.02, 0.03), nadir=(0.01, 0.01, 0.01))
    scene = Scene("stage", sky)
    set_ = scene.add(Node("set"))
    polished = Material("polished", base_color=(0.12, 0.12, 0.13, 1.0), metallic=0.0, roughness=0.2)
    _put(set_, "floor", box((16, 0.2, 16), polished), move(0, -0.1, 0))
    _put(set_, "wall", box((12, 5, 0.2), _matte(0.45, 0.42, 0.4)), move(0, 2.5, -3))
    for number, material in enumerate((_matte(0.8, 0.8, 0.8), _metal(0.9, 0.2), _matte(0.8, 0.3, 0.2))):
        _put(set_, f"ball {number}", sphere(0.4, material), move(-1.8 + 1.8 * number, 0.4, -0.6))
    shining = {
        "left stick": (box((0.05, 1.2, 0.05), _glowing(20, 4, 12)), move(-1.2, 1.3, -1.2), (0, 0, 1)),
        "right stick": (box((0.05, 1.2, 0.05), _glowing(3, 14, 20)), move(1.3, 1.3, -0.6), (0, 0, -1)),
        "bulb": (at(sphere(0.06, _glowing(120, 110, 90)), move(1.8, 1.6, 0.8)), move(0, 0, -0.8), (0, 1, 0)),
    }
    for name, (section, where, axis) in shining.items():
        node = place(set_, name, mesh(name, [section]), where)
        scene.animations = [*scene.animations, Animation(spin(node, axis, 12), name)]
    return _seen(scene, Camera.look_at((0, 1.8, 5.2), (0, 1.1, -1), vertical_fov=math.radians(55)))


def ball(scene: Scene, radius: float) -> Node:
    """A white ball in a scene."""
    return place(scene.add(Node("ball")), "sphere", mesh("ball", [sphere(radius, _matte(0.8, 0.8, 0.8))]))


def _glowing(*emission: float) -> Material:
    return _matte(0.0, 0.0, 0.0, emission=emission)


def _mirrored(name: str, lamps: list[tuple[Section, tuple[float, float, float]]]) -> Scene:
    """Lamps before a wall, over dull floors of roughness .05, .12 and .25 and metal ones of .12, .25 and .4."""
    scene = Scene(name)
    room = scene.add(Node("room"))
    dark = 0.05, 0.05, 0.06, 1.0
    floors = [Material(base_color=dark, metallic=0.0, roughness=roughness) for roughness in (0.05, 0.12, 0.25)]
    floors += [_metal(0.8, roughness) for roughness in (0.12, 0.25, 0.4)]
    for number, floor in enumerate(floors):
        _put(room, f"floor {number}", plane(0.8, 5, floor), move(-2 + 0.8 * number, 0, -0.5))
    _put(room, "wall", box((8, 3, 0.1), _matte(0.5, 0.48, 0.45)), move(0, 1.5, -3))
    for lamp, place_of_lamp in lamps:
        _put(room, "lamp", lamp, move(*place_of_lamp))
    return _seen(scene, Camera.look_at((0, 1.5, 2), (0, 0.5, -1.5), vertical_fov=math.radians(58)))


def _of_boxes(name: str, *boxes: tuple[Iterable[float], tuple[float, float, float], Material]) -> Scene:
    scene = Scene(name)
    inside = scene.add(Node(name))
    for number, (size, center, material) in enumerate(boxes):
        _put(inside, f"box {number}", box(list(size), material), move(*center))
    return scene


def _put(parent: Node, name: str, section: Section, where: Matrix) -> None:
    place(parent, name, mesh(name, [section]), where)


def _matte(red: float, green: float, blue: float, **more: Any) -> Material:
    return Material(base_color=(red, green, blue, 1.0), metallic=0.0, roughness=1.0, specular=0.0, **more)


def _metal(reflectance: float, roughness: float) -> Material:
    return Material(base_color=(reflectance, reflectance, reflectance, 1.0), metallic=1.0, roughness=roughness)


def _seen(scene: Scene, camera: Camera) -> Scene:
    scene.add(Node("camera", camera=camera)).transform = camera.transform
    return scene

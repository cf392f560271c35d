"""Scenes made at random: a place, lights, and things of all kinds of materials. The same seed gives the same scene."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from benchmarks.textured_room import bricks, rust, scratched, screen, tiles
from pica.scene.anisotropy import Anisotropy
from pica.scene.camera import Camera
from pica.scene.coat import Coat
from pica.scene.environment import Environment
from pica.scene.iridescence import Iridescence
from pica.scene.light import (
    DirectionalLight,
    DiskLight,
    Light,
    PointLight,
    RectangleLight,
    SphereLight,
    SpotLight,
    TubeLight,
)
from pica.scene.material import AlphaMode, Material, Texture
from pica.scene.mesh import Section
from pica.scene.model import Node, Scene
from pica.scene.sheen import Sheen
from pica.scenes.basic_meshes import box, cylinder, sphere, torus
from pica.scenes.placing import Matrix, mesh, move, place, rotate

Random = np.random.Generator
Color = tuple[float, float, float]

OPEN_PLACES, ROOFED_PLACES = ("plain", "court"), ("room", "hall")
"""Below a sky; a closed room, and one with a window."""
_WALL = 0.1
"""Metres."""


def random_scene(seed: int, glass: bool = False, textures: bool = False) -> Scene:
    """`glass`: with transmissive, blended and scattering materials, whose caustics frames lack; `textures`: with the
    materials of textured_room.py. Either makes another scene of a seed."""
    random = np.random.default_rng(seed)
    kind = str(random.choice((*ROOFED_PLACES, *OPEN_PLACES)))
    width, height = float(random.uniform(3, 8)), float(random.uniform(2.2, 4))
    below_sky = kind != "room"
    scene = Scene(f"{kind} {seed}", environment=_sky(random) if below_sky and random.random() < 0.8 else None)
    _surroundings(scene, random, kind, width, height)
    if below_sky and (scene.environment is None or random.random() < 0.5):
        sun = DirectionalLight(
            illuminance=float(random.uniform(2, 8)), angular_diameter=math.radians(random.choice((0.5, 3.0, 10.0)))
        )
        turned = rotate("y", random.uniform(-180, 180)) @ rotate("x", -random.uniform(15, 80))
        scene.add(Node("sun", light=sun)).transform = turned
    for _ in range(random.integers(1, 4) if kind == "room" else random.integers(0, 3)):
        _light(scene, random, width, height, kind)
    materials = {**OPAQUE, **(TEXTURED if textures else {}), **(TRANSPARENT if glass else {})}
    for number in range(random.integers(6, 14)):
        _thing(scene, random, number, width, materials)
    eye = random.uniform(-0.25, 0.25) * width, random.uniform(0.5, 0.7) * height, 0.46 * width
    target = random.uniform(-0.15, 0.15) * width, random.uniform(0.2, 0.45) * height, -0.15 * width
    camera = Camera.look_at(eye, target, vertical_fov=math.radians(random.uniform(45, 70)))
    scene.add(Node("camera", camera=camera)).transform = camera.transform
    return scene


def _surroundings(scene: Scene, random: Random, kind: str, width: float, height: float) -> None:
    walls = [OPAQUE[str(random.choice(("matte", "textured")))](random) for _ in range(5)]
    floor = OPAQUE[str(random.choice(("matte", "plastic", "textured", "bumps", "metal", "coat")))](random)
    ground = 40.0 if kind == "plain" else width
    _put(scene, "floor", box((ground, _WALL, ground), floor), move(0, -_WALL / 2, 0))
    aside, middle = width / 2, height / 2
    sides = {
        "back": ((width, height, _WALL), (0, middle, -aside)),
        "left": ((_WALL, height, width), (-aside, middle, 0)),
        "right": ((_WALL, height, width), (aside, middle, 0)),
        "front": ((width, height, _WALL), (0, middle, aside)),
        "ceiling": ((width, _WALL, width), (0, height + _WALL / 2, 0)),
    }
    if kind == "hall":  # the right wall has a window from side to side
        low, high = 0.3 * height, 0.25 * height
        sides["right"] = (_WALL, low, width), (aside, low / 2, 0)
        _put(scene, "lintel", box((_WALL, high, width), walls[2]), move(aside, height - high / 2, 0))
    shown = {"plain": 0, "court": 3}.get(kind, 5)
    for (name, (size, where)), material in list(zip(sides.items(), walls, strict=True))[:shown]:
        _put(scene, name, box(size, material), move(*where))


def _light(scene: Scene, random: Random, width: float, height: float, kind: str) -> None:
    color = _color(random, 0.6, 1.0)
    power = random.uniform(15, 60) * (width / 5) ** 2
    size = float(random.uniform(0.05, 0.6))
    x, z = random.uniform(-0.35, 0.35, 2) * width
    where = move(x, random.uniform(0.55, 0.95) * height, z)
    down = where @ rotate("y", random.uniform(-180, 180)) @ rotate("x", -random.uniform(30, 90))
    radiance = float(power / (math.pi * size * size))
    made: dict[str, tuple[Light, Matrix]] = {
        "point": (PointLight(color, float(power / 6)), where),
        "spot": (SpotLight(color, float(power / 2), outer_cone_angle=float(random.uniform(0.3, 0.9))), down),
        "sphere": (SphereLight(color, radiance / 4, radius=size / 3), where),
        "rectangle": (RectangleLight(color, radiance / 2, width=2 * size, height=size), down),
        "disk": (DiskLight(color, radiance, radius=size), down),
        "tube": (TubeLight(color, float(power / 6), length=1.0, radius=0.03), where),
    }
    name = str(random.choice((*made, "panel", "bulbs")))
    if name in made:
        light, transform = made[name]
        scene.add(Node(name, light=light)).transform = transform
    elif name == "panel" and kind in ROOFED_PLACES:
        panel = _glowing(np.multiply(color, radiance / 4))
        _put(scene, name, box((2 * size, 0.03, 2 * size), panel), move(x, height - 0.03, z))
    else:
        for _ in range(random.integers(2, 16)):
            at = random.uniform((-0.45 * width, 0.1, -0.45 * width), (0.45 * width, 0.95 * height, 0.45 * width))
            bulb = _glowing(np.multiply(color, random.uniform(20, 200)))
            _put(scene, "bulb", sphere(0.04, bulb, 16), move(*at))


def _thing(scene: Scene, random: Random, number: int, width: float, materials: dict[str, Callable]) -> None:
    kind = str(random.choice(list(materials)))
    material, size = materials[kind](random), float(random.uniform(0.03, 0.18)) * width / 2
    shapes: list[tuple[Section, float]] = [
        (sphere(size, material, 48), size),
        (box((2 * size, 1.2 * size, 2 * size), material, bevel=0.1 * size), 0.6 * size),
        (torus(size, size * random.uniform(0.1, 0.4), material, 48), 0.4 * size),
        (cylinder(0.6 * size, 2 * size, material, fillet=0.05 * size, segments=48), size),
        (box((2 * size, 2 * size, 0.06 * size), material), size),
        (cylinder(0.05 * size, 3 * size, material), 1.5 * size),
    ]
    if kind in FLAT:
        shapes = shapes[4:5]
    section, above = shapes[random.integers(len(shapes))]
    x, z = random.uniform(-0.4, 0.4) * width, random.uniform(-0.42, 0.2) * width
    lift = float(random.choice((0.002, 0.002, random.uniform(0.1, 1.2))))
    tilted = rotate("y", random.uniform(0, 360)) @ rotate("x", random.uniform(-30, 30) if lift > 0.1 else 0)
    _put(scene, f"{number} {kind}", section, move(x, above + lift, z) @ tilted)


def _put(scene: Scene, name: str, section: Section, transform: Matrix) -> None:
    node = scene.add(Node(name))
    place(node, name, mesh(name, [section]), transform)


def _color(random: Random, low: float = 0.05, high: float = 0.9) -> Color:
    red, green, blue = random.uniform(low, high) * random.uniform(0.4, 1, 3)
    return float(red), float(green), float(blue)


def _dielectric(random: Random, **values) -> Material:
    parts = {"base_color": (*_color(random), 1.0), "metallic": 0.0, "roughness": float(random.uniform(0.05, 1))}
    return Material(**{**parts, **values})


def _metal(random: Random, low: float, high: float, **values) -> Material:
    color = (*_color(random, 0.5, 0.95), 1.0)
    return Material(base_color=color, metallic=1.0, roughness=float(random.uniform(low, high)), **values)


def _glowing(radiance: NDArray[np.float64]) -> Material:
    red, green, blue = (float(value) for value in radiance)
    return Material(base_color=(0.0, 0.0, 0.0, 1.0), metallic=0.0, emission=(red, green, blue))


def _patches(random: Random, cells: int) -> Texture:
    colors = random.uniform(0.05, 0.9, (cells, cells, 3))
    return Texture.from_array(np.kron(colors, np.ones((128 // cells, 128 // cells, 1))), encoding="srgb")


def _bumps(random: Random) -> Texture:
    across, down = np.meshgrid(np.arange(64), np.arange(64))
    height = sum(
        np.sin(2 * np.pi * (across * random.integers(1, 6) + down * random.integers(1, 6)) / 64 + random.uniform(0, 6))
        for _ in range(4)
    )
    slopes = [np.roll(height, -1, axis) - np.roll(height, 1, axis) for axis in (1, 0)]
    normals = np.stack([-slopes[0], -slopes[1], np.full((64, 64), 4.0)], -1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return Texture.from_array((normals + 1) / 2, encoding="linear")


def _leaf(random: Random) -> Material:
    across, down = np.meshgrid(np.arange(64), np.arange(64))
    pixels = np.ones((64, 64, 4))
    pixels[..., :3], pixels[..., 3] = _color(random), (across // 8 + down // 8) % 2
    texture = Texture.from_array(pixels, encoding="srgb")
    return Material(base_color_texture=texture, metallic=0.0, alpha_mode=AlphaMode.MASK, double_sided=True)


def _sky(random: Random) -> Environment:
    up = np.linspace(1, -1, 32)[:, None, None]
    zenith = np.array(_color(random, 0.3, 1.5))
    horizon = zenith * random.uniform(0.6, 2.5, 3)
    radiance = np.where(up > 0, horizon + (zenith - horizon) * np.sqrt(np.abs(up)), 0.25 * zenith)
    return Environment(np.broadcast_to(radiance, (32, 64, 3)).astype(np.float32))


OPAQUE: dict[str, Callable[[Random], Material]] = {
    "matte": lambda random: _dielectric(random, roughness=1.0, specular=0.0),
    "plastic": _dielectric,
    "mirror": lambda random: _metal(random, 0.0, 0.25),
    "metal": lambda random: _metal(random, 0.25, 0.9),
    "mixed": lambda random: _dielectric(random, metallic=float(random.uniform(0.2, 0.8))),
    "coat": lambda random: _dielectric(random, coats=(Coat(roughness=float(random.uniform(0, 0.3))),)),
    "lacquered": lambda random: _metal(random, 0.2, 0.6, coats=(Coat(),)),
    "sheen": lambda random: _dielectric(random, sheen=Sheen(_color(random, 0.4, 0.9), float(random.uniform(0.2, 0.7)))),
    "brushed": lambda random: _metal(random, 0.2, 0.6, anisotropy=Anisotropy(strength=float(random.uniform(0.3, 0.9)))),
    "film": lambda random: _dielectric(random, iridescence=Iridescence()),
    "textured": lambda random: _dielectric(
        random, base_color=(1.0,) * 4, base_color_texture=_patches(random, int(2 ** random.integers(2, 6)))
    ),
    "bumps": lambda random: _dielectric(random, normal_texture=_bumps(random)),
    "leaf": _leaf,
    "glowing": lambda random: _dielectric(random, emission=_color(random, 0.05, 1.5)),
}
"""By name: makes a material."""
TEXTURED: dict[str, Callable[[Random], Material]] = {
    "bricks": bricks,
    "tiles": lambda random: tiles(),
    "scratched": scratched,
    "rust": rust,
    "screen": screen,
}
TRANSPARENT: dict[str, Callable[[Random], Material]] = {
    "glass": lambda random: Material(metallic=0.0, roughness=0.0, transmission=1.0, thin_walled=False),
    "frosted": lambda random: _dielectric(random, base_color=(1.0,) * 4, transmission=1.0, thin_walled=False),
    "pane": lambda random: _dielectric(random, roughness=0.0, transmission=float(random.uniform(0.5, 1))),
    "layer": lambda random: _dielectric(
        random, base_color=(*_color(random), float(random.uniform(0.2, 0.8))), alpha_mode=AlphaMode.BLEND
    ),
    "wax": lambda random: _dielectric(random, diffuse_transmission=1.0, thin_walled=False, scattering=(20.0,) * 3),
    "paper": lambda random: _dielectric(random, diffuse_transmission=0.5, double_sided=True),
}
FLAT = "leaf", "pane", "layer", "paper"
"""Materials of boards."""

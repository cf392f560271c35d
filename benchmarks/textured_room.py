"""A room of textures: bricks with mortar, a tiled floor, scratched metal, rust, a screen, a painted wall."""

import math

import numpy as np
from numpy.typing import NDArray

from pica.color import srgb_encode
from pica.scene.camera import Camera
from pica.scene.light import RectangleLight, SpotLight
from pica.scene.material import Material, Texture
from pica.scene.mesh import Section
from pica.scene.model import Node, Scene
from pica.scenes.basic_meshes import box, cylinder, sphere
from pica.scenes.placing import Matrix, aim, mesh, move, place, rotate

Pixels = NDArray[np.floating]

_TEXELS = 512
_WIDTH, _HEIGHT, _WALL = 5.0, 2.8, 0.1
"""Metres."""
_ROW, _COLUMN = np.mgrid[0:_TEXELS, 0:_TEXELS]


def textured_room() -> Scene:
    """The materials' textures are all made here, so that no file is needed."""
    random = np.random.default_rng(5)
    brick, tile, metal, rusty = bricks(random), tiles(), scratched(random), rust(random)
    white = Material(base_color=(0.8, 0.8, 0.8, 1.0), metallic=0.0, roughness=0.9)
    scene, aside, middle = Scene("textured room"), _WIDTH / 2, _HEIGHT / 2
    _put(scene, "floor", box((_WIDTH, _WALL, _WIDTH), tile), move(0, -_WALL / 2, 0))
    _put(scene, "ceiling", box((_WIDTH, _WALL, _WIDTH), white), move(0, _HEIGHT + _WALL / 2, 0))
    for name, z in (("back", -aside), ("front", aside)):
        _put(scene, name, box((_WIDTH, _HEIGHT, _WALL), brick), move(0, middle, z))
    for name, x, material in (("left", -aside, brick), ("right", aside, _painted(random))):
        _put(scene, name, box((_WALL, _HEIGHT, _WIDTH), material), move(x, middle, 0))
    _put(scene, "screen", box((1.6, 0.9, 0.04), screen(random)), move(-0.9, 1.3, 0.1 - aside))
    _put(scene, "sheet", box((1.2, 1.6, 0.04), metal), move(1.2, 0.85, -1.4) @ rotate("y", -20))
    _put(scene, "ball", sphere(0.4, metal, 64), move(0.1, 0.4, -0.3))
    _put(scene, "rusty ball", sphere(0.35, rusty, 64), move(-1.1, 0.35, -0.2))
    _put(scene, "crate", box((0.7, 0.7, 0.7), rusty, bevel=0.03), move(-1.6, 0.35, -1.4) @ rotate("y", 30))
    _put(scene, "pillar", cylinder(0.18, _HEIGHT, brick, segments=48), move(1.7, middle, -0.3))
    lamp = RectangleLight((1.0, 0.9, 0.8), 8.0, width=0.8, height=0.4)
    scene.add(Node("lamp", light=lamp)).transform = move(0.8, _HEIGHT - 0.02, -0.2) @ rotate("x", -90)
    spot = SpotLight(intensity=40.0, outer_cone_angle=0.45)
    scene.add(Node("spot", light=spot)).transform = aim((-1.5, _HEIGHT - 0.1, 1.2), (aside, 1.2, 0.2))
    camera = Camera.look_at((0.3, 1.5, 2.2), (0.1, 0.9, -1), vertical_fov=1.0)
    scene.add(Node("camera", camera=camera)).transform = camera.transform
    return scene


def _put(scene: Scene, name: str, section: Section, where: Matrix) -> None:
    place(scene.add(Node(name)), name, mesh(name, [section]), where)


def _material(color: Pixels, roughness: Pixels | float, metallic: Pixels | float, height: Pixels) -> Material:
    """Of (rows, columns, 3) linear colours, (rows, columns) of the others; `height` in texels."""
    packed = np.stack(np.broadcast_arrays(np.zeros_like(height), roughness, metallic), -1)
    slopes = [np.roll(height, -1, axis) - np.roll(height, 1, axis) for axis in (1, 0)]
    normals = np.stack([-slopes[0], -slopes[1], np.ones_like(height)], -1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return Material(
        base_color_texture=Texture.from_array(srgb_encode(color.clip(0, 1)), encoding="srgb"),
        metallic_roughness_texture=Texture.from_array(packed, encoding="linear"),
        normal_texture=Texture.from_array((normals + 1) / 2, encoding="linear"),
        metallic=1.0,
        roughness=1.0,
    )


def _cloudy(random: np.random.Generator, width: float) -> Pixels:
    """Periodic noise of deviation 1, whose features are so many texels wide."""
    square = np.fft.fftfreq(_TEXELS)[:, None] ** 2 + np.fft.fftfreq(_TEXELS) ** 2
    spectrum = np.fft.fft2(random.normal(size=(_TEXELS, _TEXELS))) * np.exp(-20 * square * width**2)
    noise = np.fft.ifft2(spectrum).real
    return noise / noise.std()


def bricks(random: np.random.Generator) -> Material:
    """With mortar, which lies deeper."""
    course = _ROW // 64
    shifted = _COLUMN + course % 2 * 64
    mortar = (_ROW % 64 < 6) | (shifted % 128 < 6)
    tint = random.uniform(0.6, 1.2, (8, 4))[course, shifted // 128 % 4] * (1 + 0.1 * _cloudy(random, 3))
    color = np.where(mortar[..., None], (0.55, 0.53, 0.5), np.multiply.outer(tint, (0.5, 0.2, 0.13)))
    return _material(color, np.where(mortar, 0.95, 0.6), 0.0, np.where(mortar, 0, 1) + 0.15 * _cloudy(random, 3))


def tiles() -> Material:
    """A checkerboard, every second tile polished."""
    odd, joint = (_COLUMN // 64 + _ROW // 64) % 2 == 1, (_COLUMN % 64 < 2) | (_ROW % 64 < 2)
    color = np.where(odd[..., None], (0.8, 0.78, 0.7), (0.1, 0.12, 0.2))
    color[joint] = 0.3
    return _material(color, np.where(joint, 0.9, np.where(odd, 0.08, 0.35)), 0.0, np.where(joint, 0.0, 0.3))


def scratched(random: np.random.Generator) -> Material:
    """Metal of roughness 0.12 and 0.27, with lines of 0.6."""
    roughness = 0.12 + 0.15 * (_cloudy(random, 8) > 0.6)
    for _ in range(160):
        x, y = random.uniform(0, _TEXELS, 2)
        angle, length = random.uniform(0, math.pi), random.uniform(40, 300)
        steps = np.linspace(0, length, int(2 * length))
        rows, columns = (
            (start + steps * way).astype(int) % _TEXELS for start, way in ((y, math.sin(angle)), (x, math.cos(angle)))
        )
        roughness[rows, columns] = 0.6
    color = np.broadcast_to((0.9, 0.85, 0.8), (_TEXELS, _TEXELS, 3))
    return _material(color, roughness, 1.0, np.zeros_like(roughness))


def rust(random: np.random.Generator) -> Material:
    """Spots of metal, higher than the dielectric around."""
    bare = _cloudy(random, 20) > 0
    color = np.where(bare[..., None], (0.9, 0.7, 0.4), (0.15, 0.3, 0.25))
    return _material(color, np.where(bare, 0.3, 0.8), bare.astype(float), 0.5 * bare)


def _painted(random: np.random.Generator) -> Material:
    """Fields of 0.6 m."""
    color = np.kron(random.uniform(0.02, 0.9, (8, 8, 3)), np.ones((64, 64, 1)))
    return _material(color, 0.9, 0.0, np.zeros((_TEXELS, _TEXELS)))


def screen(random: np.random.Generator) -> Material:
    """Discs that shine in several colours."""
    pixels = np.zeros((128, 128, 3))
    for _ in range(20):
        (x, y), radius = random.uniform(0, 128, 2), random.uniform(5, 25)
        inside = (_COLUMN[:128, :128] - x) ** 2 + (_ROW[:128, :128] - y) ** 2 < radius**2
        pixels[inside] = random.uniform(0, 1, 3)
    return Material(
        base_color=(0.0, 0.0, 0.0, 1.0),
        emission=(6.0, 6.0, 6.0),
        emissive_texture=Texture.from_array(pixels, encoding="srgb"),
        metallic=0.0,
        roughness=0.3,
    )

"""A closed room of walls that glow and reflect half: what absorbs nothing in it nearly disappears."""

import numpy as np
import pytest

import pica
from pica.scene.camera import Camera
from pica.scene.coat import Coat
from pica.scene.material import AlphaMode, Material
from pica.scenes.basic_meshes import box, cylinder, plane, sphere
from pica.scenes.placing import move, rotate
from tests.building import placed, scene_of

CAMERA = Camera.look_at((0, 1.4, 2.7), (0, 1.2, -1), vertical_fov=np.radians(62))
SIZE = (96, 54)
WALLS = 6


def white(**more) -> Material:
    return Material(**{"base_color": (1.0, 1.0, 1.0, 1.0), "metallic": 0.0, "roughness": 0.6, "specular": 0.0, **more})


def furnace(*nodes):
    glow = Material(base_color=(0.5, 0.5, 0.5, 1.0), metallic=0.0, roughness=0.8, emission=(0.5, 0.5, 0.5))
    flat, across, along = box((6, 0.1, 6), glow), box((6, 3, 0.1), glow), box((0.1, 3, 6), glow)
    places = (0, -0.05, 0), (0, 3.05, 0), (0, 1.5, -3.05), (0, 1.5, 3.05), (-3.05, 1.5, 0), (3.05, 1.5, 0)
    kinds = flat, flat, across, across, along, along
    walls = [placed(wall, move(*place)) for wall, place in zip(kinds, places, strict=True)]
    return scene_of(*walls, *nodes)


@pytest.mark.parametrize(
    "material, lost",
    [(white(), 0.025), (white(metallic=1.0, roughness=0.2), 0.15)],
    ids=["diffuse", "metal"],
)
def test_wires_as_thin_as_a_pixel_are_as_bright_as_the_walls_behind_them(device, material, lost):
    """No ray of half size meets some of their pixels, and these have no history: such metal was at .78."""
    wires = [placed(cylinder(0.014, 1.8, material), move(x, 1.3, 0.0)) for x in (-1.3, -0.85, -0.4, 0.05, 0.5, 0.95)]
    with pica.Renderer(furnace(*wires), size=SIZE, device=device) as renderer:
        pictures = [renderer.render(frames, camera=CAMERA) for frames in (24, 1, 1, 1, 1)]
    colors = np.array([picture.color for picture in pictures])
    is_wire = np.array([picture.aov("instance") > WALLS for picture in pictures])
    assert colors[is_wire].mean() > (1 - lost) * colors[~is_wire].mean()


@pytest.mark.parametrize("roughness", [0.1, 0.4])
def test_lacquered_metal_is_as_bright_as_the_walls(device, roughness):
    """Passes with and without coats disagreed whether its pixels have rays of their own: .25 of the light was left."""
    paint = white(metallic=1.0, roughness=roughness, coats=(Coat(),))
    with pica.Renderer(furnace(placed(sphere(0.6, paint, 48), move(0, 1.2, 0))), size=SIZE, device=device) as renderer:
        for picture in (renderer.render(1, camera=CAMERA), renderer.render(16, camera=CAMERA)):
            ball = picture.aov("instance") > WALLS
            assert picture.color[ball].mean() == pytest.approx(picture.color[~ball].mean(), rel=0.07)


def test_layers_are_lit_from_all_sides_soon_and_while_they_move(device):
    """Rays of other effects rarely meet them: their own hits refill the radiance cache."""
    veil = placed(plane(1.2, 1.2, white(base_color=(1.0, 1.0, 1.0, 0.5), alpha_mode=AlphaMode.BLEND)))
    with pica.Renderer(furnace(veil), size=SIZE, device=device) as renderer:
        veil.transform = move(-0.6, 1.2, -1) @ rotate("x", 80)
        assert renderer.render(6, camera=CAMERA).color[24:30, 33:40].mean() == pytest.approx(1, abs=0.08)
        for frame in range(6):
            veil.transform = move(-0.6 + 0.12 * frame, 1.2, -1) @ rotate("x", 80)
            picture = renderer.render(1, camera=CAMERA).color
    assert picture[24:30, 45:51].mean() == pytest.approx(1, abs=0.04)

"""Textures in pictures: over how much of them rays average."""

import numpy as np
import pytest

import pica
from pica.scene.camera import Camera
from pica.scene.environment import Environment
from pica.scene.light import DirectionalLight, RectangleLight, SpotLight
from pica.scene.material import Image, Material, Texture
from pica.scene.model import Node
from pica.scenes.basic_meshes import box, plane
from pica.scenes.placing import aim, move, rotate
from tests.building import bumps, converged, lambert, placed, scene_of, shining

SIZE = (96, 54)
FIELDS, WAVES = np.s_[15:39, 19:43], np.s_[15:38, 53:77]
"""Where the mirror shows the boards of `mirrored`."""


def fields(colors: np.ndarray, texels: int) -> Material:
    """Squares of (rows, columns, 3) colours, 0 to 1, so many texels wide."""
    pixels = np.full((*(texels * np.array(colors.shape[:2])), 4), 255, np.uint8)
    pixels[..., :3] = np.kron(255 * colors, np.ones((texels, texels, 1)))
    return lambert(1.0, base_color_texture=Texture(Image(pixels, "fields")))


def frame(device, scene, camera, frames: int, values=None) -> np.ndarray:
    """(height, width, 3) of the default settings."""
    settings = pica.Settings().with_values(values or {})
    with pica.Renderer(scene, size=SIZE, settings=settings, device=device) as renderer:
        return renderer.render(frames, camera=camera).color[..., :3]


def test_a_textured_wall_sends_the_colour_of_its_lit_part(device):
    """A spot lights the red part of a wall that is green besides: cones as wide as the diffuse lobe saw the mean."""
    colors = np.full((4, 4, 3), (0.05, 0.8, 0.05))
    colors[1:3, 1:3] = 0.8, 0.05, 0.05
    wall = placed(plane(4, 4, fields(colors, 16)), move(0, 2, -2) @ rotate("x", 90))
    spot = SpotLight(intensity=200.0, inner_cone_angle=0.1, outer_cone_angle=0.12)
    scene = scene_of(placed(plane(8, 8, lambert(0.6))), wall)
    scene.add(shining(spot)).transform = aim((0, 2, 4), (0, 2, -2))
    camera = Camera.look_at((0, 1.5, 3), (0, 0, 0), vertical_fov=np.radians(45))
    floor = np.s_[20:]
    found = frame(device, scene, camera, 16)[floor].mean((0, 1))
    expected = converged(device, scene, 256, camera, SIZE)[floor].mean((0, 1))
    assert expected[0] > 5 * expected[1]
    assert found[0] == pytest.approx(expected[0], rel=0.05)
    assert found[1] < 0.08 * found[0]


def mirrored() -> tuple[pica.Scene, Camera]:
    """A mirror, and behind the camera boards with fields and with waves of a normal map, in slanting light."""
    colors = np.random.default_rng(0).uniform(0, 1, (48, 48, 3))
    mirror = Material(base_color=(1, 1, 1, 1), metallic=1.0, roughness=0.0)
    wavy = lambert(0.8, normal_texture=bumps(256))
    upright = rotate("x", -90)
    scene = scene_of(
        placed(plane(6, 3, mirror), move(0, 1, -2) @ rotate("x", 90)),
        placed(plane(1.6, 1.6, fields(colors, 8)), move(-1, 1, 1.2) @ upright),
        placed(plane(1.6, 1.6, wavy), move(1, 1, 1.2) @ upright),
        shining(RectangleLight(radiance=30.0, width=0.5, height=0.5), aim((0, 3.4, 0), (0, 1, 1.2))),
    )
    return scene, Camera.look_at((0, 1, 0.4), (0, 1, -2), vertical_fov=np.radians(32))


def contrast(picture: np.ndarray) -> float:
    """The colours' standard deviation over their mean."""
    return float((picture.std((0, 1)) / picture.mean((0, 1))).mean())


def test_mirrors_show_textures_and_normal_maps(device):
    """They showed simplified materials: 32x32 texels at most, and no normal maps."""
    scene, camera = mirrored()
    found, expected = frame(device, scene, camera, 32), converged(device, scene, 256, camera, SIZE)
    simplified = frame(device, scene, camera, 32, {"reflections.simplified_materials": "true"})
    for board, least in ((FIELDS, 0.9), (WAVES, 0.8)):
        assert contrast(found[board]) > least * contrast(expected[board])
    assert contrast(simplified[WAVES]) < 0.75 * contrast(expected[WAVES])


def test_still_pictures_are_as_sharp_as_their_textures(device):
    """Jittered frames average over a pixel, so textures need not be averaged over one before, and the less the more
    frames there are."""
    colors = np.random.default_rng(0).uniform(0, 1, (64, 64, 3))
    board = placed(box((2, 2, 0.1), fields(colors, 4)))
    scene = scene_of(board, shining(RectangleLight(radiance=9.0, width=2, height=2), aim((0, 1, 4), (0, 0, 0))))
    camera = Camera.look_at((0.5, 0.7, 2.6), (0, 0, 0), vertical_fov=np.radians(30))
    found, expected = frame(device, scene, camera, 32), converged(device, scene, 256, camera, SIZE)
    inside = np.s_[10:44, 26:70]
    print("C", contrast(found[inside]) / contrast(expected[inside]))
    assert contrast(found[inside]) > 0.98 * contrast(expected[inside])


def test_first_frames_of_mirrors_have_no_dots(device):
    """While the cache is unknown, paths behind a mirror scatter, and a few found the lamp in it."""
    mirror = Material(base_color=(0.95, 0.95, 0.95, 1), metallic=1.0, roughness=0.0)
    scene = scene_of(
        placed(plane(6, 6, lambert(0.5))),
        placed(box((3, 2.4, 0.05), mirror), move(0, 1.2, -1)),
        shining(RectangleLight(radiance=20.0, width=1, height=1), move(0.5, 3, 0.5) @ rotate("x", -90)),
    )
    camera = Camera.look_at((0.9, 1.5, 1.4), (-0.3, 0.6, -1), vertical_fov=0.9)
    found = frame(device, scene, camera, 4).mean(-1)
    assert found.max() < 2 * np.percentile(found, 99)


def test_indirect_light_shows_normal_maps(device):
    """All light comes from a spot on a far wall: filters over neighbours with other normals left half of the waves."""
    wavy = lambert(0.7, normal_texture=bumps(64))
    scene = scene_of(
        placed(box((0.8, 0.5, 0.8), wavy), move(0, 0.25, 0)),
        placed(box((4, 3, 0.1), lambert(0.8)), move(0, 1.5, -2)),
        shining(SpotLight(intensity=200.0, outer_cone_angle=0.25), aim((0, 3, 3), (0, 2.2, -2))),
    )
    camera = Camera.look_at((0, 1.2, 1.0), (0, 0.45, 0), vertical_fov=np.radians(40))
    found, expected = frame(device, scene, camera, 16), converged(device, scene, 2048, camera, SIZE)
    with pica.Renderer(scene, size=SIZE, device=device) as renderer:
        top = renderer.render(1, camera=camera).aov("normal")[..., 1] > 0.6
    slope, _ = np.polyfit(expected[top].mean(-1), found[top].mean(-1), 1)
    assert slope == pytest.approx(1, abs=0.2)


def sky() -> Environment:
    """Bright above, dark below."""
    rows = np.linspace(0.8, 0.2, 8, dtype=np.float32)
    return Environment(np.broadcast_to(rows[:, None, None], (8, 16, 3)))


def board_of(material: Material, *others: Node) -> tuple[pica.Scene, Camera]:
    """A board that leans back, and a floor."""
    board = placed(box((1.6, 0.9, 0.03), material), move(0, 0.5, 0) @ rotate("x", -10))
    scene = scene_of(board, placed(plane(5, 5, lambert(0.5))), *others)
    scene.environment = sky()
    return scene, Camera.look_at((0.3, 0.9, 1.7), (0, 0.45, 0), vertical_fov=0.8)


BOARD = np.s_[12:38, 25:71]
"""Where it is in the picture."""


def spots(texels: int) -> np.ndarray:
    """(512, 512) 0 or 1, random squares so many texels wide."""
    ones = np.random.default_rng(3).random((512 // texels, 512 // texels)) > 0.5
    return np.kron(ones, np.ones((texels, texels)))


def spotted(metal, dielectric, texels: int) -> Material:
    """Spots of a metal of roughness 0.3 on a dielectric of 0.8, of these linear colours."""
    on = spots(texels)[..., None]
    surface = np.concatenate([np.zeros_like(on), 0.8 - 0.5 * on, on], -1)
    return Material(
        base_color_texture=Texture.from_array(np.where(on > 0, metal, dielectric), encoding="linear"),
        metallic_roughness_texture=Texture.from_array(surface, encoding="linear"),
        metallic=1.0,
        roughness=1.0,
    )


def test_rays_of_wide_lobes_do_not_widen_narrow_ones(device):
    """Metal among rough dielectrics took their rays, and had 4 % less light than a sky above sends along its lobe."""
    scene, camera = board_of(spotted((0.9, 0.7, 0.4), (0.15, 0.3, 0.25), 32))
    found, expected = frame(device, scene, camera, 32)[BOARD], converged(device, scene, 512, camera, SIZE)[BOARD]
    assert found.mean() == pytest.approx(expected.mean(), rel=0.025)


def test_mixed_texels_of_metal_and_dielectrics_keep_their_light(device):
    """Means of metalness made a bright dielectric of dark paint and bright metal that a pixel has both of, which sent
    1.3 times the light. In the first frame pixels have their mean alone, later ones most of the texels."""
    sun = shining(DirectionalLight(illuminance=4.0, angular_diameter=0.05), rotate("y", 30) @ rotate("x", -40))
    scene, camera = board_of(spotted((0.9, 0.7, 0.4), (0.15, 0.15, 0.15), 2), sun)
    expected = converged(device, scene, 512, camera, SIZE)[BOARD].mean()
    for frames, error in ((2, 0.15), (32, 0.08)):
        assert frame(device, scene, camera, frames)[BOARD].mean() == pytest.approx(expected, rel=error)


def test_distant_normal_maps_are_rough(device):
    """Bumps smaller than a pixel scatter light, where their mean normal mirrors the sky above alone."""
    slopes = np.random.default_rng(5).normal(0, 0.4, (2, 512, 512))
    normals = np.stack([*slopes, np.ones((512, 512))], -1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    bumpy = Texture.from_array((normals + 1) / 2, encoding="linear")
    metal = Material(base_color=(0.8, 0.8, 0.8, 1), metallic=1.0, roughness=0.2, normal_texture=bumpy)
    scene, camera = board_of(metal)
    found, expected = frame(device, scene, camera, 2)[BOARD], converged(device, scene, 512, camera, SIZE)[BOARD]
    assert found.mean() == pytest.approx(expected.mean(), rel=0.02)

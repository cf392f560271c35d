"""Thin films, anisotropy and sheen through the whole renderer: raster, rays and path tracer show the same."""

import numpy as np
import pytest

import pica
from pica.programs.scene_features import LOBES, supported_features
from pica.scene.anisotropy import Anisotropy
from pica.scene.coat import Coat
from pica.scene.environment import Environment
from pica.scene.iridescence import Iridescence
from pica.scene.light import DirectionalLight, RectangleLight
from pica.scene.material import Image, Material, Texture
from pica.scene.sheen import Sheen
from pica.scenes.basic_meshes import sphere
from pica.scenes.placing import aim, move, rotate
from tests.building import (
    EMBREE,
    RAYS,
    assert_schedulers_agree,
    bumps,
    converged,
    orthographic,
    placed,
    ramp,
    render,
    scene_of,
    settings,
    shining,
    shown,
    sky,
    trace,
    uniform,
    wall,
)

METAL = {"base_color": (0.8, 0.75, 0.7, 1.0), "metallic": 1.0, "roughness": 0.4}
PLASTIC = {"base_color": (0.05, 0.05, 0.06, 1.0), "metallic": 0.0, "roughness": 0.3}
FILM = Iridescence(ior=1.8, thickness_minimum=150.0, thickness_maximum=500.0)
BRUSHED = Anisotropy(0.7, 0.5)
CLOTH = {"base_color": (0.3, 0.05, 0.05, 1.0), "metallic": 0.0, "roughness": 0.9, "sheen": Sheen((0.9, 0.8, 0.7), 0.4)}
CAMERA = pica.Camera.look_at((0, 1.1, 3.0), (0, 0.4, 0))
FRONT = orthographic((0, 0, 2), (0, 0, 0), 2.0)
SIZE = (72, 40)


# Programs that know lobes know all else too: to compile them takes minutes. tests/shaders/test_lobes.py has the rest.
pytestmark = pytest.mark.slow


def whirl() -> Texture:
    """Directions that turn from left to right, and strengths from 1 to 0 downwards."""
    pixels = np.full((16, 16, 4), 255, np.uint8)
    angles = np.arange(16) / 16 * np.pi
    pixels[..., :2] = np.rint(np.stack([np.cos(angles), np.sin(angles)], -1) * 127.5 + 127.5)
    pixels[..., 2] = 255 - np.arange(16)[:, None] * 17
    return Texture(Image(pixels, "whirl"))


def things(light=None, environment=None):
    materials = (
        Material(**METAL, iridescence=FILM),
        Material(**PLASTIC, iridescence=FILM, coats=(Coat(roughness=0.2, strength=0.5, air_below=True),)),
        Material(**METAL, iridescence=FILM, iridescence_texture=ramp(), iridescence_thickness_texture=ramp()),
        Material(**METAL, anisotropy=BRUSHED, anisotropy_texture=whirl(), normal_texture=bumps()),
        Material(**CLOTH, sheen_roughness_texture=ramp(), coats=(Coat(strength=0.4, air_below=True),)),
    )
    return shown(
        materials,
        placed(sphere(0.25, materials[3]), move(0.3, 0.25, 0.6) @ rotate("x", 40)),
        placed(sphere(0.25, materials[4]), move(-0.4, 0.25, 0.6) @ rotate("x", 40)),
        light=light,
        environment=environment,
    )


def test_both_ways_of_tracing_see_the_same(device):
    assert_schedulers_agree(device, lambda: things(RectangleLight(radiance=8.0), sky()))


def test_payloads_carry_all(device):
    scene = things(RectangleLight(radiance=8.0))
    pipeline, buffers = (trace(device, scene, 4, CAMERA, SIZE, 2, values).color for values in (RAYS, EMBREE))
    np.testing.assert_allclose(pipeline, buffers, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize(
    ("light", "tolerance"),
    # Of lights with an area anisotropic surfaces show what isotropic ones of the same mean width do.
    [(DirectionalLight(illuminance=3.0), 0.06), (RectangleLight(radiance=9.0), 0.13)],
)
def test_direct_light_is_that_of_the_path_tracer(device, light, tolerance):
    hybrid = render(device, things(light), 24, CAMERA, SIZE).color
    traced = converged(device, things(light), 208, CAMERA, SIZE, max_depth=2)
    assert traced.max() > 0.5
    blurred = [picture.reshape(10, 4, 18, 4, 3).mean((1, 3)) for picture in (hybrid, traced)]
    np.testing.assert_allclose(blurred[0], blurred[1], rtol=0.1, atol=tolerance)
    assert hybrid.mean() == pytest.approx(traced.mean(), rel=0.02)


@pytest.mark.parametrize("way", ["prefiltered", "sampled"])
def test_light_from_all_around_is_that_of_the_path_tracer(device, way):
    values = {"lighting.environment": "prefiltered"} if way == "prefiltered" else {}
    looks = ({**METAL, "iridescence": FILM}, {**PLASTIC, "iridescence": FILM}, {**METAL, "anisotropy": BRUSHED}, CLOTH)
    balls = [placed(sphere(0.35, Material(**look)), move(0.75 * (n - 1.5), 0, 0)) for n, look in enumerate(looks)]
    scene, camera = scene_of(*balls, environment=uniform(1, 1, 1)), orthographic((0, 0, 3), (0, 0, 0), 5 / 3)
    hybrid = render(device, scene, 48, camera, SIZE, values).color
    traced = converged(device, scene, 112, camera, SIZE, max_depth=2)
    for middle in (9, 27, 45, 63):  # balls of 15 pixels across
        seen, expected = (picture[14:26, middle - 5 : middle + 6].mean((0, 1)) for picture in (hybrid, traced))
        np.testing.assert_allclose(seen, expected, rtol=0.1 if way == "prefiltered" else 0.03, atol=0.005)


@pytest.mark.parametrize("strength", [0.5, 0.8])
def test_prefiltered_light_is_drawn_out_and_not_more(device, strength):
    """A window in the sky makes a streak on brushed metal that is as much brighter as it is longer."""
    radiance = np.full((32, 64, 3), 0.3, np.float32)
    radiance[10:14, 38:52] = 8.0
    brushed = Material(**METAL | {"roughness": 0.3}, anisotropy=Anisotropy(strength))
    scene = scene_of(placed(sphere(0.8, brushed)), environment=Environment(radiance))
    camera = orthographic((0, 0, 3), (0, 0, 0), 2.0)
    prefiltered = render(device, scene, 4, camera, (40, 40), {"lighting.environment": "prefiltered"}).color
    traced = converged(device, scene, 208, camera, (40, 40), max_depth=2)
    inside = np.hypot(*np.mgrid[-19.5:20, -19.5:20]) < 13
    assert prefiltered[inside].mean() == pytest.approx(traced[inside].mean(), rel=0.05)
    assert prefiltered[inside].max() == pytest.approx(traced[inside].max(), rel=0.25)


def test_what_travels_is_enough(device):
    """Strength and thickness by their textures, in stripes of the wall, and as one material has them everywhere."""
    lamp = shining(DirectionalLight(illuminance=4.0), aim((0, 0, 3), (0, 0, 0)))

    def seen(film=FILM, **values):
        scene = scene_of(wall(**METAL, iridescence=film, **values), lamp)
        return render(device, scene, 1, FRONT, (16, 16)).color[:, 8]

    bare, full, thin = seen(None), seen(), seen(Iridescence(ior=1.8, thickness_maximum=150.0))
    assert np.abs(full - bare).max() > 0.1 * bare.max() < 10 * np.abs(full - thin).max()
    by_strength, by_thickness = seen(iridescence_texture=ramp()), seen(iridescence_thickness_texture=ramp())
    shares = np.linspace(0, 1, 16)[:, None]
    np.testing.assert_allclose(by_strength, bare + (full - bare) * shares, atol=0.02 * bare.max())
    np.testing.assert_allclose(by_thickness[[0, 15]], [thin[0], full[15]], rtol=0.01)


def test_a_sheen_is_as_its_textures_say(device):
    """On a black wall that is seen and lit from one side: colour as sRGB, roughness by alpha."""
    lamp = shining(DirectionalLight(illuminance=4.0), aim((0.3, -3, 0.8), (0, 0, 0)))
    camera = pica.Camera.look_at((0, -0.7, 0.2), (0, 0, 0), vertical_fov=np.radians(50))

    def seen(sheen, **values):
        node = wall(base_color=(0.0, 0.0, 0.0, 1.0), metallic=0.0, specular=0.0, sheen=sheen, **values)
        return render(device, scene_of(node, lamp), 1, camera, (16, 16)).color[8, 8]

    def flat(*rgba):
        return Texture(Image(np.full((2, 2, 4), rgba, np.uint8)))

    narrow, wide = seen(Sheen(roughness=0.4)), seen(Sheen(roughness=0.8))
    assert narrow.min() > 0.05 and (np.abs(narrow - wide) > 0.1 * narrow).all()
    colored = seen(Sheen(roughness=0.4), sheen_color_texture=flat(188, 0, 255, 255))
    np.testing.assert_allclose(colored, narrow * [0.503, 0, 1], rtol=0.02, atol=1e-4)
    by_texture = seen(Sheen(roughness=0.8), sheen_roughness_texture=flat(9, 9, 9, 128))
    np.testing.assert_allclose(by_texture, narrow, rtol=0.02)


def test_highlights_are_drawn_out_along_the_tangent(device):
    """Which is the wall's X; a quarter of a turn makes that its Y, as does a texture; mirrored walls mirror it."""
    lamp = shining(DirectionalLight(illuminance=4.0), aim((0, 0, 3), (0, 0, 0)))
    camera = pica.Camera.look_at((0, 0, 0.7), (0, 0, 0), vertical_fov=np.radians(110))

    def seen(anisotropy, transform=None, **values):
        node = wall(**METAL, anisotropy=anisotropy, **values)
        node.transform = node.transform if transform is None else transform @ node.transform
        return render(device, scene_of(node, lamp), 1, camera, (33, 33)).color[..., 1]

    along, across, slanting = (seen(Anisotropy(0.8, turned)) for turned in (0.0, np.pi / 2, np.pi / 4))
    middle, edge = 16, 26
    assert along[middle, edge] > 3 * along[edge, middle]
    np.testing.assert_allclose(across, along.T, rtol=0.02, atol=0.005)
    assert slanting[10, 22] > 2 * slanting[22, 22], "counter-clockwise: up and to the right"
    mirrored = seen(Anisotropy(0.8, np.pi / 4), np.diag([-1.0, 1, 1, 1]))
    np.testing.assert_allclose(mirrored, slanting[:, ::-1], rtol=0.02, atol=0.005)
    pixels = np.full((2, 2, 4), (128, 255, 255, 255), np.uint8)  # direction 0, 1
    by_texture = seen(Anisotropy(0.8), anisotropy_texture=Texture(Image(pixels)))
    np.testing.assert_allclose(by_texture, across, rtol=0.02, atol=0.005)


def test_scenes_without_have_no_room_for_them(device):
    rooms = []
    for film in (None, FILM):
        renderer = pica.Renderer(
            scene_of(wall(**METAL, iridescence=film)), size=(16, 16), settings=settings(), device=device
        )
        renderer.render(1, camera=FRONT)
        known = LOBES in supported_features(renderer.view.material_types)
        rooms.append((known, renderer.advance(FRONT)["lobes"].width == 16))
    assert rooms[1] == (True, True) and rooms[0][0] == rooms[0][1]

"""Thin films through the whole renderer: what travels, and that raster, rays and path tracer show the same."""

import numpy as np
import pytest

import pica
from pica.programs.scene_features import LOBES, known_features
from pica.scene.coat import Coat
from pica.scene.iridescence import Iridescence
from pica.scene.light import DirectionalLight, RectangleLight
from pica.scene.material import Image, Material, Texture
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import aim, move, turn
from tests.building import (
    EMBREE,
    RAYS,
    assert_schedulers_agree,
    lambert,
    orthographic,
    placed,
    render,
    scene_of,
    settings,
    shining,
    sky,
    trace,
    uniform,
)

METAL = {"base_color": (0.8, 0.75, 0.7, 1.0), "metallic": 1.0, "roughness": 0.4}
PLASTIC = {"base_color": (0.05, 0.05, 0.06, 1.0), "metallic": 0.0, "roughness": 0.3}
FILM = Iridescence(ior=1.8, thickness_minimum=150.0, thickness_maximum=500.0)
CAMERA = pica.Camera.look_at((0, 1.1, 3.0), (0, 0.4, 0))
FRONT = orthographic((0, 0, 2), (0, 0, 0), 2.0)
SIZE = (72, 40)


def ramp() -> Texture:
    pixels = np.full((16, 16, 4), 255, np.uint8)
    pixels[..., :3] = (np.arange(16) * 17)[:, None, None]
    return Texture(Image(pixels, "ramp"))


def things(light=None, environment=None):
    materials = (
        Material(**METAL, iridescence=FILM),
        Material(**PLASTIC, iridescence=FILM, coats=(Coat(roughness=0.2, strength=0.5, air_below=True),)),
        Material(**METAL, iridescence=FILM, iridescence_texture=ramp(), iridescence_thickness_texture=ramp()),
    )
    nodes = [
        placed(sphere(0.35, materials[0]), move(-0.8, 0.35, 0)),
        placed(sphere(0.35, materials[1]), move(0, 0.35, 0)),
        placed(box(0.6, materials[2]), move(0.8, 0.3, 0) @ turn("y", 30)),
        placed(plane(5, 5, lambert(0.5))),
    ]
    if light is not None:
        nodes.append(shining(light, aim((0.5, 2.2, 1.6), (0, 0.3, 0))))
    return scene_of(*nodes, environment=environment)


def wall(**values):
    return placed(plane(2, 2, Material(**values)), turn("x", 90))


@pytest.mark.slow
def test_both_ways_of_tracing_see_the_same(device):
    assert_schedulers_agree(device, lambda: things(RectangleLight(radiance=8.0), sky()))


def test_payloads_carry_all(device):
    scene = things(RectangleLight(radiance=8.0))
    pipeline, buffers = (trace(device, scene, 4, CAMERA, SIZE, 2, values).color for values in (RAYS, EMBREE))
    np.testing.assert_allclose(pipeline, buffers, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize(
    "light", [DirectionalLight(illuminance=3.0, angular_diameter=0.1), RectangleLight(radiance=9.0)]
)
def test_direct_light_is_that_of_the_path_tracer(device, light):
    hybrid = render(device, things(light), 24, CAMERA, SIZE).color
    traced = trace(device, things(light), 200, CAMERA, SIZE, max_depth=2).color
    assert traced.max() > 0.5
    blurred = [picture.reshape(10, 4, 18, 4, 3).mean((1, 3)) for picture in (hybrid, traced)]
    np.testing.assert_allclose(blurred[0], blurred[1], rtol=0.1, atol=0.06)
    assert hybrid.mean() == pytest.approx(traced.mean(), rel=0.02)


@pytest.mark.parametrize("way", ["prefiltered", "sampled"])
def test_light_from_all_around_is_that_of_the_path_tracer(device, way):
    values = {"lighting.environment": "prefiltered"} if way == "prefiltered" else {}
    looks = ({**METAL, "iridescence": FILM}, {**PLASTIC, "iridescence": FILM})
    balls = [placed(sphere(0.35, Material(**look)), move(n - 1, 0, 0)) for n, look in enumerate(looks)]
    scene, camera = scene_of(*balls, environment=uniform(1, 1, 1)), orthographic((0, 0, 3), (0, 0, 0), 5 / 3)
    hybrid = render(device, scene, 48, camera, SIZE, values).color
    traced = trace(device, scene, 100, camera, SIZE, max_depth=2).color
    for middle in (15, 36)[: len(balls)]:  # balls of 15 pixels across
        seen, expected = (picture[14:26, middle - 5 : middle + 6].mean((0, 1)) for picture in (hybrid, traced))
        np.testing.assert_allclose(seen, expected, rtol=0.1 if way == "prefiltered" else 0.03, atol=0.005)


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


def test_scenes_without_have_no_room_for_them(device):
    rooms = []
    for film in (None, FILM):
        renderer = pica.Renderer(scene_of(wall(**METAL, iridescence=film)), (16, 16), settings(), device)
        renderer.render(1, FRONT)
        known = LOBES in known_features(renderer.view.material_types)
        (gbuffer,) = (effect for effect in renderer.effects if effect.name == "gbuffer")
        rooms.append((known, gbuffer._buffer.has_room_for("lobes")))
    assert rooms[1] == (True, True) and rooms[0][0] == rooms[0][1]

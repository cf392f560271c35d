"""Light that passes surfaces diffusely: hybrid pictures against the path tracer, closed forms, and changes."""

import math
from copy import deepcopy

import numpy as np
import pytest

import pica
from pica.scene.camera import Camera
from pica.scene.light import DirectionalLight, PointLight
from pica.scene.material import Image, Material, Texture
from pica.scene.model import Scene
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import move, rotate
from tests.building import converged, lambert, placed, render, scene_of, settings, shining, sky, trace, uniform

BOTH = pytest.mark.parametrize("tracer", [render, trace], ids=["hybrid", "path tracer"])
FRONT = Camera.look_at((0, 0, 3), (0, 0, 0), vertical_fov=math.radians(24))
OBLIQUE = Camera.look_at((0.5, 0.3, 1.2), (0, 0, 0), vertical_fov=math.radians(24))
SIZE = (48, 32)


def wax(**more) -> Material:
    """Three mean free paths to 30 centimetres."""
    values = {"metallic": 0.0, "roughness": 0.5, "diffuse_transmission": 1.0, "thin_walled": False}
    return Material(**{**values, "scattering": (10.0, 10.0, 10.0), **more})


def paper(**more) -> Material:
    return wax(**{"thin_walled": True, "scattering": (0.0, 0.0, 0.0), "double_sided": True, **more})


def each_path(mode: str = "texture_space") -> pica.Settings:
    """As on a graphics card: a path a texel and frame."""
    return pica.Settings().with_values({"translucency.mode": mode, "translucency.interval": "1"})


@BOTH
@pytest.mark.parametrize(
    "made",
    [
        lambda: sphere(0.5, wax(), 32),
        lambda: sphere(0.5, wax(diffuse_transmission=0.5, scatter_anisotropy=0.6), 32),
        lambda: plane(1, 1, paper(diffuse_transmission=0.7)),
    ],
    ids=["wax", "half", "paper"],
)
def test_what_absorbs_nothing_disappears_in_even_light(device, tracer, made):
    scene = scene_of(placed(made(), rotate("x", 90)), environment=uniform(1, 1, 1))
    picture = tracer(device, scene, 48, FRONT, (24, 24)).color
    assert picture[8:16, 8:16].mean() == pytest.approx(1, rel=0.01)


def lit_from(place, thing, **more) -> tuple[Scene, pica.Node]:
    lamp = shining(PointLight(intensity=30.0), move(*place))
    return scene_of(placed(thing), lamp, environment=uniform(0.3, 0.4, 0.5)), lamp


@pytest.mark.parametrize("mode", ["texture_space", "screen_space"])
@pytest.mark.parametrize("made", [sphere, box], ids=["sphere", "slab"])
def test_three_mean_free_paths_are_as_bright_as_a_random_walk_has_them(device, made, mode):
    material = wax(absorption=(0.2, 1.0, 3.0))
    scene, _ = lit_from((-0.4, 0.4, -0.9), sphere(0.15, material, 32) if made is sphere else box(0.3, material))
    expected = converged(device, scene, 256, OBLIQUE, (96, 64))
    with pica.Renderer(scene, size=(96, 64), settings=each_path(mode), device=device) as renderer:
        found = renderer.render(48, camera=OBLIQUE)
    seen = found.aov("subsurface").sum(-1) > 0
    assert seen.mean() > 0.1
    np.testing.assert_allclose(found.color[seen].mean(0), expected[seen].mean(0), rtol=0.07)


def test_light_that_moves_behind_is_followed_and_then_rests(device):
    """Nine tenths of the change in 20 frames; half a percent of flicker at rest."""
    scene, lamp = lit_from((0.4, 0.6, 0.9), sphere(0.15, wax(), 32))
    with pica.Renderer(scene, size=SIZE, settings=each_path(), device=device) as renderer:
        before = renderer.render(96, camera=OBLIQUE)
        seen = before.aov("subsurface").sum(-1) > 0
        following = renderer.render(1, camera=OBLIQUE).color
        assert np.abs(following - before.color)[seen].mean() < 0.005 * following[seen].mean()
        lamp.transform = move(-0.4, 0.4, -0.9)
        after = renderer.render(20, camera=OBLIQUE).color[seen].mean()
    with pica.PathTracer(scene, size=SIZE, device=device) as tracer:
        expected = tracer.render(128, camera=OBLIQUE).color[seen].mean()
    assert abs(after - expected) < 0.1 * abs(before.color[seen].mean() - expected)


def test_walks_that_wait_for_the_next_frame_move_along_with_their_object(device):
    """Those left behind would begin outside of it, and bring no light."""
    ball = placed(sphere(0.3, wax(scattering=(30.0, 30.0, 30.0)), 32))
    with pica.Renderer(
        scene_of(ball, environment=uniform(1, 1, 1)), size=SIZE, settings=each_path(), device=device
    ) as renderer:
        renderer.render(40, camera=FRONT)
        for frame in range(24):
            ball.transform = move(0.02 * (frame - 12), 0, 0) @ rotate("y", 5 * frame)
            picture = renderer.render(1, camera=FRONT).color
    middle = picture[12:20, 30:38]
    assert middle.mean() == pytest.approx(1, rel=0.01)


def test_a_sheet_is_lit_from_behind(device):
    """By a lamp there, in the colour of what passes; its front reflects the environment."""
    sheet = plane(1, 1, paper(base_color=(0.8, 0.1, 0.1, 1.0), diffuse_transmission=0.6,
                              diffuse_transmission_color=(0.1, 0.8, 0.1), specular=0.0))  # fmt: skip
    lamp = shining(PointLight(intensity=45.0), move(0, 0, -3))
    scene = scene_of(placed(sheet, rotate("x", 90)), lamp)
    with pica.Renderer(scene, size=(24, 24), device=device) as renderer:
        found = renderer.render(32, camera=FRONT)
    middle = found.color[11:13, 11:13].mean((0, 1))
    np.testing.assert_allclose(middle, 5 / math.pi * 0.6 * np.array([0.1, 0.8, 0.1]), rtol=0.03)
    np.testing.assert_allclose(found.aov("subsurface")[11:13, 11:13].mean((0, 1)), middle, rtol=0.03)


def still_life() -> Scene:
    """Wax, and paper in front of it."""
    leaf = paper(base_color=(0.2, 0.6, 0.1, 1.0), diffuse_transmission=0.7, diffuse_transmission_color=(0.6, 0.9, 0.2))
    return scene_of(
        placed(plane(3, 3, lambert(0.3, 0.5, 0.7))),
        placed(sphere(0.28, wax(absorption=(0.1, 1.0, 3.0)), 32), move(-0.5, 0.3, 0)),
        placed(box(0.35, wax(diffuse_transmission_color=(0.9, 0.8, 0.7))), move(0.5, 0.19, 0.2) @ rotate("y", 25)),
        placed(plane(0.4, 0.5, leaf), move(0.05, 0.5, 0.3) @ rotate("x", 70)),
        environment=sky(3),
    )


VIEW = Camera.look_at((0.4, 0.9, 2.2), (0, 0.3, 0), vertical_fov=math.radians(35))


def test_light_passes_both_walls_of_a_thin_box(device):
    """A sun behind it. The inside of one wall and the outside of the other face the same way in one cell of the
    radiance cache, and rays from the floor meet the outside."""
    sun = shining(DirectionalLight(illuminance=4.0), rotate("y", 170) @ rotate("x", -30))
    board = placed(box((1, 1, 0.02), paper(diffuse_transmission=0.5)), move(0, 0.6, 0))
    scene = scene_of(placed(plane(10, 10, lambert(0.5))), board, sun)
    view = Camera.look_at((0, 0.8, 3), (0, 0.6, 0), vertical_fov=math.radians(28))
    cached = {"global_illumination.mode": "path_traced"}
    found, expected = (
        tracer(device, scene, count, view, (96, 54), values=cached).color[18:38, 34:62].mean()
        for tracer, count in ((render, 40), (trace, 128))
    )
    assert found == pytest.approx(expected, rel=0.06)


def test_the_picture_is_near_the_path_tracers(device):
    scene, size = still_life(), (96, 64)
    with pica.PathTracer(scene, size=size, device=device) as tracer:
        expected = tracer.render(384, camera=VIEW).color
    with pica.Renderer(scene, size=size, settings=each_path(), device=device) as renderer:
        found = renderer.render(64, camera=VIEW)
    blocks = [picture.reshape(8, 8, 12, 8, 3).mean((1, 3)) for picture in (found.color, expected)]
    assert np.abs(blocks[0] - blocks[1]).mean() < 0.05 * blocks[1].mean()
    assert found.color.mean() == pytest.approx(expected.mean(), rel=0.03)


def test_without_it_surfaces_reflect_what_they_would_let_through(device):
    """Off: no black holes, but the colour of the solid, lit from the front."""
    scene = still_life()
    with pica.Renderer(scene, size=SIZE, settings=each_path(), device=device) as renderer:
        on = renderer.render(24, camera=VIEW)
    with pica.Renderer(scene, size=SIZE, settings=each_path("off"), device=device) as renderer:
        off = renderer.render(24, camera=VIEW)
    seen = on.aov("subsurface").sum(-1) > 0
    assert "subsurface" not in off.aov_names
    assert 0.7 < off.color[seen].mean() / on.color[seen].mean() < 1.4


def texture(seed: int) -> Texture:
    pixels = np.random.default_rng(seed).integers(60, 250, (8, 8, 4)).astype(np.uint8)
    return Texture(Image(pixels, f"noise {seed}"))


EDITS = {
    "diffuse_transmission": 0.4,
    "diffuse_transmission_texture": texture(1),
    "diffuse_transmission_color": (0.2, 0.9, 0.4),
    "diffuse_transmission_color_texture": texture(2),
    "scattering": (80.0, 40.0, 20.0),
    "scatter_anisotropy": 0.8,
    "thin_walled": True,
    "absorption": (9.0, 1.0, 9.0),
}


def test_what_is_written_is_in_the_next_frames(device):
    """Each field in turn, in one renderer, against a new one: the same light but for noise."""
    material = wax()
    scene = scene_of(placed(sphere(0.28, material, 24)), environment=sky(3))
    small = each_path().with_values({"translucency.map_size": "64"})
    with pica.Renderer(scene, size=(24, 16), settings=small, device=device) as renderer:
        before = renderer.render(24, camera=OBLIQUE).color.mean((0, 1))
        for field, value in EDITS.items():
            original = getattr(material, field)
            setattr(material, field, value)
            after = renderer.render(24, camera=OBLIQUE).color.mean((0, 1))
            with pica.Renderer(deepcopy(scene), size=(24, 16), settings=small, device=device) as fresh:
                expected = fresh.render(24, camera=OBLIQUE).color.mean((0, 1))
            np.testing.assert_allclose(after, expected, rtol=0.03, err_msg=field)
            setattr(material, field, original)
        np.testing.assert_allclose(renderer.render(24, camera=OBLIQUE).color.mean((0, 1)), before, rtol=0.03)


def test_objects_come_and_go_and_materials_turn_translucent(device):
    plain = lambert(0.6, 0.5, 0.4)
    scene = scene_of(placed(sphere(0.2, plain, 24)), environment=sky(3))
    with pica.Renderer(scene, size=(24, 16), settings=each_path(), device=device) as renderer:
        assert not renderer.render(2, camera=OBLIQUE).aov("subsurface").any()
        plain.diffuse_transmission, plain.thin_walled, plain.scattering = 1.0, False, (10.0, 10.0, 10.0)
        assert renderer.render(8, camera=OBLIQUE).aov("subsurface").any()
        other = scene.add(placed(box(0.2, wax()), move(0.35, 0, 0)))
        both = np.count_nonzero(renderer.render(4, camera=OBLIQUE).aov("subsurface"))
        scene.remove(other)
        assert 0 < np.count_nonzero(renderer.render(4, camera=OBLIQUE).aov("subsurface")) < both


def test_the_number_of_rays_is_bounded_by_the_texels(device):
    values = {"translucency.map_size": "64", "translucency.interval": "1", "translucency.scatterings": "4"}
    scene = scene_of(placed(sphere(0.28, wax(), 24)), environment=uniform(1, 1, 1))
    with pica.Renderer(scene, size=(24, 16), settings=settings(values), device=device) as renderer:
        renderer.render(4, camera=OBLIQUE)
        rays = renderer.count_rays(OBLIQUE)["map_rays"]
    assert 64 * 64 / 4 < rays <= 64 * 64


def test_primitives_reflect_what_they_would_let_through(device):
    """Only triangles have maps and paths: no black spheres."""
    ball = pica.Node("ball", mesh=pica.Mesh(primitives=[pica.spheres([[0, 0, 0]], 0.3, wax())]))
    scene = scene_of(ball, placed(sphere(0.1, wax(), 12), move(2, 0, 0)), environment=uniform(1, 1, 1))
    with pica.Renderer(scene, size=(24, 16), settings=each_path(), device=device) as renderer:
        found = renderer.render(8, camera=OBLIQUE)
    assert found.color[6:10, 10:14].mean() == pytest.approx(1, rel=0.05)
    assert not found.aov("subsurface")[6:10, 10:14].any()


def test_light_stays_where_its_object_does(device):
    """Whatever else comes: an opaque box, and a smaller solid for which there is room."""
    small = [placed(box(0.02, wax()), move(0.5 * i, 0, -3)) for i in range(2)]
    scene = scene_of(placed(sphere(0.2, wax(), 24)), small[0], environment=sky(3))

    def middle(frames):
        return renderer.render(frames, camera=OBLIQUE).aov("subsurface")[6:10, 10:14]

    with pica.Renderer(scene, size=(24, 16), settings=each_path(), device=device) as renderer:
        before = middle(48)
        for other in (placed(box(0.1, lambert(0.5)), move(0, 0, -3)), small[1]):
            scene.add(other)
            after = middle(1)
            assert np.abs(after - before).mean() < 0.03 * before.mean()
            before = after
        renderer.reset()
        assert np.abs(middle(1) - before).mean() > 0.06 * before.mean()


def test_after_a_reset_nothing_is_left_of_pictures_before(device):
    """Paths of texels that are not in the picture go on for some frames, and texels take turns."""
    scene = scene_of(placed(sphere(0.5, wax(), 32)), shining(PointLight(intensity=30.0), move(1, 2, 1)))
    with pica.Renderer(scene, size=SIZE, device=device) as renderer:
        first = renderer.render(2, camera=FRONT, cut=True)
        renderer.render(1, camera=OBLIQUE)
        again = renderer.render(2, camera=FRONT, cut=True)
    assert first.aov("subsurface").any()
    assert np.array_equal(first.aov("subsurface"), again.aov("subsurface"))


def test_maps_read_no_memory_that_nothing_has_written(device, monkeypatch):
    """A map of a size between two powers of two leaves texels without an object beside those with one."""
    make, content = type(device).texture, [0.0]

    def filled(device, label, *arguments, **more):
        texture = make(device, label, *arguments, **more)
        if "drift" in label:
            encoder = device.handle.create_command_encoder()
            encoder.clear_texture_float(texture, clear_value=content * 4)
            device.handle.submit_command_buffer(encoder.finish())
        return texture

    monkeypatch.setattr(type(device), "texture", filled)
    scene = scene_of(placed(sphere(0.28, wax(), 24)), placed(box(0.2, wax()), move(0.35, 0, 0)), environment=sky(3))
    light = []
    for content[0] in (0.0, 50.0):
        with pica.Renderer(scene, size=(24, 16), settings=each_path(), device=device) as renderer:
            light.append(renderer.render(40, camera=OBLIQUE).aov("subsurface"))
    np.testing.assert_allclose(*light, rtol=1e-3, atol=1e-4)  # threads add in any order

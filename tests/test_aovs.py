"""What the AOVs hold: places and texture coordinates, and what the table says of each."""

from pathlib import Path

import numpy as np
import pytest

import pica
from pica.errors import PicaError
from pica.images.aov_table import AOVS
from pica.scene.camera import Camera
from pica.scene.light import DirectionalLight
from pica.scene.primitives import spheres
from pica.scenes.basic_meshes import plane
from pica.scenes.placing import aim, move, rotate, stretch
from tests.building import SIZE, lambert, orthographic, placed, projected, scene_of, settings, shining, uniform
from tests.primitive_scenes import primitives_node

pytestmark = pytest.mark.device

CAMERAS = {
    "perspective": Camera.look_at((0.6, 1.2, 3.0), (0.1, 0.6, 0)),
    "orthographic": orthographic((0.6, 1.2, 3.0), (0.1, 0.8, 0), 3.0),
}
ALL = {
    "reflections.mode": "ray_traced",
    "global_illumination.mode": "path_traced",
    "ambient_occlusion.mode": "ray_traced",
}
PLACED = move(0.3, 0.5, -0.2) @ rotate("y", 40) @ stretch(0.5, 0.5, 0.5)


def scene():
    """A floor of four metres, a ball that is no triangles, a sun and a sky."""
    ball = primitives_node([spheres([(0, 0, 0)], 1.0, lambert())], PLACED, "ball")
    sun = shining(DirectionalLight(illuminance=2.0, angular_diameter=0.1), aim((1, 2, 1.5), (0, 0, 0)))
    floor = plane(4, 4, lambert(0.6), cells=3)
    floor.uv1 = 1 - floor.uv0
    return scene_of(placed(floor, name="floor"), ball, sun, environment=uniform(0.5))


@pytest.fixture(scope="module")
def renderer(device):
    return pica.Renderer(scene(), size=SIZE, settings=settings(ALL), device=device)


@pytest.fixture
def fresh(renderer):
    renderer.reset()
    return renderer


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
def test_positions_are_where_samples_meet_surfaces(fresh, camera):
    """In frames whose samples lie off the pixels' centres too."""
    for index in range(3):
        frame = fresh.render(frames=1, camera=camera, aovs=["position", "depth", "instance"])
        places, floor, ball = frame.aov("position"), frame.mask("floor"), frame.mask("ball")
        assert places.dtype == np.float32 and min(floor.mean(), ball.mean()) > 0.05
        np.testing.assert_array_equal(np.isnan(places).all(-1), frame.aov("instance") == 0)
        np.testing.assert_allclose(places[floor][:, 1], 0, atol=2e-4)
        assert np.abs(places[floor][:, [0, 2]]).max() < 2 + 1e-4
        np.testing.assert_allclose(np.linalg.norm(places[ball] - PLACED[:3, 3], axis=1), 0.5, atol=2e-5)
        seen = projected(camera, places[floor | ball], SIZE)
        rows, columns = np.nonzero(floor | ball)
        off = seen - np.stack([columns + 0.5, rows + 0.5], -1)
        assert np.ptp(off, axis=0).max() < 2e-3, "each pixel's sample lies alike"
        assert (np.abs(off).max() < 2e-3) == (index == 0), "and in frame 0 in the middle"
        along = (places - camera.transform[:3, 3]) @ -camera.transform[:3, 2]
        np.testing.assert_allclose(along[floor | ball], frame.aov("depth")[floor | ball], rtol=1e-5)


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
def test_texture_coordinates_are_those_of_the_place(fresh, camera):
    for _ in range(2):
        frame = fresh.render(frames=1, camera=camera, aovs=["position", "uv", "instance"])
        uv, places = frame.aov("uv"), frame.aov("position")
        assert uv.shape == (*SIZE[::-1], 2) and uv.dtype == np.float32
        floor, ball = frame.mask("floor"), frame.mask("ball")
        np.testing.assert_allclose(uv[floor], places[floor][:, [0, 2]] / 4 + 0.5, atol=2e-5)
        upright = (places[ball] - PLACED[:3, 3])[:, 1] / 0.5
        np.testing.assert_allclose(uv[ball][:, 1], np.arccos(np.clip(upright, -1, 1)) / np.pi, atol=1e-3)
        assert np.ptp(uv[ball][:, 0]) > 0.3
        np.testing.assert_array_equal(np.isnan(uv).all(-1), frame.aov("instance") == 0)


def test_texture_coordinates_are_made_for_who_asks(fresh):
    frame = fresh.render(frames=1)
    assert "uv" not in frame.aov_names and "position" in frame.aov_names
    with pytest.raises(PicaError, match=r"no AOV 'uv' in this frame; .*; render\(aovs=\['uv'\]\) makes it$"):
        frame.aov("uv")
    assert fresh.render(frames=1, aovs=["uv"]).aov_names == ("uv",)
    assert fresh.render(frames=1, aovs=[]).aov_names == ()


@pytest.mark.parametrize(
    ("names", "says"),
    [
        (["depths"], "no AOV 'depths'; there are depth, position"),
        ("depth", "aovs: 'depth': must be names, such as"),
        (7, "aovs: 7: must be names, such as"),
        ([["depth"]], r"aovs: \[\['depth'\]\]: must be names, such as"),
    ],
)
def test_wrong_names_are_one_line(fresh, names, says):
    with pytest.raises(PicaError, match=says):
        fresh.render(frames=1, aovs=names)


def test_without_numbers_there_are_no_names(fresh):
    frame = fresh.render(frames=1, aovs=["depth"])
    with pytest.raises(PicaError, match="this frame names nothing"):
        _ = frame.ids


def test_upscaled_places_are_those_of_samples(device):
    values = {"antialiasing.mode": "temporal", "antialiasing.upscale": 1.5}
    frame = pica.Renderer(scene(), size=SIZE, settings=settings(values), device=device).render(frames=2)
    places, floor = frame.aov("position"), frame.mask("floor")
    assert places.shape[:2] == SIZE[::-1] and floor.any()
    np.testing.assert_allclose(places[floor][:, 1], 0, atol=2e-4)


def test_the_path_tracer_s_are_of_pixel_centres(device, fresh):
    tracer = pica.PathTracer(scene(), size=SIZE, settings=settings(), device=device)
    names, camera = ["position", "uv", "instance"], CAMERAS["perspective"]
    traced, frame = (
        tracer.render(samples=2, camera=camera, aovs=names),
        fresh.render(frames=2, camera=camera, aovs=names),
    )
    assert traced.aov_names == frame.aov_names
    for name in names:
        np.testing.assert_array_equal(traced.aov(name), frame.aov(name), name)


def test_the_table_tells_shapes_backgrounds_and_frames(fresh):
    camera, named = CAMERAS["perspective"], [name for name in AOVS if name != "alpha"]  # the background is opaque
    whole = fresh.render(frames=3, camera=camera, aovs=named)
    fresh.reset()
    singles = [fresh.render(frames=1, camera=camera, aovs=named) for _ in range(3)]
    assert set(whole.aov_names) == set(named)
    nothing = whole.aov("instance") == whole.BACKGROUND
    assert 0.1 < nothing.mean() < 0.9
    for name in named:
        info = whole.aov_info(name)
        assert info is AOVS[name]
        array = whole.aov(name)
        if info.channels is not None:
            assert array.shape[2:] == (() if info.channels == 1 else (info.channels,)), name
        if info.background is not None:
            seen = {"first": whole, "last": singles[-1]}[info.frame].aov(name)
            empty = nothing if info.frame == "first" else singles[-1].aov("instance") == 0
            np.testing.assert_array_equal(seen[empty], info.background, name)
        single = singles[0] if info.frame == "first" else singles[-1]
        np.testing.assert_array_equal(array, single.aov(name), name)
    assert not np.array_equal(singles[0].aov("depth"), singles[-1].aov("depth")), "frames differ in their samples"


def test_what_the_table_lacks_is_of_the_last_frame(fresh):
    fresh.debug = True
    try:
        frame = fresh.render(frames=1)
    finally:
        fresh.debug = False
    names = [name for name in frame.aov_names if name.startswith("debug.")]
    assert names and frame.aov_info(names[0]).frame == "last"
    with pytest.raises(PicaError, match=r"no AOV 'debug\.nothing'"):
        frame.aov_info("debug.nothing")


def test_the_page_has_the_table():
    page = (Path(__file__).parents[1] / "docs" / "guide" / "labels.md").read_text()
    for info in AOVS.values():
        background = {None: "varies", np.inf: "infinity"}.get(info.background, f"{info.background}")
        told = f"`{info.name}`", info.meaning, info.unit, info.channels or "varies", background, info.frame
        row = "| " + " | ".join(map(str, told)).replace("|  |", "| |") + " |"
        assert row in page, row

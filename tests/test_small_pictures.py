"""Many pictures of their own, as data sets have them: what is asked for and no more, each as a new renderer's first."""

import numpy as np
import pytest

import pica
from pica.errors import PicaError
from pica.scene.camera import Camera
from pica.scene.light import PointLight
from pica.scenes.placing import move
from tests.building import CAMERA, SIZE, lambert, placed, scene_of, shining, still_life

SMALL = (24, 16)
VIEWS = [
    CAMERA,
    Camera.look_at((-2.0, 1.0, 2.5), (0, 0.4, 0)),
    Camera.look_at((0.3, 2.5, 0.5), (0, 0, 0)),
    Camera.look_at((0.2, 0.4, 1.2), (0, 0.5, -1)),
]
LABELS = ("depth", "normal", "instance")


def same(a: pica.Frame, b: pica.Frame) -> bool:
    """Whether two frames show the same, bit for bit."""
    arrays = [(a.aov(name), b.aov(name)) for name in a.aov_names]
    arrays += [(a.color, b.color), (a.display, b.display)]
    return a.aov_names == b.aov_names and all(x.tobytes() == y.tobytes() for x, y in arrays)


@pytest.fixture(scope="module")
def renderer(device):
    return pica.Renderer(still_life(), size=SMALL, device=device)


def test_a_picture_after_reset_is_that_of_a_new_renderer(device, renderer):
    renderer.render(3, camera=VIEWS[-1])
    for view in VIEWS:
        renderer.reset()
        found = renderer.render(1, camera=view)
        with pica.Renderer(renderer.scene, size=SMALL, device=device) as new:
            assert same(found, new.render(1, camera=view))
        renderer.render(2, camera=VIEWS[0])
        assert same(found, renderer.render(1, camera=view, cut=True))


def round_about(count: int) -> list[Camera]:
    """Views from all sides, far from each other."""
    angles = np.arange(count) * 2.4  # radians: each far from the one before
    return [
        Camera.look_at((2.8 * np.sin(angle), 1.2 + 0.6 * np.cos(3 * angle), 2.8 * np.cos(angle)), (0, 0.4, 0))
        for angle in angles
    ]


@pytest.mark.parametrize(
    ("size", "count"),
    [((32, 32), 6), pytest.param((128, 128), 50, marks=[pytest.mark.slow, pytest.mark.timeout(1800)])],
)
def test_views_with_cut_are_those_of_new_renderers(device, size, count):
    scene = still_life()
    with pica.Renderer(scene, size=size, device=device) as renderer:
        for view in round_about(count):
            found = renderer.render(1, camera=view, cut=True)
            renderer.reset()
            assert same(found, renderer.render(1, camera=view))
            with pica.Renderer(scene, size=size, device=device) as new:
                assert same(found, new.render(1, camera=view))
            renderer.advance(view)  # what could be taken along


@pytest.mark.parametrize("path_traced", [False, True])
def test_what_is_asked_for_and_no_more(device, renderer, path_traced):
    maker = pica.PathTracer(renderer.scene, size=SMALL, device=device) if path_traced else renderer
    maker.reset() if not path_traced else None
    everything = maker.render(1, camera=CAMERA)
    maker.reset() if not path_traced else None
    some = maker.render(1, camera=CAMERA, aovs=("instance", "depth"))
    assert set(some.aov_names) == {"depth", "instance"}
    for name in some.aov_names:
        np.testing.assert_array_equal(some.aov(name), everything.aov(name))
    np.testing.assert_array_equal(some.color, everything.color)
    assert maker.render(1, camera=CAMERA, aovs=()).aov_names == ()
    with pytest.raises(PicaError, match="no AOV 'albedo' in this frame"):
        some.aov("albedo")


def test_aovs_of_effects_come_from_the_last_frame(device, renderer):
    renderer.reset()
    two = renderer.render(2, camera=CAMERA, aovs=("shadows", "motion"))
    assert two.aov_names == ("motion", "shadows")


def test_names_of_aovs_are_those_that_effects_give(renderer):
    renderer.render(1, camera=CAMERA)
    offers = renderer._frame_plan._plan.offers.values()
    for effect in renderer.effects:
        offered = tuple(offer.name for offer in offers if offer.scope == effect.name and offer.is_aov)
        assert offered == effect.aov_names, effect.name


@pytest.mark.parametrize(
    ("aovs", "message"),
    [
        (("depth", "dept"), "render: no AOV 'dept'; there are depth, position, normal, .*transmission$"),
        ("depth", "render: aovs: 'depth': must be names"),
        ((1,), r"render: aovs: \(1,\): must be names"),
        (3, "render: aovs: 3: must be names"),
        (("ambient_occlusion",), "AOV 'ambient_occlusion' needs the effect ambient_occlusion, which is off"),
        (("debug.shadows.history",), "render: no AOV 'debug.shadows.history'"),
    ],
)
def test_wrong_names_are_one_line(renderer, aovs, message):
    off = renderer.settings.with_values({"ambient_occlusion.mode": "off"})
    assert "ambient_occlusion" in renderer.missing_aovs or renderer.configure(off) is None
    with pytest.raises(PicaError, match=message) as raised:
        renderer.render(1, camera=CAMERA, aovs=aovs)
    assert "\n" not in str(raised.value)


def test_what_is_there_for_debugging_by_name(device, renderer):
    renderer.debug = True
    try:
        every = [name for name in renderer.render(1, camera=CAMERA).aov_names if name.startswith("debug.")]
        assert renderer.render(1, camera=CAMERA, aovs=every[:1]).aov_names == (every[0],)
        with pytest.raises(PicaError, match=r"render: no AOV 'debug\.nothing'"):
            renderer.render(1, camera=CAMERA, aovs=("debug.nothing",))
    finally:
        renderer.debug = False


def test_labels_are_those_of_a_picture(device, renderer):
    renderer.render(2, camera=VIEWS[-1])
    for view in VIEWS:
        renderer.reset()
        labels = renderer.labels(camera=view)
        renderer.reset()
        picture = renderer.render(1, camera=view)
        assert labels.aov_names == tuple(name for name in renderer._stages.gbuffer.aov_names if name != "uv")
        for name in labels.aov_names:
            assert labels.aov(name).tobytes() == picture.aov(name).tobytes(), name


def test_labels_light_nothing(renderer):
    labels = renderer.labels(camera=CAMERA, aovs=LABELS)
    assert labels.aov_names == LABELS
    assert set(labels.timings) <= {"raster", "primary_rays", "primary_rays kernels", "embree", "resolve"}
    for what in ("color", "display"):
        with pytest.raises(PicaError, match="has labels and no picture"):
            getattr(labels, what)


def test_labels_of_effects_are_refused(renderer):
    with pytest.raises(PicaError, match=r"labels: no AOV 'shadows'; there are depth, .*uv$"):
        renderer.labels(camera=CAMERA, aovs=("shadows",))


def test_a_picture_after_labels_begins_anew(renderer):
    renderer.reset()
    first = renderer.render(1, camera=CAMERA, aovs=LABELS)
    renderer.render(2, camera=CAMERA)
    renderer.labels(camera=CAMERA)
    assert same(renderer.render(1, camera=CAMERA, aovs=LABELS), first)
    renderer.labels(camera=VIEWS[1])
    assert same(renderer.render(1, camera=CAMERA, aovs=LABELS), first)


def test_motion_of_labels_is_since_the_call_before(device):
    ball = placed(pica.scenes.basic_meshes.box(0.5, lambert()))
    renderer = pica.Renderer(scene_of(ball, shining(PointLight(), move(0, 3, 0))), size=SIZE, device=device)
    renderer.labels(camera=CAMERA)
    ball.transform = move(0.1, 0, 0)
    moved = renderer.labels(camera=CAMERA, aovs=("motion", "instance"))
    there = moved.aov("instance") > 0
    assert (np.abs(moved.aov("motion")[there]).max(axis=-1) > 0.3).all()
    assert not np.abs(renderer.labels(camera=CAMERA).aov("motion")).max() > 1e-3


def test_frames_stay_as_they_were(renderer):
    renderer.reset()
    frame = renderer.render(1, camera=CAMERA)
    renderer.render(1, camera=VIEWS[1])
    renderer.reset()
    again = renderer.render(1, camera=CAMERA)
    assert same(frame, again)

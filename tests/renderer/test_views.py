"""Renderers of several views: each shows what a renderer of its own would."""

import gc
from copy import deepcopy
from dataclasses import replace
from itertools import chain

import numpy as np
import pytest

import pica
from pica.errors import PicaError, SceneError
from pica.quality.metrics import flip
from pica.rhi.passes import DeviceRecording
from pica.scene.light import PointLight
from pica.scene.material import Material
from pica.scene.model import Node
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import move
from tests.building import lambert, placed, scene_of, shining, uniform
from tests.gpu_scene.test_views import FROM_LEFT, FROM_RIGHT, Stage

VIEWS, SIZE = 3, (40, 32)
METAL = Material(base_color=(0.9, 0.7, 0.5, 1.0), metallic=1.0, roughness=0.1)


def room():
    """A box, a metal sphere and a lamp on a floor."""
    lamp = shining(PointLight(intensity=30.0, radius=0.1), move(0.5, 1.6, 0.8))
    ball = placed(sphere(0.4, METAL), move(0.6, 0.4, 0), "ball")
    cube = placed(box(0.7, lambert(0.8, 0.2, 0.1)), move(-0.5, 0.35, 0), "cube")
    return scene_of(placed(plane(6, 6, lambert(0.6))), ball, cube, lamp, environment=uniform(0.3))


def node(scene, name):
    return next(each for each in scene.nodes() if each.name == name)


def cameras(step=0, count=VIEWS):
    eyes = [(1.2 * number - 1 + 0.03 * step, 1.2, 2.6) for number in range(count)]
    return [pica.Camera.look_at(eye, (0, 0.4, 0)) for eye in eyes]


def seed(number):
    return pica.Settings(seed=number)


def batches(renderer, steps=3, **arguments):
    return [renderer.render(2 if step == 0 else 1, camera=cameras(step), **arguments) for step in range(steps)]


def assert_same(found, expected):
    assert found.aov_names == expected.aov_names
    np.testing.assert_array_equal(found.color, expected.color)
    np.testing.assert_array_equal(found.display, expected.display)
    for name in expected.aov_names:
        np.testing.assert_array_equal(found.aov(name), expected.aov(name), err_msg=name)


@pytest.fixture(scope="module")
def scene():
    return room()


@pytest.fixture(scope="module")
def renderer(device, scene):
    with pica.Renderer(scene, size=SIZE, device=device, views=VIEWS) as shared:
        yield shared


@pytest.fixture
def fresh(renderer):
    renderer.reset()
    return renderer


def test_each_view_equals_a_renderer_of_its_own(device, scene, fresh):
    """Over frames with moving cameras: with histories, jitter, exposure and seeds of its own."""
    together = batches(fresh)
    for number in range(VIEWS):
        with pica.Renderer(scene, size=SIZE, device=device, settings=seed(number)) as alone:
            for step, batch in enumerate(together):
                camera = cameras(step)[number]
                assert_same(batch[number], alone.render(2 if step == 0 else 1, camera=camera))


@pytest.mark.parametrize(
    "values",
    [
        pytest.param({"rays.scheduler": "pipeline"}, id="pipeline"),
        pytest.param({"visibility.primary": "rays", "reflections.mode": "screen_space"}, id="rays"),
        pytest.param({"global_illumination.mode": "restir"}, id="restir", marks=pytest.mark.slow),
        pytest.param(
            {"post.shutter": "0.5", "antialiasing.upscale": "1.5", "shadows.method": "maps"},
            id="upscaled",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_each_view_equals_a_renderer_of_its_own_of_whatever_moves(device, values):
    """Rigid, skinned, facing the camera, at levels of detail by distance; one camera is out of focus."""
    above = pica.Camera.look_at((0, 3, 5), (0, 0.4, 0)).focused_on((0, 0.4, 0), 1.0)
    looks, chosen = [FROM_LEFT, FROM_RIGHT, above], pica.Settings().with_values(values)
    stages = [Stage() for _ in range(VIEWS + 1)]
    alone = [
        pica.Renderer(stage.scene, size=SIZE, device=device, settings=replace(chosen, seed=number))
        for number, stage in enumerate(stages[:-1])
    ]
    with pica.Renderer(stages[-1].scene, size=SIZE, device=device, settings=chosen, views=VIEWS) as together:
        for step in range(3):
            for stage in stages:
                stage.at(0.1 * step)
            batch = together.render(1, camera=looks)
            for frame, renderer, camera in zip(batch, alone, looks, strict=True):
                assert_same(frame, renderer.render(1, camera=camera))
    for renderer in alone:
        renderer.close()


def test_the_noise_of_each_view_is_another(fresh):
    """Although the camera is the same."""
    batch = fresh.render(6, camera=cameras()[:1] * VIEWS, aovs=())
    assert not any(np.array_equal(batch[0].color, other.color) for other in batch[1:])
    np.testing.assert_allclose(batch[0].color.mean(), batch[1].color.mean(), rtol=0.1)


def test_exposure_is_that_of_each_picture(fresh):
    """The floor below the lamp is exposed for less than its far end."""
    lit = pica.Camera.look_at((0.5, 0.9, 1.2), (0.5, 0, 0.8))
    dim = pica.Camera.look_at((-2.4, 0.9, -2.4), (-2.7, 0, -2.7))
    batch = fresh.render(1, camera=[lit, dim, dim], aovs=())
    ratios = [frame.display.mean() / frame.color.mean() for frame in batch]
    assert ratios[0] < 0.7 * ratios[1]


def test_arrays_have_the_view_in_front(fresh):
    batch = fresh.render(1, camera=cameras())
    width, height = SIZE
    assert batch.color.shape == batch.display.shape == (VIEWS, height, width, 3)
    assert batch.color.dtype == np.float32 and batch.display.dtype == np.uint8
    assert batch.aov("depth").shape == (VIEWS, height, width)
    assert batch.aov("normal").shape == (VIEWS, height, width, 3)
    assert batch.mask("ball").shape == (VIEWS, height, width) and batch.mask("ball").any((1, 2)).all()
    assert batch.semantic(lambda label: label.name or None).labels.shape == (VIEWS, height, width)
    assert len(batch) == VIEWS and batch.size == SIZE
    for number, frame in enumerate(batch):
        assert frame is batch[number]
        np.testing.assert_array_equal(frame.aov("instance"), batch.aov("instance")[number])
    with pytest.raises(PicaError, match="no AOV 'deph'"):
        batch.aov("deph")


def test_tensors_are_the_arrays(fresh):
    pytest.importorskip("torch")
    batch = fresh.render(1, camera=cameras(), aovs=("depth",))
    for name, array in (("color", batch.color), ("depth", batch.aov("depth"))):
        np.testing.assert_array_equal(batch.torch(name).cpu().numpy(), array)


def test_labels(fresh):
    batch = fresh.labels(camera=cameras(), aovs=("depth", "instance"))
    shown = fresh.render(1, camera=cameras(), aovs=("depth", "instance"))
    for name in ("depth", "instance"):
        np.testing.assert_array_equal(batch.aov(name), shown.aov(name))
    with pytest.raises(PicaError, match="labels and no picture"):
        _ = batch.color


def test_files(fresh, tmp_path):
    batch = fresh.render(1, camera=cameras())
    batch.save(tmp_path / "view%02d.png")
    for name in ("view.png", "view%s%s.png", "view%.png"):
        with pytest.raises(PicaError, match="the name needs one %d"):
            batch.save(tmp_path / name)
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"view{number:02}.png" for number in range(VIEWS)]


def test_times_are_those_of_all_views(device, scene, fresh):
    batch = fresh.render(1, camera=cameras(), aovs=())
    with pica.Renderer(scene, size=SIZE, device=device) as alone:
        assert alone.render(1, camera=cameras()[0], aovs=()).timings.keys() == batch.timings.keys()
    composites = [owner for owner in device.profiler.by_owner[-2] if getattr(owner, "effect", "") == "composite"]
    assert len(composites) == VIEWS


def test_reset_resize_and_configure_concern_all_views(fresh):
    first = batches(fresh, 2, aovs=())
    fresh.reset()
    for before, again in zip(first, batches(fresh, 2, aovs=()), strict=True):
        np.testing.assert_array_equal(before.color, again.color)
    try:
        fresh.resize((24, 16))
        assert fresh.render(1, camera=cameras(), aovs=()).color.shape == (VIEWS, 16, 24, 3)
        fresh.configure(replace(fresh.settings, seed=7))
        other = fresh.render(1, camera=cameras(), aovs=()).color
    finally:
        fresh.resize(SIZE)
        fresh.configure(replace(fresh.settings, seed=0))
    assert other.shape == (VIEWS, 16, 24, 3)


def test_a_still_batch_converges(fresh):
    """All views accumulate while nothing changes."""
    noisy, rest = (fresh.render(frames, camera=cameras(), aovs=()).color for frames in (1, 12))
    again = fresh.render(12, camera=cameras(), aovs=()).color
    assert (np.abs(again - rest).mean((1, 2, 3)) < 0.5 * np.abs(again - noisy).mean((1, 2, 3))).all()


def test_views_wait_for_the_device_together(device, scene, monkeypatch):
    """A batch is submitted about as often as a picture for the first view and for each group of the others."""
    counts = [0]
    submit = type(device).submit

    def counted(device, recording: DeviceRecording) -> int:
        counts[-1] += 1
        return submit(device, recording)

    monkeypatch.setattr(type(device), "submit", counted)
    with pica.Renderer(scene, size=(16, 16), device=device, views=8) as together:
        together.render(1, camera=cameras(count=8), aovs=())
        traces_by_buffers = together.tracer is not None
    counts.append(0)
    with pica.Renderer(scene, size=(16, 16), device=device) as alone:
        alone.render(1, camera=cameras()[0], aovs=())
    if traces_by_buffers:
        assert 0 < counts[0] < 5 * counts[1]
    else:
        assert counts == [1, 0]  # the rest is the end of the frame


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (None, "camera: None: must be a list of 3, one for each view"),
        (cameras(count=1)[0], "must be a list of 3, one for each view"),
        (cameras(count=2), "camera: 2 cameras: must be a list of 3, one for each view"),
    ],
    ids=["none", "one", "two"],
)
@pytest.mark.parametrize("call", ["render", "labels"])
def test_another_number_of_cameras(renderer, call, given, says):
    with pytest.raises(PicaError, match=says):
        getattr(renderer, call)(camera=given)


def test_what_is_no_camera(renderer):
    with pytest.raises(SceneError, match="render: camera"):
        renderer.render(1, camera=[1, 2, 3])


def test_several_cameras_for_a_renderer_of_one_view(device, scene):
    with (
        pica.Renderer(scene, size=SIZE, device=device) as alone,
        pytest.raises(PicaError, match=r"3 cameras: this renderer takes one; Renderer\(views=...\)"),
    ):
        alone.render(1, camera=cameras())


@pytest.mark.parametrize("views", [0, -1, 1.5, "two", 4097])
def test_impossible_numbers_of_views(device, scene, views):
    with pytest.raises(PicaError, match="Renderer: views"):
        pica.Renderer(scene, size=SIZE, device=device, views=views)


@pytest.mark.parametrize(("count", "views"), [(2, 3), (0, None)])
def test_another_number_of_scenes(device, scene, count, views):
    with pytest.raises(PicaError, match=f"Renderer: scene: {count} scenes: must be one for each"):
        pica.Renderer([scene] * count, size=SIZE, device=device, views=views)


def test_calls_that_show_one_view(renderer):
    calls = (lambda: renderer.advance(cameras()[0]), lambda: renderer.pick(1, 1))
    for call in chain(calls, [lambda: renderer.count_rays(cameras()[0])]):
        with pytest.raises(PicaError, match="this renderer has views=3, whose cameras render and labels take"):
            call()


def test_insertions_are_in_the_frames_of_all_views(fresh):
    shown = []

    def declare(graph, signals):
        graph.record("note", lambda frame: shown.append(frame.camera.transform[0, 3]))

    insertion = fresh.insert(declare, "composite", name="note")
    fresh.render(1, camera=cameras(), aovs=())
    insertion.remove()
    fresh.render(1, camera=cameras(), aovs=())
    assert sorted(shown[-VIEWS:]) == [camera.transform[0, 3] for camera in cameras()] and len(shown) % VIEWS == 0


def test_one_view_gives_batches_too(device, scene):
    with pica.Renderer(scene, size=SIZE, device=device, views=1) as renderer:
        assert renderer.render(1, camera=cameras(count=1), aovs=()).color.shape == (1, *SIZE[::-1], 3)


def vary(views, random, step):
    """Places, visibility, materials and lights of the room, by view."""
    count = len(views)
    places = np.stack([move(-0.5 + 0.2 * random.random(), 0.35 + 0.1 * step, 0.2 * random.random()) for _ in views])
    views.set_transforms("cube", places)
    views.set_visible("ball", np.arange(count) % 3 != 1)
    views.set_material("paint", base_color=random.random((count, 4)), roughness=random.random(count))
    views.set_light("light", intensity=random.uniform(10, 60, count), color=random.random((count, 3)))
    views.set_environment(strength=random.uniform(0.1, 1.0, count), rotation=random.random(count))


def assert_views_equal_scenes_of_their_own(device, views, size, steps):
    """Each view of SceneViews equals a renderer of a copy with its values, bit for bit."""
    scene = room()
    node(scene, "cube").mesh.sections[0].material.name = "paint"
    scenes = pica.SceneViews(scene, views)
    random = np.random.default_rng(1)
    batches, copies = [], []
    with pica.Renderer(scenes, size=size, device=device) as together:
        for step in range(steps):
            vary(scenes, random, step)
            batches.append(together.render(1, camera=cameras()[:1] * views))
            copies.append(deepcopy(list(scenes)))
    for number in range(views):
        with pica.Renderer(copies[0][number], size=size, device=device, settings=seed(number)) as alone:
            for step in range(steps):
                assign(copies[0][number], copies[step][number])
                assert_same(batches[step][number], alone.render(1, camera=cameras()[0]))
    return batches


def assign(scene, other):
    """Give a scene the values of another copy."""
    for name in ("cube", "ball", "light"):
        mine, theirs = node(scene, name), node(other, name)
        mine.transform, mine.light = theirs.transform, theirs.light
        for flag in ("visible_to_camera", "visible_to_reflections", "casts_shadows"):
            setattr(mine, flag, getattr(theirs, flag))
        if mine.mesh is not None:
            paint, other_paint = (each.mesh.sections[0].material for each in (mine, theirs))
            paint.base_color, paint.roughness = other_paint.base_color, other_paint.roughness
    scene.environment = other.environment


def test_scenes_of_their_own(device):
    batches = assert_views_equal_scenes_of_their_own(device, VIEWS, SIZE, 3)
    assert not batches[0].mask("ball")[1].any() and batches[0].mask("ball")[0].any()
    assert len({picture.tobytes() for picture in batches[-1].color}) == VIEWS


def test_vertices_of_each_view_move_on_their_own(device):
    """Meshes that deform have vertices and structures of their own in each view, which come while others are shown."""
    scene = room()
    rest = node(scene, "ball").mesh.sections[0].positions
    views, alone = pica.SceneViews(scene, VIEWS), [deepcopy(scene) for _ in range(VIEWS)]
    renderers = [pica.Renderer(each, size=SIZE, device=device, settings=seed(n)) for n, each in enumerate(alone)]
    with pica.Renderer(views, size=SIZE, device=device) as together:
        for step in range(4):
            if step == 1:  # not in the first picture
                cloths = [pica.DynamicVertices(each) for each in views.nodes("ball")]
                own = [pica.DynamicVertices(node(each, "ball")) for each in alone]
            for number in range(VIEWS) if step else ():
                for each in (cloths[number], own[number]):
                    each.set(rest * np.float32([1, 1 - 0.2 * number, 1 + 0.1 * step]))
            batch = together.render(1, camera=cameras())
            for number, each in enumerate(renderers):
                assert_same(batch[number], each.render(1, camera=cameras()[number]))
    for each in renderers:
        each.close()


@pytest.mark.slow
def test_64_scenes_of_their_own(device):
    assert_views_equal_scenes_of_their_own(device, 64, (16, 16), 2)


def test_maps_of_light_below_surfaces_are_traced_once_for_all_views(device):
    """Such light does not depend on the camera. Pictures stay those of a renderer of its own but for its noise; the
    light of what only another view shows is kept up to date as well."""
    wax = Material(metallic=0.0, diffuse_transmission=1.0, thin_walled=False, scattering=(10.0, 10.0, 10.0))
    scene = room()
    scene.add(placed(sphere(0.4, wax), move(0, 0.4, -0.8), "wax"))
    aside, facing = pica.Camera.look_at((0, 1, 2), (0, 1, 5)), pica.Camera.look_at((0.3, 0.8, 0.6), (0, 0.4, -0.8))
    with pica.Renderer(scene, size=SIZE, device=device, views=2) as together:
        batch = together.render(12, camera=[aside, facing])
        traced = [{node.name for node in view.plan._plan.nodes} for view in together._views]
    with pica.Renderer(scene, size=SIZE, device=device, settings=seed(1)) as alone:
        frame = alone.render(12, camera=facing)
    assert "map_rays" in traced[0] and "map_rays" not in traced[1]
    light, expected = batch[1].aov("subsurface"), frame.aov("subsurface")
    assert (expected.sum(-1) > 0).mean() > 0.1 and not batch[0].aov("subsurface").any()
    np.testing.assert_array_equal(light.sum(-1) > 0, expected.sum(-1) > 0)
    assert light.mean() == pytest.approx(expected.mean(), rel=0.1)
    assert flip(frame.color, batch[1].color)[0] < 0.01


def test_a_fault_in_one_scene_leaves_the_others_changes(device):
    """Nothing is recorded before all scenes have been checked."""
    scenes = [room(), room()]
    far = Node("far")
    scenes[1].add(far).add(placed(box(0.1, lambert()), name="small"))
    with pica.Renderer(scenes, size=SIZE, device=device) as together:
        together.render(1, camera=cameras(count=2), aovs=())
        node(scenes[0], "cube").transform = move(-0.5, 1.2, 0)
        far.transform = node(scenes[1], "small").transform = np.diag([1e30, 1e30, 1e30, 1.0])
        with pytest.raises(SceneError):
            together.render(1, camera=cameras(count=2), aovs=())
        far.transform = node(scenes[1], "small").transform = np.eye(4)
        batch = together.render(1, camera=cameras()[:1] * 2, aovs=("instance",))
        high, low = (np.argwhere(mask)[:, 0].mean() for mask in batch.mask("cube"))
        assert high < low - 2


def test_memory_stays_while_batches_go_on(device, fresh):
    for step in range(3):
        fresh.render(1, camera=cameras(step), aovs=("depth",)).aov("depth")
    gc.collect()  # what other tests have left
    before = device.memory
    for step in range(40):
        fresh.render(1, camera=cameras(step % 5), aovs=("depth",)).aov("depth")
    assert device.memory == before


def test_memory_stays_while_each_view_has_values_of_its_own(device):
    scene = room()
    node(scene, "cube").mesh.sections[0].material.name = "paint"
    views, random = pica.SceneViews(scene, 2), np.random.default_rng(0)
    with pica.Renderer(views, size=(16, 16), device=device) as renderer:

        def batches(count):
            for step in range(count):
                vary(views, random, step % 3)
                renderer.render(1, camera=cameras(count=2), aovs=())

        batches(6)
        gc.collect()
        before = device.memory
        batches(12)
        assert device.memory == before


def test_all_views_are_freed(device):
    scene = room()
    gc.collect()
    before = device.memory
    renderer = pica.Renderer(scene, size=SIZE, device=device, views=2)
    renderer.render(1, camera=cameras(count=2), aovs=())
    assert device.memory > before
    renderer.close()
    assert device.memory == before

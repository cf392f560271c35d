"""Views whose frames are recorded together, by programs with rows of arguments: what each shows stays as it was."""

import pickle
from types import SimpleNamespace

import numpy as np
import pytest

import pica
from pica.errors import DeviceError
from pica.many_views.merged_plans import _handles
from pica.many_views.row_tables import _read_handle
from pica.rendering.tensors import are_decoded_at_once, cuda_tensor_of_all, decoded_array
from pica.scene.particles import Particles, Sprites
from pica.scenes.placing import move
from tests.building import lambert
from tests.renderer.test_views import SIZE, VIEWS, assert_same, batches, cameras, room

RASTER = pica.Settings.preset("raster").with_values({"global_illumination.mode": "off"})
PIPELINES = pica.Settings().with_values({"rays.scheduler": "pipeline", "visibility.primary": "rays"})


@pytest.fixture
def merged(monkeypatch):
    """Software devices record frames together too."""
    monkeypatch.setattr(pica.Renderer, "_merges_views", True)


def steps_of(renderer):
    """How many of the newest frames' nodes are dispatched for all views."""
    return sum(entry.step is not None for entry in renderer._merged._entries)


@pytest.mark.parametrize(
    ("settings", "least"), [pytest.param(PIPELINES, 30, id="rays"), pytest.param(RASTER, 20, id="raster")]
)
def test_each_view_equals_a_renderer_of_its_own(device, merged, settings, least):
    scene = room()
    with pica.Renderer(scene, size=SIZE, device=device, settings=settings, views=VIEWS) as renderer:
        together = batches(renderer, steps=4)
        assert steps_of(renderer) >= least
    for number in range(VIEWS):
        own = settings.with_values({"seed": str(number)})
        with pica.Renderer(scene, size=SIZE, device=device, settings=own) as alone:
            for step, batch in enumerate(together):
                assert_same(batch[number], alone.render(2 if step == 0 else 1, camera=cameras(step)[number]))


@pytest.fixture(scope="module")
def raster(device):
    """Renderers of a scene, of whose views the first's are recorded together, and the second's apart."""
    scene = room()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pica.Renderer, "_merges_views", True)
        together = pica.Renderer(scene, size=SIZE, device=device, settings=RASTER, views=VIEWS)
    with together, pica.Renderer(scene, size=SIZE, device=device, settings=RASTER, views=VIEWS) as apart:
        yield scene, together, apart


def both(raster, steps=2, first=0, **arguments):
    """Batches of both renderers, which are equal."""
    _, *renderers = raster
    for step in range(first, first + steps):
        found, expected = (renderer.render(1, camera=cameras(step), **arguments) for renderer in renderers)
        assert_same(found, expected)


def test_of_changes(raster):
    scene, *renderers = raster
    both(raster)
    for renderer in renderers:
        renderer.reset()
    both(raster)
    for renderer in renderers:
        renderer.resize((24, 40))
    both(raster)
    for renderer in renderers:
        renderer.resize(SIZE)
        renderer.configure(RASTER.with_values({"post.exposure": "1", "antialiasing.mode": "accumulate"}))
    both(raster)
    cube = next(node for node in scene.nodes() if node.name == "cube")
    cube.transform = move(-0.4, 0.35, 0.1)
    both(raster)
    for renderer in renderers:
        renderer.configure(RASTER)
    both(raster, first=2)


def test_of_labels(raster):
    _, together, apart = raster
    found, expected = (renderer.labels(camera=cameras()) for renderer in (together, apart))
    for name in expected.aov_names:
        np.testing.assert_array_equal(found.aov(name), expected.aov(name), err_msg=name)


def test_of_what_faces_each_camera(raster):
    """Views see different geometry while it is there, and their frames are recorded one by one."""
    scene, together, _ = raster
    both(raster)
    sprites = Sprites(2, lambert(0.2, 0.7, 0.2))
    sprites.particles = Particles(np.array([[0, 1, 0], [0.4, 1.2, 0.2]]), sizes=[0.2, 0.3])
    scene.add(sprites.node)
    both(raster)
    assert together._merged._plans == ()
    scene.remove(sprites.node)
    both(raster)
    assert len(together._merged._plans) == VIEWS


def test_of_a_pass_of_the_user(raster):
    _, *renderers = raster
    shown = []

    def declare(graph, signals):
        graph.record("note", lambda frame: shown.append(frame.camera.transform[0, 3]))

    insertions = [renderer.insert(declare, "composite", name="note") for renderer in renderers]
    both(raster)
    for insertion in insertions:
        insertion.remove()
    both(raster)
    assert len(shown) == 2 * 2 * VIEWS


def test_pictures_are_read_at_once(raster, monkeypatch):
    """All views' pictures are in the same memory, and equal those of the frames."""
    _, together, _ = raster
    batch = together.render(1, camera=cameras(), aovs=())
    color, display = batch.color, batch.display
    assert color.shape == (VIEWS, *SIZE[::-1], 3) and color.base is not None
    for number, frame in enumerate(batch):
        np.testing.assert_array_equal(color[number], frame.color)
        np.testing.assert_array_equal(display[number], frame.display)


def test_the_device_decodes_all_views_at_once(raster):
    """Each as the frame's array has it."""
    _, together, _ = raster
    batch = together.render(1, camera=cameras())
    captured = batch._whole_tensor.args[2]
    for name in ("color", "depth", "normal", "instance", "motion"):
        captures = [of_view[name] for of_view in captured]
        assert are_decoded_at_once(captures) and not are_decoded_at_once(captures[1:])
        values = decoded_array(together.device, SIZE, captures[0], VIEWS)
        expected = batch.color if name == "color" else batch.aov(name)
        assert values.shape == expected.shape and values.dtype == expected.dtype
        np.testing.assert_allclose(values, expected, rtol=2e-6, atol=2e-6, err_msg=name)
    assert cuda_tensor_of_all(together.device, SIZE, captures) is None


def test_without_handles_for_all_views_they_are_recorded_one_by_one(device, merged, monkeypatch):
    """Their pictures are those of before: a handle too many would be read as black."""
    scene = room()
    with pica.Renderer(scene, size=SIZE, device=device, settings=RASTER, views=VIEWS) as renderer:
        expected = renderer.render(1, camera=cameras())
        assert len(renderer._merged._plans) == VIEWS
        needed = sum(_handles(plan) for plan in renderer._merged._plans)
    assert 100 < needed < device.handles
    monkeypatch.setattr(device, "handles", needed)
    with pica.Renderer(scene, size=SIZE, device=device, settings=RASTER, views=VIEWS) as renderer:
        assert_same(renderer.render(1, camera=cameras()), expected)
        assert renderer._merged._plans == ()


def test_a_handle_that_is_none_is_an_error():
    texture = SimpleNamespace(descriptor_handle_ro=0)
    with pytest.raises(DeviceError, match="fewer views"):
        _read_handle(texture)


def test_batches_are_pickled_with_all_their_buffers(raster):
    _, together, _ = raster
    batch = together.render(1, camera=cameras(), aovs=("depth", "instance"))
    copy = pickle.loads(pickle.dumps(batch))
    assert_same(copy, batch)
    assert copy.timings == batch.timings and len(copy) == VIEWS

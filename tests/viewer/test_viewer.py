"""The viewer's model: pictures of views, small in motion and whole at rest."""

import numpy as np
import pytest
import slangpy as spy

import pica
from pica.frame.aovs import at_size
from pica.scenes.basic_meshes import box, plane
from pica.scenes.placing import move
from pica.viewer.outline import outlined
from pica.viewer.view import View
from pica.viewer.viewer import Viewer
from tests.building import lambert, placed, scene_of, uniform

SIZE = (96, 64)
CAMERA = pica.Camera.look_at((0, 1.5, 4), (0, 0.5, 0))


@pytest.fixture(scope="module")
def viewer(device):
    scene = scene_of(
        placed(box(1.0, lambert(0.8, 0.2, 0.2)), move(0, 0.5, 0), "cube"),
        placed(plane(20, 20, lambert()), name="floor"),
        environment=uniform(1, 1, 1),
    )
    return Viewer(scene, settings=pica.Settings.preset("raster"), device=device, frames=3)


@pytest.fixture
def view(viewer):
    return viewer.view(SIZE, CAMERA)


def settled(viewer, view, start: float = 0.0):
    """The complete picture."""
    now = start
    for _ in range(20):
        picture = viewer.render(view, now)
        now += 1.0
        if viewer.is_complete(view):
            return picture
    raise AssertionError("it is never complete")


def test_pictures_grow_and_then_gather_frames(viewer, view):
    first = viewer.render(view, 0.0)
    assert not first.is_full and first.pixels.shape[0] < SIZE[1] and first.pixels.dtype == np.uint8
    assert viewer.render(view, 0.1).pixels.shape == first.pixels.shape, "a moment later"
    last = settled(viewer, view, 1.0)
    assert last.is_full and last.frames == 3 and last.pixels.shape == (64, 96, 3)
    assert last.pixels.std() > 5


@pytest.mark.parametrize("change", ["camera", "scene", "settings", "shown", "size"])
def test_every_change_begins_a_new_picture(viewer, view, change):
    before = settled(viewer, view)
    [cube] = [node for node in viewer.scene.nodes() if node.name == "cube"]
    match change:
        case "camera":
            view.control.orbit(0.5, 0)
        case "scene":
            cube.transform = move(0.5, 0.5, 0)
        case "settings":
            viewer.set("post.exposure", 1.0)
        case "shown":
            viewer.show("normal")
        case "size":
            view.resize((64, 96))
    assert not viewer.is_complete(view)
    assert viewer.render(view, 100.0).frames == 1
    after = settled(viewer, view, 101.0)
    if change == "size":
        assert after.pixels.shape == (96, 64, 3)
    else:
        assert np.abs(after.pixels.astype(int) - before.pixels).mean() > 1
    cube.transform = move(0, 0.5, 0)
    viewer.set("post.exposure", 0.0)
    viewer.show("display")


def test_a_whole_picture_waits_until_the_rest_has_lasted_as_long():
    view = View(None, (640, 360))
    view.follow("moved", 0.0)
    view.resolution.measure(0.3)
    view.follow("moved", 0.1)
    small = view.resolution.size
    view.follow("moved", 1.0)
    assert view.resolution.size == small, "the next one takes 1.2 seconds"
    view.follow("moved", 1.3)
    assert view.resolution.size > small
    view.follow("moved again", 1.31)
    assert view.resolution.size <= small


def test_what_can_be_shown_has_aovs_and_views_of_effects(viewer, view):
    viewer.render(view, 0.0)
    assert {"display", "depth", "normal", "debug.ambient_occlusion.raw"} <= set(viewer.showable)
    viewer.show("debug.ambient_occlusion.raw")
    assert viewer.render(view, 1.0).pixels.ndim == 3
    viewer.set("ambient_occlusion.mode", "off")
    assert viewer.render(view, 2.0).pixels.std() > 5, "the display instead"
    viewer.configure(pica.Settings.preset("raster"))
    viewer.show("display")
    with pytest.raises(pica.PicaError, match="'nothing' is not one of display, "):
        viewer.show("nothing")


def test_views_have_pictures_of_their_own(viewer, view):
    other = viewer.view(SIZE, pica.Camera.look_at((4, 1.5, 0), (0, 0.5, 3)))
    alone = settled(viewer, view)
    settled(viewer, other)
    assert viewer.is_complete(view), "the other one changes nothing"
    view.control.orbit(0.1, 0)
    viewer.render(view, 50.0)
    view.control.orbit(-0.1, 0)
    again = settled(viewer, view, 51.0)
    assert np.abs(again.pixels.astype(int) - alone.pixels).mean() < 1


def test_picks_are_of_the_view_that_asks(viewer, view):
    other = viewer.view(SIZE, pica.Camera.look_at((0, 5, 0.1), (30, 0, 0)))
    settled(viewer, other)
    assert viewer.pick(view, 0.5, 0.5).node.name == "cube" and viewer.node.name == "cube"
    assert viewer.pick(other, 0.5, 0.9).node.name == "floor"
    assert viewer.pick(view, 0.5, 0.0) is None and viewer.node is None
    assert viewer.pick(view, 1.0, 1.0).node.name == "floor", "the last pixel"


def test_a_screenshot_is_whole_at_once(viewer, view):
    viewer.render(view, 0.0)
    assert viewer.render_full(view).pixels.shape == (64, 96, 3)


def test_times_are_by_effect(viewer, view):
    viewer.render(view, 0.0)
    assert viewer.milliseconds["gbuffer"] > 0


def test_settings_that_do_not_exist_change_nothing(viewer, view):
    before = viewer.settings
    with pytest.raises(pica.SettingsError):
        viewer.set("post.exposure", 1e9)
    assert viewer.settings == before


ORANGE = np.array((255, 140, 0))


def orange(pixels: np.ndarray) -> np.ndarray:
    """(count, 2) rows and columns of the outline."""
    return np.argwhere((pixels == ORANGE).all(axis=-1))


def test_what_is_selected_has_an_outline(viewer, view):
    viewer.select(None)
    assert not len(orange(settled(viewer, view).pixels))
    [cube] = [node for node in viewer.scene.nodes() if node.name == "cube"]
    viewer.select(cube)
    assert not viewer.is_complete(view) and viewer.materials == (cube.mesh.sections[0].material,)
    line = orange(settled(viewer, view, 10.0).pixels)
    assert 60 < len(line) < 300 and abs(line[:, 1].mean() - 47.5) < 3, "around the cube in the middle"
    assert not len(orange(viewer.render_full(view).pixels)), "pictures that are saved have none"
    viewer.show("instance")
    assert len(orange(settled(viewer, view, 20.0).pixels))
    viewer.show("display")
    np.testing.assert_allclose(viewer.focus, (0, 0.5, 0), atol=1e-6)
    viewer.select(None)
    assert viewer.focus is None


def test_a_removed_node_is_no_longer_selected(viewer, view):
    extra = viewer.scene.add(placed(box(0.2, lambert()), move(1, 0.5, 0), "extra"))
    viewer.select(extra)
    settled(viewer, view)
    viewer.scene.remove(extra)
    settled(viewer, view, 50.0)
    assert viewer.node is None


def test_edits_are_in_the_next_picture_and_undone(viewer, view):
    viewer.select(None)
    before = settled(viewer, view).pixels.astype(int)
    [cube] = [node for node in viewer.scene.nodes() if node.name == "cube"]
    viewer.edits.apply(viewer.visibility.changes(cube, False))
    hidden = settled(viewer, view, 10.0).pixels.astype(int)
    assert np.abs(hidden - before).mean() > 3 and np.ptp(hidden[32]) < np.ptp(before[32])
    viewer.edits.undo()
    assert np.abs(settled(viewer, view, 20.0).pixels - before).mean() < 2


@pytest.fixture
def comparing(viewer):
    """Compares with a name, until the test ends."""
    viewer.select(None)
    yield viewer.compare
    viewer.compare(None)
    viewer.split = 0.5


def test_a_preset_is_beside_the_picture(viewer, view, comparing):
    alone = settled(viewer, view).pixels.astype(int)
    viewer.set("ambient_occlusion.mode", "off")
    viewer.set("post.exposure", 1.0)
    comparing("raster")
    viewer.split = 0.25
    first = viewer.render(view, 10.0)
    assert not first.is_full and (first.pixels[:, round(first.pixels.shape[1] * 0.25)] == 255).all(), "in motion too"
    both = settled(viewer, view, 11.0).pixels.astype(int)
    assert (both[:, 24] == 255).all()
    assert np.abs(both[:, 26:] - alone[:, 26:]).mean() < 2 < 10 < np.abs(both[:, :23] - alone[:, :23]).mean()
    viewer.configure(pica.Settings.preset("raster"))


def test_the_place_of_the_split_needs_no_other_picture(viewer, view, comparing):
    comparing("raster")
    viewer.set("post.exposure", 1.0)
    settled(viewer, view)
    viewer.split = 1.0
    assert not viewer.is_complete(view)
    left = viewer.render(view, 30.0)
    assert viewer.is_complete(view) and left.is_full and left.seconds == 0
    viewer.split = 0.0
    right = viewer.render(view, 31.0)
    assert left.pixels[:, 1:].mean() > 1.2 * right.pixels[:, 1:].mean()
    assert viewer.pick(view, 0.5, 0.5).node.name == "cube"
    viewer.set("post.exposure", 0.0)


def test_the_path_tracer_is_beside_whole_pictures(viewer, view, comparing):
    comparing("path_traced")
    assert viewer.compared_with == "path_traced"
    small = viewer.render(view, 0.0)
    assert not small.is_full and not (small.pixels[:, small.pixels.shape[1] // 2] == 255).all()
    both = settled(viewer, view, 1.0).pixels
    expected = pica.PathTracer(viewer.scene, size=SIZE, settings=viewer.settings, device=viewer.device)
    np.testing.assert_array_equal(both[:, 49:], expected.render(3, camera=CAMERA).display[:, 49:])
    viewer.show("normal")
    assert not (settled(viewer, view, 30.0).pixels[:, 48] == 255).all(), "AOVs are alone"
    viewer.show("display")


def test_input_interrupts_the_path_tracer(viewer, view, comparing):
    comparing("path_traced")
    asked = []
    viewer.interrupted = lambda: asked.append(1) or True
    for now in range(10):
        viewer.render(view, float(now))
    assert asked and not viewer.is_complete(view)
    viewer.interrupted = lambda: False
    settled(viewer, view, 20.0)


def test_only_what_there_is_is_compared_with(viewer):
    with pytest.raises(pica.PicaError, match="compare: 'fast' is not one of path_traced, "):
        viewer.compare("fast")
    assert viewer.compared_with is None


@pytest.mark.parametrize("upscale", [1.0, 1.5])
def test_the_display_stays_on_the_device_with_its_outline(viewer, view, upscale):
    viewer.set("antialiasing.upscale", upscale)
    [cube] = [node for node in viewer.scene.nodes() if node.name == "cube"]
    for node in (None, cube, viewer.scene.roots[1]):
        viewer.select(node)
        settled(viewer, view)
        stays = viewer.render(view, 100.0, on_device=True)
        assert isinstance(stays.content, spy.Texture) and stays.size == SIZE
        visibility = viewer._renderer.textures["visibility"].to_numpy()[..., 0].astype(int)
        numbers = viewer._renderer.newest.view.numbers_of([] if node is None else [node])
        labels = np.concatenate([[0], viewer._renderer.newest.view.labels()[:, 0]])
        selected = at_size(SIZE, {"instance": lambda: np.isin(labels[visibility], numbers)})["instance"]()  # noqa: B023
        assert selected.any() == (node is not None)
        plain = viewer._renderer.textures["display"].to_numpy()[..., :3]
        assert np.array_equal(stays.pixels, outlined(plain, selected))
    viewer.show("normal")
    assert isinstance(viewer.render(view, 101.0, on_device=True).content, np.ndarray)
    viewer.show("display")
    viewer.select(None)
    viewer.set("antialiasing.upscale", 1.0)


def test_a_pick_tells_all_of_its_pixel(viewer, view):
    settled(viewer, view)
    viewer.pick(view, 0.5, 0.5)
    values = dict(viewer.pixel)
    red, green, blue = map(float, values["albedo"].split(", "))
    assert red == pytest.approx(0.8, abs=0.01) and green == blue == pytest.approx(0.2, abs=0.01)
    assert values["depth"].endswith(" m") and 3 < float(values["depth"].split()[0]) < 4.5
    shown = [int(value) for value in values["display"].removesuffix(" sRGB").split(", ")]
    assert shown[0] > 1.5 * max(shown[1:])
    frame = viewer.frame(view)
    assert {name.replace("_", " ") for name in frame.aov_names} == values.keys() - {"display", "radiance"}
    viewer.pick(view, 0.5, 0.0)
    assert dict(viewer.pixel)["depth"] == "inf m"


def test_a_frame_of_a_view_is_whole_and_has_what_lies_below(viewer, view, tmp_path):
    viewer.show("normal")
    view.control.orbit(0.2, 0.0)
    frame = viewer.frame(view)
    assert frame.size == SIZE and view.resolution.is_full
    frame.save(tmp_path / "frame.exr")
    channels = pica.read_exr(tmp_path / "frame.exr")
    assert {"R", "depth.Z", "albedo.R"} <= channels.keys()
    viewer.show("display")
    settled(viewer, view)
    assert np.abs(viewer.render_full(view).pixels.astype(int) - frame.display).mean() < 3, "the same picture"


def test_rays_are_counted_once_a_picture_is_complete(viewer, view):
    viewer.set("ambient_occlusion.mode", "ray_traced")
    settled(viewer, view)
    viewer.rays = {}
    view.control.orbit(0.1, 0.0)
    viewer.render(view, 1000.0)
    while not viewer.is_complete(view):
        assert viewer.rays == {}
        viewer.render(view, 1001.0 + view.frames)
    assert set(viewer.rays) == {"occlusion_rays"} and viewer.rays["occlusion_rays"] > 1000
    viewer.rays, viewer.frames = {}, 1
    view.control.orbit(0.1, 0.0)
    settled(viewer, view)
    assert viewer.rays == {}, "in motion each such picture would be complete"
    viewer.frames = 3
    viewer.configure(pica.Settings.preset("raster"))

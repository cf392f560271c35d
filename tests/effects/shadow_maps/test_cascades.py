"""Cascades: where they lie, and when they are drawn anew. No GPU."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from pica.effects.shadow_maps.cascades import Cascades, slice_sphere, spheres, split_distances, view_range
from pica.effects.shadow_maps.mapped_lights import seen_from
from pica.scene.camera import Camera
from pica.scene.light import DirectionalLight
from pica.scenes.placing import aim
from pica.settings import ShadowMapsSettings
from tests.building import orthographic, shining

BOX = np.array([-40.0, -1, -40]), np.array([40.0, 4, 40])
ASPECT = 1.6
SETTINGS = ShadowMapsSettings(cascade_size=512)
LIGHT = seen_from(shining(DirectionalLight(), aim((1, 2, 1.5), (0, 0, 0))))


def test_splits_go_from_even_steps_to_even_ratios():
    assert split_distances(1, 16, 4, 0) == pytest.approx([1, 4.75, 8.5, 12.25, 16])
    assert split_distances(1, 16, 4, 1) == pytest.approx([1, 2, 4, 8, 16])
    assert split_distances(1, 16, 4, 0.5)[2] == pytest.approx((8.5 + 4) / 2)


def corners(camera: Camera, near: float, far: float) -> np.ndarray:
    places = []
    for distance, x, y in itertools.product((near, far), (-1, 1), (-1, 1)):
        half = np.tan(camera.vertical_fov / 2) * distance
        if camera.orthographic_height is not None:
            half = camera.orthographic_height / 2
        across, up = x + 1 - 2 * camera.principal_point[0], y + 2 * camera.principal_point[1] - 1
        places.append(camera.transform @ (across * half * ASPECT * camera.pixel_aspect, up * half, -distance, 1))
    return np.array(places)[:, :3]


@pytest.mark.parametrize("fov", [10, 45, 100])
@pytest.mark.parametrize("ends", [(0.1, 3), (5, 6), (1, 400)])
def test_the_sphere_just_holds_its_slice(fov, ends):
    camera = Camera.look_at((1, 2, 3), (4, 0, 1), vertical_fov=np.radians(fov))
    sphere = slice_sphere(camera, ASPECT, *ends)
    reach = np.linalg.norm(corners(camera, *ends) - sphere.center, axis=1)
    assert reach.max() == pytest.approx(sphere.radius)


@pytest.mark.parametrize("lens", [{"principal_point": (0.1, 0.7)}, {"pixel_aspect": 1.5}])
def test_the_sphere_of_another_lens(lens):
    camera = replace(Camera.look_at((1, 2, 3), (4, 0, 1)), **lens)
    for view in (camera, replace(camera, orthographic_height=5.0)):
        sphere = slice_sphere(view, ASPECT, 2, 7)
        reach = np.linalg.norm(corners(view, 2, 7) - sphere.center, axis=1)
        assert reach.max() == pytest.approx(sphere.radius)


def test_the_sphere_of_an_orthographic_view():
    camera = orthographic((1, 2, 3), (4, 0, 1), 5.0)
    sphere = slice_sphere(camera, ASPECT, 2, 7)
    assert np.linalg.norm(corners(camera, 2, 7) - sphere.center, axis=1) == pytest.approx(sphere.radius)


def test_the_range_holds_the_box_and_seldom_changes():
    ranges = set()
    for x in np.linspace(0, 1, 50):
        camera = Camera.look_at((x, 6, 100), (0, 0, 0))
        near, far = view_range(camera, BOX)
        along = [
            (np.array(corner) - camera.transform[:3, 3]) @ -camera.transform[:3, 2]
            for corner in itertools.product(*np.transpose(BOX))
        ]
        assert near <= min(along) and max(along) <= far
        ranges.add((near, far))
    assert len(ranges) <= 2


def test_a_cascade_that_holds_the_scene_is_the_last():
    small = np.array([-1.0, 0, -1]), np.array([1.0, 1, 1])
    assert len(spheres(Camera.look_at((0, 5, 30), (0, 0, 0)), ASPECT, small, SETTINGS)) == 1
    assert len(spheres(Camera.look_at((0, 2, 5), (0, 0, 0)), ASPECT, BOX, SETTINGS)) == 4


def walk(settings: ShadowMapsSettings, step: float, frames: int = 200):
    """Yields what each frame of a walk through the box wants, the views it has, and which were drawn."""
    cascades = Cascades(settings)
    views = {}
    for frame in range(frames):
        angle = 0.1 * step * frame
        eye = np.array((8 * np.cos(angle), 1.5, 8 * np.sin(angle)))
        camera = Camera.look_at(eye, eye + np.array((np.cos(3 * angle), -0.2, np.sin(3 * angle))), near=0.1)
        wanted = spheres(camera, ASPECT, BOX, settings)
        stale = dict(cascades.update(wanted, LIGHT, BOX))
        views |= stale
        yield frame, wanted, views, list(stale)


def test_every_frame_has_what_it_needs_from_few_drawings():
    drawn, at_once = 0, []
    for frame, wanted, views, stale in walk(SETTINGS, 0.05):
        if frame:
            drawn += len(stale)
            at_once.append(len(stale))
        for sphere, view in zip(wanted, (views[i] for i in range(4)), strict=True):
            offset = (sphere.center - view.transform[:3, 3]) @ view.transform[:3, :2]
            assert np.abs(offset).max() + sphere.radius <= view.orthographic_height / 2 * (1 + 2 / 512)
    assert 1 <= drawn <= 0.1 * 4 * 200
    assert np.mean(np.array(at_once) > 1) < 0.03  # all at once where the range takes another step


def test_texels_stay_where_they_are_in_the_world(monkeypatch):
    monkeypatch.setattr("pica.effects.shadow_maps.cascades._MARGIN", 0.0)
    settings = ShadowMapsSettings(cascade_size=512)
    fractions = []
    for _, _, views, stale in walk(settings, 0.01, 30):
        view = views[1]
        texel = view.orthographic_height / 512
        place = view.transform[:3, 3] @ LIGHT.transform[:3, :2] / texel
        fractions.append((1 in stale, *(place - np.round(place)), texel))
    fractions = np.array(fractions)
    assert fractions[:, 0].sum() > 10
    assert fractions[:, 1:3] == pytest.approx(0, abs=1e-6)
    assert len(set(fractions[:, 3])) <= 2


def test_nothing_is_drawn_while_the_camera_stands_still():
    cascades = Cascades(SETTINGS)
    wanted = spheres(Camera.look_at((0, 2, 5), (0, 0, 0)), ASPECT, BOX, SETTINGS)
    assert [cascade for cascade, _ in cascades.update(wanted, LIGHT, BOX)] == [0, 1, 2, 3]
    assert cascades.update(wanted, LIGHT, BOX) == []
    cascades.forget()
    assert [cascade for cascade, _ in cascades.update(wanted, LIGHT, BOX)] == [0, 1, 2, 3]

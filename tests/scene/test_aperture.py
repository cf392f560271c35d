"""The lens of a camera."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import pica
from pica.errors import SceneError

PLAIN = pica.Camera(np.eye(4))


def test_the_focal_length_follows_from_the_field_of_view():
    full_frame = pica.Camera(np.eye(4), vertical_fov=2 * math.atan(12 / 50), f_number=2.0, focus_distance=3.0)
    assert full_frame.focal_length == pytest.approx(0.05)
    assert full_frame.aperture_radius == pytest.approx(0.0125)
    assert replace(full_frame, sensor_height=0.048).focal_length == pytest.approx(0.1)
    assert PLAIN.aperture_radius == 0


def test_the_lens_stays_with_the_camera():
    lens = {"f_number": 2.0, "focus_distance": 3.0, "sensor_height": 0.03, "aperture_blades": 6}
    scene = pica.Scene()
    node = pica.Node(camera=pica.Camera(np.eye(4), **lens))
    scene.add(node)
    (placed,) = scene.cameras()
    assert {name: getattr(placed, name) for name in lens} == lens


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"f_number": 2.8}, "f_number: needs a focus_distance"),
        ({"f_number": 0.0, "focus_distance": 1.0}, "f_number: 0.0 is not above 0"),
        ({"f_number": 2.8, "focus_distance": -1.0}, "focus_distance: -1.0 is not above 0"),
        ({"aperture_blades": 2}, "aperture_blades: 2 blades are no aperture"),
        ({"aperture_blades": 65}, "aperture_blades: 65 is not from 0 to 64"),
        ({"sensor_height": float("nan")}, "sensor_height: nan is not"),
        (
            {"f_number": 2.8, "focus_distance": 1.0, "orthographic_height": 2.0},
            "an orthographic camera has no aperture",
        ),
    ],
)
def test_a_wrong_lens_is_refused(values, says):
    with pytest.raises(SceneError, match=says):
        replace(PLAIN, **values)


def loaded(folder, extras, kind="perspective"):
    views = {"perspective": {"yfov": 0.7, "znear": 0.1}, "orthographic": {"xmag": 1, "ymag": 1, "znear": 0, "zfar": 9}}
    content = {
        "asset": {"version": "2.0"},
        "cameras": [{"type": kind, kind: views[kind], "extras": {"pica": extras}}],
        "nodes": [{"camera": 0}],
    }
    path = folder / "camera.gltf"
    path.write_text(json.dumps(content))
    (camera,) = pica.load(path).cameras()
    return camera


@pytest.mark.filterwarnings("ignore:.*shows nothing", "ignore:.*no light")
def test_a_file_may_tell_of_the_lens(tmp_path):
    lens = {"f_number": 1.4, "focus_distance": 2.5, "sensor_height": 0.01, "aperture_blades": 5}
    camera = loaded(tmp_path, lens)
    assert {name: getattr(camera, name) for name in lens} == lens
    assert loaded(tmp_path, {}).f_number is None


@pytest.mark.filterwarnings("ignore:.*shows nothing", "ignore:.*no light")
@pytest.mark.parametrize(
    ("extras", "kind", "says"),
    [
        ({"f_number": "wide"}, "perspective", r"cameras\[0\].extras.pica.f_number: 'wide' is not a number"),
        ({"f_number": 2}, "perspective", r"cameras\[0\].extras.pica: f_number needs a focus_distance"),
        ({"f_number": 0, "focus_distance": 1}, "perspective", "must be above 0"),
        ({"aperture_blades": 2}, "perspective", "2 blades are no aperture"),
        ({"f_number": 2, "focus_distance": 1}, "orthographic", r"cameras\[0\].*an orthographic camera has no aperture"),
    ],
)
def test_a_wrong_lens_in_a_file_is_named(tmp_path, extras, kind, says):
    with pytest.raises(SceneError, match=says):
        loaded(tmp_path, extras, kind)


def test_focus_on_a_point_is_at_its_distance_along_the_axis():
    camera = pica.Camera.look_at((0, 0, 5), (0, 0, 0)).focused_on((2, 1, 1), f_number=4.0)
    assert (camera.f_number, camera.focus_distance) == (4.0, pytest.approx(4.0))
    with pytest.raises(SceneError, match="is not in front of the camera"):
        camera.focused_on((0, 0, 6), f_number=4.0)

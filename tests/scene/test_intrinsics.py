"""Calibrated cameras: OpenCV's numbers in, the same numbers out."""

from dataclasses import replace

import numpy as np
import pytest

from pica.errors import SceneError
from pica.scene.camera import Camera
from tests.building import orthographic

SIZE = (96, 64)
K = (90.0, 70.0, 21.0, 49.0)
POSE = np.array([[0, 0, -1, 2], [0.6, 0.8, 0, 3], [0.8, -0.6, 0, -1], [0, 0, 0, 1]])


def calibrated(**given) -> Camera:
    numbers = dict(zip(("fx", "fy", "cx", "cy"), K, strict=True))
    return Camera.from_intrinsics(**{**numbers, "size": SIZE, "pose": POSE, **given})


def test_what_is_given_comes_back():
    fx, fy, cx, cy = K
    for convention in ("opencv", "opengl"):
        camera = calibrated(convention=convention, near=0.2, name="left")
        np.testing.assert_allclose(camera.intrinsics(SIZE), [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], rtol=1e-12)
        np.testing.assert_allclose(camera.pose(convention), POSE, atol=1e-15)
        assert (camera.near, camera.name) == (0.2, "left")


def test_conventions_differ_in_two_axes():
    np.testing.assert_array_equal(calibrated(convention="opengl").transform, POSE)
    np.testing.assert_array_equal(calibrated().transform, POSE * (1, -1, -1, 1))
    camera = calibrated()
    camera.pose("opengl")[0, 3] = 9
    assert camera.transform[0, 3] == 2, "a copy"


def test_a_plain_camera_has_its_axis_between_the_middle_pixels():
    matrix = Camera.look_at((0, 0, 1), (0, 0, 0), vertical_fov=np.pi / 2).intrinsics((6, 4))
    np.testing.assert_allclose(matrix, [[2, 0, 2.5], [0, 2, 1.5], [0, 0, 1]], atol=1e-12)
    camera = Camera.from_intrinsics(2, 2, 2.5, 1.5, (6, 4), np.eye(4), convention="opengl")
    assert camera.principal_point == (0.5, 0.5) and camera.pixel_aspect == 1
    assert camera.vertical_fov == pytest.approx(np.pi / 2)


def test_a_larger_picture_has_larger_numbers():
    """The principal point is between pixels, so that twice the size is not twice cx."""
    twice = calibrated().intrinsics((192, 128))
    np.testing.assert_allclose(twice, [[180, 0, 42.5], [0, 140, 98.5], [0, 0, 1]])


def test_lenses_that_stay_with_a_camera_of_a_node():
    camera = replace(calibrated(), transform=np.eye(4))
    np.testing.assert_allclose(camera.intrinsics(SIZE), calibrated().intrinsics(SIZE))


@pytest.mark.parametrize(
    ("given", "fault"),
    [
        ({"fx": 0}, "camera '': fx: 0.0 is not above 0"),
        ({"fy": np.nan}, "camera '': fy: nan is not finite"),
        ({"cx": "a"}, "camera '': cx: 'a' is not a number"),
        ({"size": (96, 0)}, "camera '': size: 0 is not from 1 to 16384"),
        ({"size": (96.5, 64)}, "camera '': size: 96.5 is not a whole number"),
        ({"size": 96}, "camera '': size: 96 is not several values"),
        ({"convention": "colmap"}, "camera '': convention: 'colmap' is not one of opencv, opengl"),
        ({"pose": np.eye(3)}, "camera '': pose: has the shape (3, 3), not (4, 4)"),
        (
            {"pose": 2 * np.eye(4), "name": "a"},
            "camera 'a': pose: its last row is [0.0, 0.0, 0.0, 2.0], not 0, 0, 0, 1",
        ),
    ],
)
def test_faults_in_words(given, fault):
    with pytest.raises(SceneError) as caught:
        calibrated(**given)
    assert str(caught.value) == fault


def test_what_has_no_such_numbers():
    with pytest.raises(SceneError, match=r"^camera: intrinsics: an orthographic camera has none$"):
        orthographic((0, 0, 1), (0, 0, 0), 2.0).intrinsics(SIZE)
    for call in (lambda: calibrated().pose("gl"), lambda: calibrated().intrinsics((0, 1))):
        with pytest.raises(SceneError, match=r"^camera: (convention|size): "):
            call()

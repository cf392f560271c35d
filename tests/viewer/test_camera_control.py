"""Cameras moved by hand."""

from dataclasses import replace

import numpy as np
import pytest

import pica
from pica.scene.camera import Camera
from pica.scenes.basic_meshes import box
from pica.scenes.placing import move
from pica.viewer.camera_control import CameraControl
from tests.building import lambert, orthographic, placed, projected, scene_of

SIZE = (160, 90)


@pytest.fixture
def control() -> CameraControl:
    scene = scene_of(placed(box(1.0, lambert()), move(0, 0.5, 0)))
    made = CameraControl(scene, 16 / 9, Camera.look_at((0, 1, 5), (0, 1, 0)))
    made.pivot = np.array([0.0, 1.0, 0.0])
    return made


def eye(control: CameraControl) -> np.ndarray:
    return control.camera.transform[:3, 3]


def at(control: CameraControl, point) -> np.ndarray:
    return projected(control.camera, [point], SIZE)[0]


def test_an_orbit_keeps_the_distance_and_the_pivot_in_the_middle(control):
    control.orbit(np.pi / 2, 0)
    np.testing.assert_allclose(eye(control), (5, 1, 0), atol=1e-9)
    control.orbit(0, np.pi / 6)
    np.testing.assert_allclose(eye(control), (5 * np.cos(np.pi / 6), 3.5, 0), atol=1e-9)
    np.testing.assert_allclose(at(control, control.pivot), (80, 45), atol=1e-6)


def test_an_orbit_stops_before_the_pole_and_stays_upright(control):
    for _ in range(10):
        control.orbit(0, 0.5)
    assert 5.9 < eye(control)[1] < 6 and control.camera.transform[1, 1] > 0
    assert control.distance == pytest.approx(5)


def test_a_pan_moves_the_picture_by_a_share_of_its_height(control):
    before = at(control, control.pivot)
    point = control.pivot
    control.pan(0.5, 0.25)
    np.testing.assert_allclose(at(control, point) - before, (-45, 22.5), atol=1e-6)
    np.testing.assert_allclose(at(control, control.pivot), before, atol=1e-6)


def test_a_dolly_changes_the_distance_alone(control):
    control.dolly(0.5)
    np.testing.assert_allclose(eye(control), (0, 1, 2.5))
    np.testing.assert_allclose(control.pivot, (0, 1, 0))


def test_an_orthographic_camera_dollies_by_its_height(control):
    control.take(orthographic((0, 1, 5), (0, 1, 0), 4.0))
    before = eye(control)
    control.dolly(0.5)
    assert control.camera.orthographic_height == 2.0
    np.testing.assert_array_equal(eye(control), before)


def test_flight_is_along_the_cameras_axes(control):
    control.orbit(np.pi / 2, 0)  # it looks along -X now
    control.fly(1, 2, 3)
    np.testing.assert_allclose(eye(control), (2, 3, -1), atol=1e-9)
    np.testing.assert_allclose(control.pivot, (-3, 3, -1), atol=1e-9)


def test_focus_brings_a_point_to_the_middle_and_closer(control):
    control.focus((1, 0.5, 1))
    np.testing.assert_allclose(at(control, (1, 0.5, 1)), (80, 45), atol=1e-6)
    assert control.distance == pytest.approx(np.linalg.norm(np.array((0, 1, 5)) - (1, 0.5, 1)) / 2)


def test_frame_all_shows_every_corner_and_home_goes_back(control):
    first = control.camera
    control.fly(30, 0, 0)
    control.frame_all()
    corners = [(x, y, z) for x in (-0.5, 0.5) for y in (0, 1) for z in (-0.5, 0.5)]
    places = projected(control.camera, corners, SIZE)
    assert (places > 0).all() and (places < SIZE).all()
    np.testing.assert_allclose(control.pivot, (0, 0.5, 0), atol=1e-6)
    control.home()
    assert control.camera is first


def test_a_pose_from_outside_keeps_the_rest_of_the_lens(control):
    control.take(replace(control.camera, near=0.5, principal_point=(0.25, 0.5)))
    pose = Camera.look_at((3, 2, 1), (0, 0, 0)).transform
    control.place(pose, 0.7, (0, 0, 0))
    assert (control.camera.near, control.camera.principal_point, control.camera.vertical_fov) == (0.5, (0.25, 0.5), 0.7)
    placed_once = control.camera
    control.place(pose.copy(), 0.7, (1, 0, 0))
    assert control.camera is placed_once, "the same pose is no change"
    with pytest.raises(pica.SceneError):
        control.place(np.full((4, 4), np.nan), 0.7, (0, 0, 0))

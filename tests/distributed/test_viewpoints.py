import numpy as np
import pytest

import pica
from pica.distributed.viewpoints import Moment, read_cameras, viewpoints
from pica.errors import PicaError
from pica.scene.orbit import pivot
from tests.building import CAMERA, still_life

SIZE = 64, 36
HEADER = "eye_x,eye_y,eye_z,target_x,target_y,target_z"


def test_an_orbit_goes_round_once():
    scene = still_life()
    orbit = viewpoints("orbit", scene, SIZE, 4, seed=1, first=CAMERA)
    center = pivot(scene, CAMERA)
    eyes = np.array([orbit.at(number).now.camera.transform[:3, 3] for number in range(4)])
    np.testing.assert_allclose(eyes[0], CAMERA.transform[:3, 3])
    np.testing.assert_allclose(eyes[0] + eyes[2], eyes[1] + eyes[3])  # corners of a square
    np.testing.assert_allclose(np.linalg.norm(eyes - center, axis=1), np.linalg.norm(eyes[0] - center))
    np.testing.assert_allclose(orbit.at(2).before.camera.transform, orbit.at(1).now.camera.transform)
    assert len(np.unique(eyes.round(6), axis=0)) == 4


def test_random_places_depend_on_seed_and_number_alone():
    scene = still_life()
    first, again, other = (viewpoints("sphere", scene, SIZE, None, seed).at(7).now.camera for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.transform, again.transform)
    assert np.abs(first.transform - other.transform).max() > 0.01
    many = viewpoints("sphere", scene, SIZE, None, seed=1)
    center = pivot(scene, scene.default_camera(SIZE[0] / SIZE[1]))
    directions = np.array([many.at(number).now.camera.transform[:3, 3] - center for number in range(300)])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    assert directions[:, 1].min() > 0 and abs(directions[:, 1].mean() - 0.525) < 0.05  # uniform by area
    assert np.abs(directions[:, [0, 2]].mean(axis=0)).max() < 0.1


def test_animated_scenes_move_between_a_picture_and_the_one_before():
    scene = pica.scenes.machine_world(seed=1)
    for number in range(20):
        view = viewpoints("sphere", scene, SIZE, None, seed=3).at(number)
        assert view.now.time - view.before.time == pytest.approx(min(1 / 30, view.now.time))
    orbit = viewpoints("orbit", scene, SIZE, 10, seed=1)
    assert [orbit.at(number).now.time for number in (0, 5)] == [0, scene.animations[0].duration / 2]


def test_cameras_of_a_file(tmp_path):
    path = tmp_path / "cameras.csv"
    path.write_text(f"{HEADER}, fov, time\n0,1,3,0,0,0,60,0.5\n1, 1, 3, 0, 0, 0,,\n")
    first, second = read_cameras(path)
    np.testing.assert_allclose(first.camera.transform[:3, 3], (0, 1, 3))
    assert np.degrees(first.camera.vertical_fov) == pytest.approx(60) and first.time == 0.5
    assert np.degrees(second.camera.vertical_fov) == pytest.approx(45) and second.time == 0
    listed = viewpoints(path, still_life(), SIZE, 2, seed=1)
    assert listed.at(1).before == listed.at(0).now != listed.at(1).now


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("", r"line 1: no column eye_x"),
        (HEADER + "\n", r"has no cameras"),
        (HEADER + ",roll\n", r"line 1: unknown column 'roll'; there may be fov, time"),
        (HEADER + "\n0,1,3,0,0,zero\n", r"line 2: target_z: 'zero' is not a number"),
        (HEADER + "\n0,1,3,0,0\n", r"line 2: target_z: '' is not a number"),
        (HEADER + "\n0,1,3,0,0,0\n1,1,1,1,1,1\n", r"line 3: .*same point"),
        (HEADER + "\n0,1,nan,0,0,0\n", r"line 2"),
        (HEADER + ",fov\n0,1,3,0,0,0,200\n", r"line 2: fov: .*179"),
        (HEADER + "\n" + "x" * 200_000 + "\n", r"line"),
    ],
)
def test_faults_of_a_file_are_one_line(tmp_path, text, fault):
    path = tmp_path / "cameras.csv"
    path.write_text(text)
    with pytest.raises(PicaError, match=rf"cameras.csv: {fault}") as caught:
        read_cameras(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("cameras", "count", "fault"),
    [
        ("helix", 1, "'helix' is neither orbit nor sphere"),
        ([CAMERA], 2, "there are 1 cameras for 2 pictures"),
        ([CAMERA], None, "for pictures without end"),
        ([None], 1, "None is not a Camera"),
        ("orbit", None, "an orbit needs a count"),
    ],
)
def test_impossible_cameras(cameras, count, fault):
    with pytest.raises(PicaError, match=fault):
        viewpoints(cameras, still_life(), SIZE, count, seed=1)


def test_a_first_camera_is_for_orbits_and_spheres():
    with pytest.raises(PicaError, match="the cameras are given"):
        viewpoints([CAMERA], still_life(), SIZE, 1, seed=1, first=CAMERA)
    assert viewpoints([CAMERA], still_life(), SIZE, 1, seed=1).at(0).now == Moment(CAMERA, 0.0)

"""Recorded cameras are those of the film."""

import json

import numpy as np

import pica
from pica.cli.camera_path import read_camera_path
from pica.viewer.camera_control import CameraControl
from pica.viewer.camera_path import RecordedPath


def test_a_film_is_at_each_recorded_camera(tmp_path):
    control = CameraControl(pica.Scene(), 1.5, pica.Camera.look_at((0, 1, 4), (0, 0, 0), vertical_fov=0.6))
    path, placed = RecordedPath(), []
    for _ in range(3):
        control.orbit(0.4, 0.1)
        path.add(control)
        placed.append(control.camera)
    (tmp_path / "cameras.json").write_bytes(path.file())
    film = read_camera_path(tmp_path / "cameras.json")
    for number, camera in enumerate(placed):
        np.testing.assert_allclose(film.at(2.0 * number).transform, camera.transform, atol=1e-6)
        np.testing.assert_allclose(film.at(2.0 * number).vertical_fov, 0.6)
    path.clear()
    assert len(path) == 0 and json.loads(path.file()) == []

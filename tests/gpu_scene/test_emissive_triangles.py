"""How often each emissive triangle is chosen."""

import numpy as np
import pytest

import pica
from pica.gpu_scene.lights.emissive_triangles import EmissiveTriangles, emissive_table
from pica.gpu_scene.view import SceneView
from pica.scene.camera import Camera
from pica.scenes.basic_meshes import box, plane
from pica.scenes.placing import move
from tests.building import lambert, placed, scene_of

HERE = np.eye(4, dtype=np.float32)[None, :3]


def shares(*parts):
    rows, total = emissive_table(parts)
    chances = np.diff(rows["cumulative"].astype(np.float64), prepend=0)
    return {record: chances[rows["record"] == record] for record in np.unique(rows["record"])}, total


def test_half_of_the_choice_is_by_power_and_half_by_object():
    """A lamp beside the large signs of a city, whose far sides are hidden, has a quarter of it."""
    sign, lamp = EmissiveTriangles(), EmissiveTriangles()
    sign.add(0, np.array([3]), plane(100, 100, lambert(0, emission=(1, 1, 1))), HERE)
    lamp.add(0, np.array([7]), box((0.1, 0.1, 0.2), lambert(0, emission=(1, 1, 1))), HERE)
    chances, total = shares(sign, lamp)
    area = 2 * 0.1 * 0.1 + 4 * 0.1 * 0.2
    assert total == pytest.approx(np.pi * (1e4 + area))
    assert chances[7].sum() == pytest.approx(0.25 + area / 1e4 / 2, rel=1e-3)
    assert chances[3].sum() + chances[7].sum() == pytest.approx(1)
    assert chances[7].max() == pytest.approx(2 * chances[7].min(), rel=1e-2)  # by area


def test_removed_and_dark_triangles_are_never_chosen():
    table = EmissiveTriangles()
    table.add(0, np.array([0, 1]), plane(1, 1, lambert(0, emission=(1, 1, 1))), HERE.repeat(2, 0))
    table.add(1, np.array([2]), plane(1, 1, lambert(0, emission=(9, 9, 9))), HERE)
    table.remove(1)
    chances, _ = shares(table)
    np.testing.assert_allclose(np.concatenate([chances[0], chances[1]]), 0.25, atol=1e-6)
    assert chances.get(2, np.zeros(1)).sum() == 0


def test_each_view_knows_which_emissive_meshes_have_moved_since_its_frame_before(device):
    glowing = lambert(0, emission=(1, 1, 1))
    lamp, other = placed([box(1, lambert(0.5)), box(0.2, glowing)]), placed(box(1, glowing))
    scene = scene_of(placed(plane(4, 4, lambert(0.5))), lamp, other)
    views = [SceneView(device, scene, pica.Settings()) for _ in range(2)]

    def moving(view):
        with device.record() as recording:
            view.update(recording, Camera.look_at((0, 1, 5), (0, 0, 0)))
        return view.moving_emitters().tolist()

    assert [moving(view) for view in views] == [[], []]
    lamp.transform = move(1, 0, 0)
    glows = views[0].records_of(lamp)[1]
    assert [moving(view) for view in views] == [[glows], [glows]]
    lamp.transform = move(2, 0, 0)
    assert [moving(views[0]), moving(views[0]), moving(views[1])] == [[glows], [], [glows]]
    scene.remove(lamp)
    other.transform = move(0, 1, 0)
    assert moving(views[0]) == list(views[0].records_of(other))

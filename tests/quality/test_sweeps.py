"""What each sweep changes, and what it leaves."""

import numpy as np
import pytest

from pica.quality.sweeps import SWEEPS
from pica.scene.light import PointLight
from pica.scenes.basic_meshes import box, sphere
from pica.settings import Settings
from tests.building import lambert, placed, scene_of


def steps_of(name, scene):
    return SWEEPS[name](scene, (60, 40), Settings())


def test_sizes_keep_their_shape():
    sizes = [step.size for step in steps_of("size", scene_of(placed(sphere(1.0, lambert()))))]
    assert sizes == [(20, 13), (40, 27), (60, 40), (80, 53), (120, 80)]


def test_triangles_become_four_and_surfaces_stay():
    round_one, flat = sphere(1.0, lambert(), segments=8), box(2.0, lambert())
    scene = scene_of(placed(round_one), placed(flat))
    counts = []
    for step in steps_of("triangles", scene):
        counts.append(len(round_one.indices) + len(flat.indices))
        assert step.label == f"{counts[-1]:,}"
        corners = flat.positions[flat.indices]
        areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
        assert areas.sum() == pytest.approx(6 * 4.0, rel=1e-5)
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert (np.einsum("nk,nk->n", across, flat.normals[flat.indices[:, 0]]) > 0).all(), "they face outwards"
        np.testing.assert_allclose(np.linalg.norm(round_one.normals, axis=1), 1, atol=1e-5)
    assert [count // counts[0] for count in counts] == [1, 4, 16, 64]


def test_lights_share_their_power():
    scene = scene_of(placed(box(2.0, lambert())))
    for step in steps_of("lights", scene):
        lights = [node for node in scene.nodes() if isinstance(node.light, PointLight)]
        assert len(lights) == int(step.label)
        assert sum(node.light.intensity for node in lights) == pytest.approx(12.0 if lights else 0.0)
        assert all((np.abs(node.transform[:3, 3]) <= 1).all() for node in lights)


def test_rays_are_a_setting():
    steps = [step for step in steps_of("rays", scene_of(placed(box(2.0, lambert()))))]
    assert [step.settings.ambient_occlusion.rays for step in steps] == [1, 2, 4, 8, 16]

"""Pictures of calibrated cameras against K [R|t] in NumPy: an axis far off the middle, pixels that are not square."""

import math
from dataclasses import replace

import numpy as np
import pytest

import pica
from pica.scene.camera import Camera
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import aim, move
from tests.building import lambert, placed, scene_of, settings, uniform

SIZE = (95, 63)
K = np.array([[88.0, 0, 20.0], [0, 66.0, 47.0], [0, 0, 1]])
POSE = np.eye(4)
POSE[:3, :3] = aim((0.4, 1.5, 3.4), (0.1, 0.4, 0))[:3, :3] @ np.diag([1, -1, -1])
POSE[:3, 3] = 0.4, 1.5, 3.4
PLACES = [(12.0, 9.0, 3.0), (70.0, 15.0, 4.0), (40.0, 50.0, 2.5)]
"""Columns, rows and metres along the axis."""
WAYS = pytest.mark.parametrize("way", ["raster", "rays"])


def calibrated(pose=POSE, matrix=K) -> Camera:
    return Camera.from_intrinsics(matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], SIZE, pose)


def world_points(pixels, pose=POSE):
    """(n, 3) points from (n, 3) columns, rows and metres along the axis."""
    pixels = np.asarray(pixels, float)
    local = np.column_stack([pixels[:, :2], np.ones(len(pixels))]) @ np.linalg.inv(K).T * pixels[:, 2:]
    return local @ pose[:3, :3].T + pose[:3, 3]


def seen_at(points, pose=POSE):
    """(n, 3) columns, rows and metres along the axis: OpenCV's pinhole model."""
    world_to_camera = np.linalg.inv(pose)
    local = points @ world_to_camera[:3, :3].T + world_to_camera[:3, 3]
    homogeneous = local @ K.T
    return np.column_stack([homogeneous[:, :2] / homogeneous[:, 2:], local[:, 2]])


def balls():
    """Small ones, of red, green and blue light, at PLACES."""
    nodes = []
    for point, light, (_, _, away) in zip(world_points(PLACES), np.eye(3), PLACES, strict=True):
        glowing = lambert(0.0, emission=tuple(light))
        nodes.append(placed(sphere(2.5 * away / 66, glowing, 64), move(*point)))
    return scene_of(*nodes)


def middle(weights):
    """Column and row of the mean of a picture."""
    rows, columns = np.indices(weights.shape)
    return np.array([(columns * weights).sum(), (rows * weights).sum()]) / weights.sum()


@WAYS
def test_points_are_where_opencv_has_them(device, way):
    chosen = settings({"visibility.primary": way})
    frame = pica.Renderer(balls(), size=SIZE, settings=chosen, device=device).render(1, camera=calibrated())
    for number, (column, row, away) in enumerate(PLACES, 1):
        found = middle(frame.aov("instance") == number)
        assert np.abs(found - (column, row)).max() < 0.5, (found, column, row)
        depth = frame.aov("depth")[round(row), round(column)]
        assert depth == pytest.approx(away - 2.5 * away / 66, rel=0.01)


def test_points_in_the_path_tracer_too(device):
    """Its pixels have the share of their area that a ball covers, so that its middle is a tenth of a pixel sharp."""
    tracer = pica.PathTracer(balls(), size=SIZE, max_depth=1, settings=settings(), device=device)
    color = tracer.render(64, camera=calibrated()).color
    for channel, (column, row, _) in enumerate(PLACES):
        assert np.abs(middle(color[..., channel]) - (column, row)).max() < 0.15


def test_both_ways_to_primary_visibility_see_the_same(device):
    scene = scene_of(placed(plane(9, 9, lambert())), placed(box(1, lambert(0.9)), move(0, 0.5, 0)))
    raster, rays = (
        pica.Renderer(scene, size=SIZE, settings=settings({"visibility.primary": way}), device=device).render(
            1, camera=calibrated()
        )
        for way in ("raster", "rays")
    )
    same = raster.aov("instance") == rays.aov("instance")
    assert same.mean() > 0.998 and (raster.aov("instance") > 0).mean() > 0.3
    np.testing.assert_allclose(raster.aov("depth")[same], rays.aov("depth")[same], rtol=1e-4)
    np.testing.assert_allclose(raster.aov("normal")[same], rays.aov("normal")[same], atol=1e-3)


@WAYS
def test_motion_with_an_axis_off_the_middle(device, way):
    scene = scene_of(placed(plane(9, 9, lambert())), placed(box(1, lambert(0.9)), move(0, 0.5, 0)))
    before = POSE.copy()
    before[:3, 3] += 0.1, -0.05, 0.15
    chosen = settings({"visibility.primary": way})
    with pica.Renderer(scene, size=SIZE, settings=chosen, device=device) as renderer:
        renderer.render(1, camera=calibrated(before))
        frame = renderer.render(1, camera=calibrated())
    rows, columns = np.indices(SIZE[::-1])
    seen = frame.aov("instance") > 0
    pixels = np.column_stack([columns[seen], rows[seen], frame.aov("depth")[seen]])
    was = seen_at(world_points(pixels), before)
    error = np.abs(frame.aov("motion")[seen] - (was - pixels)[:, :2])
    assert np.abs(was - pixels)[:, :2].max() > 2
    assert np.quantile(error, 0.95) < 0.1, np.quantile(error, 0.95)


@pytest.mark.parametrize("kind", ["hybrid", "raster", "path traced"])
def test_effects_are_those_of_a_wider_picture(device, kind):
    """A camera with its axis off the middle shows a cut-out of a larger picture, in its lighting too."""
    scene = scene_of(
        placed(plane(9, 9, lambert())),
        placed(box(1, lambert(0.9, 0.3, 0.2)), move(0, 0.5, 0)),
        environment=uniform(1.0, 1.1, 1.3),
    )
    whole = Camera.look_at((0.4, 1.5, 3.4), (0.1, 0.4, 0), vertical_fov=math.radians(50))
    matrix = whole.intrinsics((96, 64))
    part = Camera.from_intrinsics(
        matrix[0, 0], matrix[1, 1], matrix[0, 2] - 32, matrix[1, 2] - 16, (63, 39), whole.pose("opencv")
    )
    chosen = pica.Settings.preset("raster" if kind == "raster" else "quality")
    make = pica.PathTracer if kind == "path traced" else pica.Renderer
    with make(scene, size=(96, 64), settings=chosen, device=device) as renderer:
        expected = renderer.render(12, camera=whole).color[16:55, 32:95]
    with make(scene, size=(63, 39), settings=chosen, device=device) as renderer:
        found = renderer.render(12, camera=part).color
    assert found.mean() == pytest.approx(expected.mean(), rel=0.02)
    noise = 0.08 if kind == "path traced" else 0.04
    assert np.abs(found - expected).mean() < noise * expected.mean()


def test_another_lens_is_another_view():
    from pica.frame.context import same_view

    camera = calibrated()
    for change in ({"principal_point": (0.5, 0.4)}, {"pixel_aspect": 1.1}):
        assert not same_view(camera, replace(camera, **change))

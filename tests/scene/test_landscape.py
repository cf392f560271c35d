"""Levels of detail of a landscape: triangles, borders and which patches change."""

import itertools
import math

import numpy as np
import pytest

import pica
from pica.errors import SceneError
from pica.scene.landscape import Landscape, patch_triangles
from pica.scenes.foliage import scatter
from pica.scenes.terrain import fractal_heights
from tests.building import lambert


def hills(samples=33, **more):
    heights = fractal_heights(samples, 8, 2.0, seed=3)
    return Landscape(heights, 1.0, lambert(), **{"patch": 8, "levels": 4, "full_detail": 4.0, **more})


@pytest.mark.parametrize("quads", [1, 2, 4, 8])
def test_stitched_patches_cover_their_square_once(quads):
    steps = [1, 2, 4, 8]
    for edges in itertools.product([s for s in steps if s <= quads], repeat=4):
        triangles = patch_triangles(quads, edges)
        side = quads + 1
        a, b, c = np.stack([triangles % side, triangles // side], -1).transpose(1, 0, 2).astype(float)
        u, v = c - a, b - a
        area = (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / 2  # rows go down: counter-clockwise from above is clockwise
        assert area.min() > 0 and area.sum() == pytest.approx(quads * quads), edges


def borders(landscape, levels):
    """Edges of all shown triangles that only one triangle has, as sets of two places."""
    seen = {}
    for node in landscape.node.children:
        (section,) = landscape.mesh(node, levels).sections
        for triangle in section.indices:
            corners = [section.positions[corner].tobytes() for corner in triangle]
            for i in range(3):
                edge = frozenset((corners[i], corners[(i + 1) % 3]))
                seen[edge] = seen.get(edge, 0) + 1
    return [edge for edge, count in seen.items() if count == 1], max(seen.values())


@pytest.mark.parametrize("eye", [(0, 3, 0), (-14, 2, 9), (40, 5, 3)])
def test_patches_of_different_levels_share_their_borders_to_the_bit(eye):
    landscape = hills()
    levels = landscape.levels_for(pica.Camera.look_at(eye, (0, -50, 1)))
    assert eye[0] == 40 or len(np.unique(levels.levels)) > 1
    single, most = borders(landscape, levels)
    assert most == 2
    for edge in single:
        x, _, z = np.array([np.frombuffer(corner, np.float32) for corner in edge]).T
        assert (np.abs(x) == 16).all() or (np.abs(z) == 16).all(), "only the outer border is open"


def test_a_mesh_is_shared_while_somebody_holds_it():
    landscape = hills()
    near, far = (landscape.levels_for(pica.Camera.look_at(eye, (0, -50, 1))) for eye in ((-14, 2, 9), (-14, 200, 9)))
    node = landscape.node.children[8]
    held = landscape.mesh(node, near)
    assert landscape.mesh(node, near) is held and landscape.mesh(node, far) is not held
    assert landscape.mesh(node, far) is node.mesh, "the coarsest, which the node has itself"
    assert landscape.differing(near, near) == [] and node in landscape.differing(near, far)


def test_levels_follow_the_distance_in_doublings():
    landscape = hills(full_detail=4.0)
    for z, x in np.ndindex(4, 4):
        low, high = landscape._boxes[0][z, x], landscape._boxes[1][z, x]
        above = (low + high) / 2
        for distance, level in ((0.0, 0), (3.9, 0), (4.1, 1), (7.9, 1), (8.1, 2), (16.1, 3), (200.0, 3)):
            above[1] = high[1] + distance
            assert landscape.levels_from(above)[z, x] == level


def test_a_moved_landscape_takes_levels_by_where_it_is():
    landscape = hills()
    landscape.node.transform = np.array([[1, 0, 0, 100], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    assert landscape.levels_for(pica.Camera.look_at((100, 3, 0), (100, 0, 1))).levels.min() == 0


def test_heights_lie_on_the_surface():
    landscape = hills()
    surface = landscape.surface()
    places = scatter(surface, 200, seed=2, steepest=math.radians(89), sizes=(1, 1))
    x, y, z = places[:, :3, 3].T
    np.testing.assert_allclose(landscape.height_at(x, z), y, atol=1e-5)


def test_scattering_is_even_and_knows_what_is_steep():
    heights = np.zeros((9, 9))
    heights[:, :4] = 8 * np.arange(4, 0, -1)  # a cliff on one side
    surface = Landscape(heights, 1.0, lambert(), patch=8, levels=1).surface()
    places = scatter(surface, 4000, seed=1)
    assert (places[:, 0, 3] > -0.01).all()
    counts, _, _ = np.histogram2d(places[:, 0, 3], places[:, 2, 3], bins=(2, 4), range=((0, 4), (-4, 4)))
    assert counts.min() > 420 and counts.max() < 580
    np.testing.assert_array_equal(places, scatter(surface, 4000, seed=1))
    with pytest.raises(SceneError, match="steep"):
        scatter(Landscape(np.outer(np.arange(9), np.full(9, 4.0)), 1.0, lambert(), patch=8, levels=1).surface(), 10)


@pytest.mark.parametrize(
    ("heights", "more", "fault"),
    [
        (np.zeros((10, 9)), {}, "patches of 8"),
        (np.zeros((9, 9)), {"levels": 5}, "halve"),
        (np.full((9, 9), np.nan), {}, "finite"),
        (np.zeros(9), {}, "rows, columns"),
    ],
)
def test_bad_landscapes_are_refused(heights, more, fault):
    with pytest.raises(SceneError, match=fault):
        Landscape(heights, 1.0, lambert(), **{"patch": 8, **more})

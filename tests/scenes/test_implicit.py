"""Implicit surfaces: on their zeros, closed, and cut without gaps."""

import numpy as np
import pytest

from pica.scenes.implicit import intersection, surface, union


def ball(p):
    return np.linalg.norm(p, axis=1) - 0.5


@pytest.fixture(scope="module")
def shell():
    return surface(ball, (-0.6,) * 3, (0.6,) * 3, 0.05)


def area_vectors(shell):
    a, b, c = np.moveaxis(shell.positions[shell.indices], 1, 0)
    return np.cross(b - a, c - a) / 2


def test_a_ball(shell):
    np.testing.assert_allclose(np.linalg.norm(shell.positions, axis=1), 0.5, atol=1e-9)
    np.testing.assert_allclose(shell.normals(), shell.positions / 0.5, atol=1e-6)
    middles = shell.positions[shell.indices].mean(1)
    assert (np.sum(area_vectors(shell) * middles, 1) > 0).all()  # they face outwards
    assert np.linalg.norm(area_vectors(shell), axis=1).sum() == pytest.approx(4 * np.pi * 0.25, rel=0.01)
    edges = np.sort(shell.indices[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()  # it is closed


def test_parts_end_at_the_border_and_make_the_whole(shell):
    def border(p):
        return p[:, 1] - 0.123

    below, above = shell.split(border)
    assert below.positions[:, 1].max() < 0.124
    assert above.positions[:, 1].min() > 0.122
    assert np.linalg.norm(above.positions, axis=1) == pytest.approx(0.5, abs=1e-6)
    areas = [np.linalg.norm(area_vectors(part), axis=1).sum() for part in (below, above)]
    assert areas[1] / sum(areas) == pytest.approx((0.5 - 0.123) / 1.0, rel=0.01)  # Archimedes
    for part in (below, above):
        assert (np.sum(area_vectors(part) * part.positions[part.indices].mean(1), 1) >= 0).all()


def test_fillets_add_at_unions_and_take_away_at_intersections():
    a, b = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])
    np.testing.assert_allclose(union(a, b, 0.2), [-0.05, 0, 0])
    np.testing.assert_allclose(intersection(a, b, 0.2), [0.05, 1, 1])

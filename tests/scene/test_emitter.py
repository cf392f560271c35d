"""Particles and where they come from."""

import numpy as np
import pytest

from pica.errors import SceneError
from pica.scene.emitter import Emitter
from pica.scene.model import Mesh, Node
from pica.scene.particles import Particles, Ribbons, Sprites
from pica.scenes.basic_meshes import box
from tests.building import lambert, scene_of

FOUNTAIN = Emitter(50, 2.0, velocity=(0.5, 3, 0), acceleration=(0, -9.81, 0), spread=0.4, seed=3)


def test_a_moment_looks_the_same_whenever_it_is_asked_for():
    first = FOUNTAIN.at(7.3)
    FOUNTAIN.at(1.0)
    again = FOUNTAIN.at(7.3)
    for name in ("positions", "sizes", "colors", "rotations", "ages", "identities"):
        np.testing.assert_array_equal(getattr(first, name), getattr(again, name))
    other = Emitter(50, 2.0, velocity=(0.5, 3, 0), acceleration=(0, -9.81, 0), spread=0.4, seed=4).at(7.3)
    assert np.abs(other.positions - first.positions).max() > 0.01


def test_particles_fly_freely_and_keep_their_rows_for_life():
    step = 0.01
    before, now, after = (FOUNTAIN.at(5.0 + d) for d in (-step, 0, step))
    same = (before.identities == now.identities) & (now.identities == after.identities)
    assert same.sum() > 45
    second = (before.positions + after.positions - 2 * now.positions)[same] / step**2
    np.testing.assert_allclose(second, np.tile((0, -9.81, 0), (same.sum(), 1)), atol=1e-6)
    assert (np.abs(after.positions - now.positions)[same].max(1) < 0.3).all()
    reborn = FOUNTAIN.at(7.0)
    assert (reborn.identities - now.identities == 50).all() and (now.ages >= 0).all() and (now.ages <= 1).all()


def test_an_emitter_that_moves_leaves_a_trail():
    moving = Emitter(20, 1.0, origin=lambda t: np.stack([t, 0 * t, 0 * t], -1), velocity=(0, 0, 0), spread=0.0)
    particles = moving.at(3.0)
    np.testing.assert_allclose(particles.positions[:, 0], 3.0 - particles.ages, atol=1e-12)
    strands, _ = Emitter(8, 1.0, velocity=(0, 1, 0), spread=0.0).trails(3.0, 5, 0.4)
    assert (np.diff(strands[:, :, 1], axis=1) <= 1e-12).all() and strands[:, :, 1].min() >= 0


def test_transforms_turn_about_the_axis_and_scale():
    matrix = Particles(np.array([[1.0, 2, 3]]), sizes=[2.0], rotations=[np.pi / 2]).transforms()[0]
    np.testing.assert_allclose(matrix @ (1, 0, 0, 1), (1, 2, 1, 1), atol=1e-12)
    flat = Particles(np.zeros((1, 3)), sizes=[0.0]).transforms()[0]
    assert np.linalg.det(flat) > 0


def test_placing_tells_listeners_what_moved_and_what_came():
    node = Node("bits", mesh=Mesh([box(1, lambert())]))
    scene = scene_of(node)
    changes = scene.subscribe()
    FOUNTAIN.at(0.0).place(node)
    first = changes.take()
    assert first.added == [node] and first.removed == [node]
    FOUNTAIN.at(0.1).place(node)
    second = changes.take()
    assert second.moved == [node] and not second.added


@pytest.mark.parametrize(
    "make",
    [
        lambda: Particles(np.zeros((3, 2))),
        lambda: Particles(np.zeros((3, 3)), sizes=np.ones(2)),
        lambda: Particles(np.zeros((3, 3)), sizes=np.ones((3, 3))),
        lambda: Particles(np.zeros((3, 3)), colors=np.ones((3, 3))),
        lambda: Particles(np.zeros((3, 3)), identities=np.arange(2)),
        lambda: setattr(Sprites(2, lambert()), "particles", Particles(np.zeros((3, 3)))),
        lambda: Sprites(0, lambert()),
        lambda: Ribbons(1, 1, lambert()),
        lambda: Ribbons(1, 4, lambert()).set(np.zeros((2, 4, 3)), 1.0),
        lambda: Emitter(0, 1.0),
    ],
)
def test_what_does_not_fit_is_refused(make):
    with pytest.raises(SceneError, match=r"particles|sprites|ribbons|emitter"):
        make()

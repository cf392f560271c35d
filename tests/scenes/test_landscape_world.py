"""The built-in scene of hills, plants, a dragon and a fire."""

import numpy as np
import pytest

import pica
from pica.errors import SceneError
from pica.scene.landscape import Landscape
from pica.scene.particles import Sprites
from pica.scene.spline import Spline


def state(scene):
    """Everything that changes with time."""
    found = []
    for node in scene.nodes():
        found.append(node.world)
        if node.instances is not None:
            found.append(node.instances)
        if isinstance(node.deformer, Spline):
            found.append(node.deformer.rows)
        if isinstance(node.deformer, Sprites):
            found += [node.deformer.particles.positions, node.deformer.particles.colors]
    return found


def test_a_moment_of_the_landscape_depends_on_time_and_seed_alone():
    first, second, other = (pica.scenes.landscape(seed, plants=60) for seed in (2, 2, 3))
    first.animate(9.0)
    for scene in (first, second, other):
        scene.animate(3.4)
    for a, b in zip(state(first), state(second), strict=True):
        np.testing.assert_array_equal(a, b)
    assert any(not np.array_equal(a, b) for a, b in zip(state(first), state(other), strict=True))


def test_animations_can_be_played_alone():
    scene = pica.scenes.landscape(plants=0)
    assert [animation.name for animation in scene.animations] == ["dragon", "fire", "meteor"]
    changes = scene.subscribe()
    scene.animate(1.0, "dragon")
    assert {node.name for node in changes.take().deformed} == {"dragon", "streamers"}
    scene.animate(1.0, "fire")
    told = changes.take()
    assert {node.name for node in told.deformed} == {"smoke"} and {node.name for node in told.moved} == {"sparks"}


def test_plants_stand_on_the_ground_and_off_the_fire():
    scene = pica.scenes.landscape(seed=4, plants=900)
    (ground,) = {node.detail for node in scene.nodes() if isinstance(node.detail, Landscape)}
    plants = [node for node in scene.nodes() if node.name in ("shrubs", "tall shrubs", "grass")]
    assert sum(len(node.instances) for node in plants) == 900
    for node in plants:
        x, y, z = node.instances[:, :3, 3].T
        np.testing.assert_allclose(ground.height_at(x, z), y, atol=1e-4)
        assert np.hypot(x + 2.2, z + 2.0).min() > 1.2


def test_a_number_of_plants_out_of_range_is_refused():
    with pytest.raises(SceneError, match="0 to 20000"):
        pica.scenes.landscape(plants=-1)

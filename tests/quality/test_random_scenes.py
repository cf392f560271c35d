"""Scenes made at random, for the benchmark of that name."""

import numpy as np

from benchmarks.random_scene import OPAQUE, TEXTURED, TRANSPARENT, random_scene


def test_a_seed_is_a_scene():
    first, again, other = (list(random_scene(seed, glass=True).nodes()) for seed in (5, 5, 6))
    assert [node.name for node in first] == [node.name for node in again] != [node.name for node in other]
    for node, same in zip(first, again, strict=True):
        np.testing.assert_array_equal(node.transform, same.transform)


def test_all_kinds_of_places_lights_and_materials_come_up():
    scenes = [random_scene(seed, glass=True, textures=seed > 15) for seed in range(45)]
    names = {node.name for scene in scenes for node in scene.nodes()}
    assert {scene.name.split()[0] for scene in scenes} == {"room", "hall", "court", "plain"}
    assert {"sun", "point", "spot", "sphere", "rectangle", "disk", "tube", "panel", "bulb"} <= names
    assert {*OPAQUE, *TEXTURED, *TRANSPARENT} <= {name.split()[-1] for name in names}


def test_glass_and_textures_are_in_those_that_ask():
    for seed in range(8):
        kinds = {node.name.split()[-1] for node in random_scene(seed).nodes()}
        assert not kinds & {*TRANSPARENT, *TEXTURED}

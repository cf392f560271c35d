"""What a user can set in Python is kept as something that can be shown, or refused."""

from dataclasses import fields

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

import pica
from pica.scene.environment import Environment
from pica.scene.light import DirectionalLight, DiskLight, PointLight, RectangleLight, SphereLight, SpotLight, TubeLight
from pica.scene.mesh import Mesh, Section
from pica.scene.model import Node, Scene
from pica.scene.particles import Particles
from tests.fuzz.mutations import NUMBERS, hostile
from tests.fuzz.outcome import held

kinds = st.sampled_from([*"?bhilqBHILQefdgFD", ">f8", ">i4", "<u2", "O", "U3", "M8[s]"])
shapes = arrays.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=5) | st.sampled_from([(3, 3), (4, 4), (3,)])
some_arrays = shapes.flatmap(lambda shape: kinds.map(lambda kind: np.zeros(shape, kind)))
floats = shapes.flatmap(lambda shape: arrays.arrays(st.sampled_from(["f8", "f4", ">f4"]), shape))
lists = st.lists(hostile, max_size=4) | st.lists(st.lists(st.sampled_from(NUMBERS), max_size=3), max_size=4)
anything = hostile | some_arrays | floats | lists | st.just(object())

NEEDED = {
    Section: {"positions": np.zeros((3, 3)), "normals": np.tile((0, 0, 1), (3, 1)), "indices": np.arange(3)},
    Mesh: {"sections": []},
    Environment: {"radiance": np.ones((2, 4, 3))},
    Particles: {"positions": np.zeros((2, 3))},
}
CLASSES = [pica.Material, DirectionalLight, PointLight, SpotLight, SphereLight, RectangleLight, DiskLight, TubeLight]
CLASSES += [Node, Mesh, Section, Environment, Particles, pica.Camera]


def made(kind, values):
    """Of names that the class does not have, the interpreter itself tells."""
    try:
        return kind(**NEEDED.get(kind, {}) | values)
    except TypeError as error:
        assert "unexpected keyword argument" in str(error) or "missing" in str(error), error
        return None


@given(st.sampled_from(CLASSES), st.data())
def test_what_is_made_or_set(kind, data):
    names = st.sampled_from([field.name for field in fields(kind) if field.init])
    with held():
        made(kind, data.draw(st.dictionaries(names, anything, max_size=2)))
    thing = None
    with held():
        thing = made(kind, {})
    if thing is not None:
        name = data.draw(names)
        with held():
            try:
                setattr(thing, name, data.draw(anything))
            except AttributeError:  # of what is frozen
                return


@given(anything, anything, anything)
def test_cameras_that_look_at(eye, target, fov):
    with held():
        camera = pica.Camera.look_at(eye, target, vertical_fov=fov)
        assert np.isfinite(camera.transform).all()


@given(anything, anything, st.sampled_from(["add", "remove"]))
def test_scenes_of_anything(first, second, call):
    scene = Scene("any")
    for thing in (first, second):
        with held():
            getattr(scene, call)(thing)
    with held():
        scene.animate(first, second)


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 3), st.booleans()), max_size=12))
def test_trees_stay_trees(steps):
    scene, nodes = Scene("tree"), [Node(str(i)) for i in range(4)]
    for parent, child, comes in steps:
        with held():
            nodes[parent].add(nodes[child])
        with held():
            (scene.add if comes else scene.remove)(nodes[child])
    assert len(set(scene.nodes())) == len(list(scene.nodes())) <= 4

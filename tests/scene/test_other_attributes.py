"""What is no field of an object of a scene is refused, when it is written and when the object is made."""

import copy
import pickle
from dataclasses import fields, replace

import numpy as np
import pytest

import pica
from pica.errors import SceneError
from pica.scene.deformer import Deformer
from pica.scene.material import Image, Material
from pica.scene.model import Mesh, Node, Scene
from tests.scene.test_wrong_values import OBJECTS, cloth, cube, kind_of

WRITTEN = {
    ("material", "rougness"): "material 'wood': no field 'rougness'; did you mean 'roughness'",
    ("node", "visible"): "node 'a': no field 'visible'; did you mean 'visible_to_camera' or 'visible_to_reflections'?",
    ("node", "translation"): "node 'a': no field 'translation'; did you mean 'transform'?",
    ("scene", "enviroment"): "scene 's': no field 'enviroment'; did you mean 'environment'?",
    ("mesh", "section"): "mesh 'm': no field 'section'; did you mean 'sections'?",
    ("section", "position"): "section: no field 'position'; did you mean 'positions'?",
    ("image", "pixel"): "image 'i': no field 'pixel'; did you mean 'pixels'?",
    ("image", "zzz"): "image 'i': no field 'zzz'; there are encoding, name, pixels",
    ("node", "children"): "node 'a': children: cannot be assigned",
    ("node", "add"): "node 'a': add: cannot be assigned",
    ("light", "intensity"): "point light: intensity: stays as it was made; make another: dataclasses.replace(...",
    ("light", "intesity"): "point light: no field 'intesity'; did you mean 'intensity'?",
    ("cloth", "postions"): "dynamic vertices: no field 'postions'; did you mean 'positions'?",
    ("cloth", "positions"): "dynamic vertices: positions: stays as it was made; make another one",
    ("sprites", "particels"): "sprites: no field 'particels'; did you mean 'particles'?",
    ("animation", "drivrs"): "animation 'go': no field 'drivrs'; did you mean 'drivers'?",
}


def objects():
    return {
        "material": Material("wood"),
        "node": Node("a"),
        "scene": Scene("s"),
        "mesh": Mesh([cube()], "m"),
        "section": cube(),
        "image": Image(np.zeros((2, 2, 4), np.uint8), "i"),
        "light": pica.PointLight(),
        "cloth": cloth(),
        "sprites": pica.Sprites(4, Material()),
        "animation": pica.Animation([], "go"),
    }


@pytest.mark.parametrize(("kind", "name"), WRITTEN)
def test_misspelt_attributes_are_refused(kind, name):
    with pytest.raises(SceneError) as caught:
        setattr(objects()[kind], name, 1)
    assert str(caught.value).startswith(WRITTEN[kind, name])


@pytest.mark.parametrize("made", [*OBJECTS, *objects().values()], ids=kind_of)
def test_no_object_of_a_scene_takes_other_attributes(made):
    with pytest.raises(SceneError, match="no field 'other_attribute'"):
        made.other_attribute = 1


@pytest.mark.parametrize("made", OBJECTS, ids=kind_of)
def test_no_object_of_a_scene_is_made_of_other_arguments(made):
    with pytest.raises(SceneError, match="no field 'other_argument'; there are "):
        replace(made, other_argument=1)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Material(rougness=0.2), "material: no field 'rougness'; did you mean 'roughness'"),
        (lambda: pica.DirectionalLight(intensity=3), "directional light: no field 'intensity'; there are "),
        (lambda: Node("a", meshes=None), "node: no field 'meshes'; did you mean 'mesh'?"),
    ],
)
def test_misspelt_arguments_are_named(make, says):
    with pytest.raises(SceneError) as caught:
        make()
    assert str(caught.value).startswith(says)


def test_calls_that_do_not_fit_are_python_s_to_refuse():
    for wrong in (lambda: Material("a", name="b"), lambda: Image(), lambda: Mesh((), "", (), 1)):
        with pytest.raises(TypeError, match=r"__init__\(\)"):
            wrong()


@pytest.mark.parametrize("made", [made for made in OBJECTS if not type(made).__dataclass_params__.frozen], ids=kind_of)
def test_objects_are_made_as_their_fields_say(made):
    """Defaults of its own for each, all fields there, and none twice."""
    for each in (copy.deepcopy(made), pickle.loads(pickle.dumps(made)), replace(made)):
        assert {each.name for each in fields(made)} <= set(vars(each))
    first, second = Node("a"), Node("b")
    first.extras["kind"] = "chair"
    first.add(Node("c"))
    assert second.extras == {} and second.children == ()


def test_subclasses_declare_what_they_add():
    class Robot(Node):
        speed: float

        def __init__(self, name: str) -> None:
            super().__init__(name)
            self.speed = 1.0
            self._count = 2

    robot = Robot("r2")
    assert (robot.name, robot.speed, robot._count) == ("r2", 1.0, 2)
    with pytest.raises(SceneError, match=r"robot 'r2': no field 'sped'; did you mean 'speed'\?"):
        robot.sped = 2


def test_deformers_of_one_s_own_have_what_they_made():
    class Wobble(Deformer):
        def __init__(self) -> None:
            self.strength = 1.0

        def deform(self, section):
            return section.positions, section.normals, section.tangents

    wobble = Wobble()
    node = Node("jelly", mesh=Mesh([cube()]))
    node.deformer = wobble
    with pytest.raises(SceneError, match="wobble: no field 'strenght'; did you mean 'strength'"):
        wobble.strenght = 2.0

"""Copies of a scene that arrays tell apart."""

from copy import deepcopy

import numpy as np
import pytest

import pica
from pica.errors import SceneError
from pica.scene.light import PointLight
from pica.scene.material import Texture
from pica.scene.model import Node
from pica.scenes.basic_meshes import box, sphere
from pica.scenes.placing import move
from tests.building import checkered, lambert, placed, scene_of, shining, uniform

VIEWS = 3
PLACES = np.stack([move(number, 0, 0) for number in range(VIEWS)])


@pytest.fixture
def scene():
    paint = lambert(name="paint", base_color_texture=Texture(checkered()))
    group = Node("group")
    group.add(placed(box(0.5, paint), name="cube"))
    group.add(placed(sphere(0.5, lambert(name="matt")), name="ball"))
    twins = placed(box(0.1, lambert(name="twin")), name="twin"), placed(box(0.1, lambert(name="twin")), name="twin")
    lamp = shining(PointLight(intensity=5.0))
    return scene_of(group, *twins, lamp, environment=uniform(0.3))


@pytest.fixture
def views(scene):
    return pica.SceneViews(scene, VIEWS)


def node(scene, name):
    return next(each for each in scene.nodes() if each.name == name)


def test_each_view_has_a_copy(scene, views):
    assert len(views) == VIEWS == len({id(each) for each in views}) and scene not in list(views)
    assert views[1] is list(views)[1] and len(views[1:]) == 2
    assert views.nodes("cube") == tuple(node(each, "cube") for each in views)
    assert [each.name for each in views.materials("paint")] == ["paint"] * VIEWS
    assert "3 copies of <pica.Scene 'test'" in repr(views)


def test_copies_share_vertices_images_and_the_environment(scene, views):
    first, last = (node(views[number], "cube").mesh.sections[0] for number in (0, 2))
    assert first.positions is last.positions and first.indices is node(scene, "cube").mesh.sections[0].indices
    assert first.material is not last.material
    assert first.material.base_color_texture.image is last.material.base_color_texture.image
    assert views[0].environment is views[1].environment


@pytest.mark.parametrize("by_name", [True, False])
def test_transforms(scene, views, by_name):
    views.set_transforms("group" if by_name else node(scene, "group"), PLACES)
    for number, cube in enumerate(views.nodes("cube")):
        np.testing.assert_array_equal(cube.world, PLACES[number])
    assert node(scene, "cube").world[0, 3] == 0


def test_rows_that_are_as_before_are_no_changes(views):
    views.set_transforms("cube", PLACES)
    views.set_material("paint", roughness=[0.1, 0.2, 0.3])
    views.set_light("light", intensity=[1, 2, 3])
    changes = [each.subscribe() for each in views]
    for each, material in zip(changes, views.materials("paint"), strict=True):
        material.follow(each)
    moved = PLACES.copy()
    moved[1, 0, 3] = 9
    views.set_transforms("cube", moved)
    views.set_material("paint", roughness=[0.1, 0.9, 0.3])
    views.set_light("light", intensity=[1, 9, 3])
    views.set_visible("cube", [True] * VIEWS)
    for number, each in enumerate(changes):
        taken = each.take()
        counts = len(taken.moved), len(taken.edited), len(taken.altered)
        assert counts == ((1, 1, 1) if number == 1 else (0, 0, 0))


def test_visibility_is_that_of_all_below(scene, views):
    node(scene, "ball").casts_shadows = False
    views.set_visible("group", np.array([True, False, True]))
    flags = [
        (each.visible_to_camera, each.visible_to_reflections, each.casts_shadows)
        for name in ("cube", "ball")
        for each in views.nodes(name)
    ]
    hidden = (False, False, False)
    assert flags == [(True,) * 3, hidden, (True,) * 3, (True, True, False), hidden, (True, True, False)]
    views.set_visible("group", [True] * VIEWS)
    assert all(each.visible_to_camera for each in views.nodes("ball"))


def test_materials(scene, views):
    colors = np.linspace(0, 1, 4 * VIEWS).reshape(VIEWS, 4)
    other = Texture(checkered(cells=2))
    views.set_material(
        "paint",
        base_color=colors,
        roughness=np.float32([0.25, 0.5, 0.75]),
        double_sided=np.array([True, False, True]),
        base_color_texture=[None, other, other],
        parameters=[{}] * VIEWS,
    )
    for number, material in enumerate(views.materials("paint")):
        assert material.base_color == tuple(colors[number]) and material.roughness == 0.25 * (number + 1)
        assert material.double_sided == (number != 1)
        assert material.base_color_texture is (other if number else None)
    assert node(scene, "cube").mesh.sections[0].material.base_color == lambert().base_color


def test_lights(scene, views):
    views.set_light("light", intensity=[10, 20, 30], color=np.eye(3))
    lights = [each.light for each in views.nodes("light")]
    assert [light.intensity for light in lights] == [10, 20, 30]
    assert [light.color for light in lights] == [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
    assert node(scene, "light").light.intensity == 5


def test_environments(scene, views):
    views.set_environment(strength=[1, 2, 3], rotation=np.float32([0, 1, 2]))
    assert [(each.environment.strength, each.environment.rotation) for each in views] == [(1, 0), (2, 1), (3, 2)]
    views.set_environment(radiance=[np.full((2, 4, 3), number, np.float32) for number in range(VIEWS)])
    assert [each.environment.radiance.max() for each in views] == [0, 1, 2]


def test_tensors_are_arrays():
    torch = pytest.importorskip("torch", reason="PyTorch is not installed")
    views = pica.SceneViews(scene_of(placed(box(0.5, lambert(name="paint")), name="cube")), VIEWS)
    views.set_transforms("cube", torch.tensor(PLACES, dtype=torch.float32, requires_grad=True))
    views.set_material("paint", base_color=torch.full((VIEWS, 4), 0.5, requires_grad=True), metallic=torch.ones(VIEWS))
    views.set_visible("cube", torch.tensor([True, False, True]))
    assert [each.world[0, 3] for each in views.nodes("cube")] == [0, 1, 2]
    assert views.materials("paint")[2].base_color == (0.5,) * 4 and views.materials("paint")[0].metallic == 1
    assert [each.visible_to_camera for each in views.nodes("cube")] == [True, False, True]


def test_a_copy_of_the_views_has_copies(views):
    twin = deepcopy(views)
    twin.set_transforms("cube", PLACES)
    assert twin.nodes("cube")[1].world[0, 3] == 1 and views.nodes("cube")[1].world[0, 3] == 0


ONES, MATRICES = np.ones(VIEWS), np.broadcast_to(np.eye(4), (VIEWS, 4, 4))
WRONG = [
    (lambda views: views.set_transforms("cubes", MATRICES), "no node has the name 'cubes'; did you mean 'cube'?"),
    (lambda views: views.set_transforms("twin", MATRICES), "2 nodes have the name 'twin'; give the node itself"),
    (lambda views: views.set_transforms(Node("cube"), MATRICES), "is not a node of the scene that was copied, nor a"),
    (lambda views: views.set_transforms(3, MATRICES), "scene views: 3 is not a node of the scene that was copied"),
    (lambda views: views.set_transforms("cube", MATRICES[:2]), "node 'cube': transforms: has 2 rows, not one for each"),
    (lambda views: views.set_transforms("cube", np.eye(4)), r"has the shape \(4, 4\), not \(count, 4, 4\)"),
    (lambda views: views.set_transforms("cube", MATRICES * [[[1], [1], [1], [2]]]), "its last row is"),
    (lambda views: views.set_transforms("cube", MATRICES * np.nan), "transforms: row 0 is not finite"),
    (lambda views: views.set_visible("cube", ONES), "visible: an array of float64 is not an array of True and False"),
    (lambda views: views.set_visible("cube", [True]), "visible: has 1 rows, not one for each of 3 views"),
    (lambda views: views.set_material("pain", metallic=ONES), "no material has the name 'pain'; did you mean 'paint'"),
    (lambda views: views.set_material("paint", metalic=ONES), "'paint': no field 'metalic'; did you mean 'metallic'"),
    (lambda views: views.set_material("paint", extras=[{}] * 3), "no field 'extras'"),
    (lambda views: views.set_material("paint", metallic=0.5), "metallic: 0.5: must be an array with a row for each"),
    (lambda views: views.set_material("paint", metallic="off"), "metallic: 'off' is not an array of values"),
    (lambda views: views.set_material("paint", metallic=ONES[:2]), "metallic: has 2 rows, not one for each of 3 views"),
    (lambda views: views.set_material("paint", metallic=[0, 1, 2]), "metallic: view 2: 2 is not from 0 to 1"),
    (lambda views: views.set_material("paint", base_color=np.ones((3, 3))), "base_color: view 0: .* is not 4 numbers"),
    (lambda views: views.set_light("cube", intensity=ONES), "node 'cube': view 0 has no light"),
    (lambda views: views.set_light("light", radiance=ONES), "point light: no field 'radiance'"),
    (lambda views: views.set_light("light", intensity=[1, 2, -3]), "view 2: point light: intensity: -3 is negative"),
    (lambda views: views.set_environment(strength=[1, 2]), "environment: strength: has 2 rows"),
    (lambda views: views.set_environment(strength=[1, 2, -3]), "view 2: environment: strength: -3 is negative"),
    (lambda views: pica.SceneViews(3, 3), "scene views: scene: 3 is not a Scene"),
    (lambda views: pica.SceneViews(views[0], 0), "scene views: views: 0 is not from 1 to 4096"),
]


@pytest.mark.parametrize(("call", "says"), WRONG)
def test_wrong_arguments_change_nothing(views, call, says):
    before = [(node(each, "cube").world, node(each, "light").light, each.environment) for each in views]
    colors = [each.base_color for each in views.materials("paint")]
    with pytest.raises(SceneError, match=says) as caught:
        call(views)
    assert "\n" not in str(caught.value)
    after = [(node(each, "cube").world, node(each, "light").light, each.environment) for each in views]
    assert all(a[0] is b[0] and a[1:] == b[1:] for a, b in zip(after, before, strict=True))
    assert colors == [each.base_color for each in views.materials("paint")]
    assert all(each.metallic == 0 for each in views.materials("paint"))


def test_a_scene_without_an_environment_or_too_deep():
    scene = scene_of(placed(box(0.5, lambert())))
    with pytest.raises(SceneError, match="view 0 has no environment"):
        pica.SceneViews(scene, 1).set_environment(strength=[1])
    below = scene.roots[0]
    for _ in range(2000):
        below = below.add(Node())
    with pytest.raises(SceneError, match="its nodes are nested too deeply"):
        pica.SceneViews(scene, 1)

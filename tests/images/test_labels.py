"""Names, masks and classes of what a picture shows."""

import pickle

import numpy as np
import pytest

import pica
from pica.errors import PicaError
from pica.scene.model import Node
from pica.scenes.basic_meshes import box, plane
from pica.scenes.placing import move, rotate
from tests.building import SIZE, lambert, orthographic, placed, scene_of, settings

CAMERA = orthographic((0, 0, 5), (0, 0, 0), 2.0)
"""Shows x from -1.5 to 1.5, y from -1 to 1."""


def crew():
    """Robots side by side, each an arm with a hand below it, before a wall; an unnamed box."""
    scene = scene_of(placed(plane(1, 2, lambert(0.5, name="plaster")), move(1, 0, -1) @ rotate("x", 90), "wall"))
    for index, x in enumerate((-1.2, -0.6)):
        robot = Node("robot", extras={"class": "robot", "serial": [index]})
        robot.transform = move(x, 0, 0)
        arm = robot.add(placed(box(0.3, lambert(0.6, name="steel")), name="arm"))
        arm.add(placed(box(0.2, lambert(0.7, name="rubber")), move(0, 0.5, 0), "hand"))
        scene.add(robot)
    scene.add(placed(box(0.2, lambert(0.8)), move(0.1, -0.7, 0)))
    return scene


@pytest.fixture(scope="module")
def scene():
    return crew()


@pytest.fixture(scope="module")
def renderer(device, scene):
    return pica.Renderer(scene, size=SIZE, settings=settings(), device=device)


@pytest.fixture(scope="module")
def frame(renderer):
    return renderer.render(frames=1, camera=CAMERA)


def nodes(scene, name):
    return [node for node in scene.nodes() if node.name == name]


def seen(x, y):
    """(row, column) of a place before the camera."""
    return int((1 - y) / 2 * SIZE[1]), int((x + 1.5) / 3 * SIZE[0])


@pytest.mark.device
def test_ids_name_what_pixels_show(frame):
    at = {"robot/arm": (-1.2, 0), "robot/arm/hand": (-0.6, 0.5), "wall": (1, 0), "#8": (0.1, -0.7)}
    for path, place in at.items():
        assert frame.ids[frame.aov("instance")[seen(*place)]].path == path
    label = frame.ids[frame.aov("instance")[seen(-0.6, 0.5)]]
    assert (label.name, label.mesh, label.materials) == ("hand", "hand", ("rubber",))
    assert label.parent.parent.extras == {"class": "robot", "serial": [1]}
    assert frame.material_ids[frame.aov("material")[seen(1, 0)]].name == "plaster"
    assert frame.aov("instance")[seen(0.3, 0.9)] == frame.aov("material")[seen(0.3, 0.9)] == 0
    assert 0 not in frame.ids and 0 not in frame.material_ids


@pytest.mark.device
def test_masks_take_in_what_is_below(frame, scene):
    instance = frame.aov("instance")
    arms = [number for number, label in frame.ids.items() if label.name == "arm"]
    hands = [number for number, label in frame.ids.items() if label.name == "hand"]
    for text in ("robot", "/robot", "arm", "robot/arm", "/robot/arm"):
        np.testing.assert_array_equal(frame.mask(text), np.isin(instance, arms + hands), text)
    for text in ("hand", "arm/hand", "robot/arm/hand"):
        np.testing.assert_array_equal(frame.mask(text), np.isin(instance, hands), text)
    second = nodes(scene, "robot")[1]
    own = np.isin(instance, [arms[1], hands[1]])
    np.testing.assert_array_equal(frame.mask(second), own)
    np.testing.assert_array_equal(frame.mask(frame.ids[arms[1]]), own)
    np.testing.assert_array_equal(frame.mask("#8"), instance == 8)
    assert frame.mask("hand").dtype == bool and frame.mask("hand").any()


@pytest.mark.device
@pytest.mark.parametrize(
    ("which", "says"),
    [
        ("robt/arn", r"no node 'robt/arn' in this frame; near: 'robot/arm'$"),
        ("robot/hand", r"near: 'robot/arm/hand'"),
        ("/arm", "near: 'robot/arm'"),
        ("zzz", "there are 'wall', 'robot', 'arm', 'hand', '#8'$"),
        ("", "there are 'wall'"),
        (Node("stranger"), "no node a Node in this frame; give a node that was in its scene"),
        (7, "no node 7 in this frame"),
    ],
)
def test_nodes_that_are_not_there(frame, which, says):
    with pytest.raises(PicaError, match=says) as caught:
        frame.mask(which)
    assert "\n" not in str(caught.value)


@pytest.mark.device
def test_classes_are_those_of_extras_or_of_a_function(frame):
    labels, names = frame.semantic("class")
    assert names == ("background", "robot") and labels.dtype == np.int32
    np.testing.assert_array_equal(labels, frame.mask("robot"))

    def kind(label):
        return {"hand": "tool", "wall": "building", "robot": "machine"}.get(label.name)

    labels, names = frame.semantic(kind)
    assert names == ("background", "building", "machine", "tool")
    for place, name in (((-1.2, 0), "machine"), ((-1.2, 0.5), "tool"), ((1, 0), "building")):
        assert names[labels[seen(*place)]] == name
    assert labels[seen(0.1, -0.7)] == 0, "it has no class"
    fixed = frame.semantic(kind, names=["tool", "chair", "machine", "building"])
    assert fixed.names[1:] == ("tool", "chair", "machine", "building")
    np.testing.assert_array_equal(np.array(fixed.names)[fixed.labels], np.array(names)[labels])
    np.testing.assert_array_equal(frame.semantic(kind, names=names).labels, labels)


@pytest.mark.device
def test_a_key_that_no_node_has_is_a_warning(frame):
    with pytest.warns(UserWarning) as caught:
        labels, names = frame.semantic("clas")
    keys = "the keys that nodes have are 'class', 'serial'"
    says = f"semantic: no node has 'clas' among its extras; {keys}; did you mean 'class'?"
    assert [str(each.message) for each in caught] == [says] and caught[0].filename == __file__
    assert names == ("background",) and not labels.any()


@pytest.mark.device
@pytest.mark.parametrize(
    ("classes", "names", "says"),
    [
        ("class", ["chair"], "names lack 'robot'"),
        ("class", "robot", "names: 'robot' is not a list"),
        ("class", ["robot", "robot"], "names: .* is not a list of different names"),
        ("serial", None, r"the class of node 'robot' is \[0\], not a name"),
    ],
)
def test_wrong_classes(frame, classes, names, says):
    with pytest.raises(PicaError, match=f"semantic: {says}"):
        frame.semantic(classes, names)


@pytest.mark.device
def test_later_changes_do_not_show(device):
    scene = crew()
    renderer = pica.Renderer(scene, size=SIZE, settings=settings(), device=device)
    frame = renderer.render(frames=1, camera=CAMERA)
    robot, other = nodes(scene, "robot")
    robot.extras["class"], robot.extras["serial"][0] = "spy", 7
    robot.name, robot.children[0].mesh.name = "hidden", "cover"
    steel = robot.children[0].mesh.sections[0].material
    steel.name = "gold"
    scene.remove(other)
    scene.add(placed(box(0.3, lambert(0.5, name="news")), name="newcomer"))
    later = renderer.render(frames=1, camera=CAMERA)
    assert [label.path for label in frame.ids.values() if label.mesh is None] == ["robot", "robot"]
    assert frame.semantic("class").names == ("background", "robot") and frame.ids[2].extras["serial"] == [0]
    assert {label.mesh for label in frame.ids.values()} == {"wall", "arm", "hand", "", None}
    assert {"steel", "rubber", "plaster"} <= {label.name for label in frame.material_ids.values()}
    assert frame.mask(other).any(), "it was there"
    with pytest.raises(PicaError, match="no node a Node"):
        later.mask(other)
    assert later.mask("newcomer").any() and later.ids[2].name == "hidden" and later.ids[3].mesh == "cover"


@pytest.mark.device
def test_a_pickled_frame_keeps_its_names(frame, scene):
    back = pickle.loads(pickle.dumps(frame))
    assert [(n.number, n.path, n.extras) for n in back.ids.values()] == [
        (n.number, n.path, n.extras) for n in frame.ids.values()
    ]
    np.testing.assert_array_equal(back.mask("arm/hand"), frame.mask("arm/hand"))
    assert back.material_ids == frame.material_ids
    with pytest.raises(PicaError, match="no node a Node"):
        back.mask(nodes(scene, "wall")[0])


@pytest.mark.device
def test_path_traced_frames_have_names_too(device, scene, frame):
    traced = pica.PathTracer(scene, size=SIZE, settings=settings(), device=device).render(samples=2, camera=CAMERA)
    np.testing.assert_array_equal(traced.mask("robot"), frame.mask("robot"))
    assert traced.semantic("class").names == ("background", "robot")


def test_deep_trees_are_named_in_time():
    from pica.images.labels import Labels

    deep = Labels([(n, f"n{n}", n - 1, None, (), {}, None) for n in range(1, 30_001)], [])
    assert len(deep.numbers("n5/n6")) == 29_995
    assert deep.nodes[30_000].path.endswith("n29999/n30000")
    back = pickle.loads(pickle.dumps(deep))
    assert len(back.numbers("n5/n6")) == 29_995


def test_names_may_hold_slashes():
    from pica.images.labels import Labels

    labels = Labels([(1, "a/b", 0, None, (), {}, None), (2, "c", 1, None, (), {}, None)], [])
    assert labels.numbers("a/b/c") == {2}
    assert labels.numbers("a/b") == {1, 2}

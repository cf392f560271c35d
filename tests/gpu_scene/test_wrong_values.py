"""What NumPy makes by default is shown like everything else; what cannot be shown stops a frame before it has begun."""

from dataclasses import replace

import numpy as np
import pytest

import pica
from pica.errors import MaterialTypeError, SceneError
from pica.scene.light import SphereLight
from pica.scene.material import Material
from pica.scene.model import Node
from pica.scenes.basic_meshes import box, plane
from pica.scenes.placing import move
from tests.building import CAMERA, RAYS, lambert, placed, scene_of, settings, uniform

SIZE = (24, 16)
KINDS = {
    "float64 and int64": lambda a: a.astype("f8" if a.dtype.kind == "f" else "i8"),
    "big-endian": lambda a: a.astype(a.dtype.newbyteorder(">")),
    "lists": lambda a: a.tolist(),
    "columns first": lambda a: np.asfortranarray(a),
    "read-only": lambda a: np.broadcast_to(a, a.shape),
}


def section():
    return box(1, lambert(0.7, 0.4, 0.2))


def scene(*nodes):
    return scene_of(*nodes, environment=uniform(1))


def picture(device, shown, kind=pica.Renderer):
    return kind(shown, size=SIZE, settings=settings(RAYS), device=device).render(1, camera=CAMERA)


def first(renderer):
    """A frame that nothing came before."""
    if isinstance(renderer, pica.Renderer):
        renderer.reset()
    return renderer.render(1, camera=CAMERA)


@pytest.mark.parametrize("kind", KINDS)
def test_meshes_of_any_arrays_look_alike(device, kind):
    plain = section()
    arrays = {name: value for name in vars(plain) if isinstance(value := getattr(plain, name), np.ndarray)}
    converted = replace(plain, **{name: KINDS[kind](values) for name, values in arrays.items()})
    expected, found = (picture(device, scene(placed(each))) for each in (plain, converted))
    assert expected.aov("instance").any()
    np.testing.assert_array_equal(found.color, expected.color)


def test_whole_positions_are_shown(device):
    corners = [[-1, 0, -1], [-1, 0, 1], [1, 0, 1], [1, 0, -1]]
    floor = plane(2, 2, lambert(0.5))
    made = replace(
        floor.take(np.arange(4), np.zeros((0, 3), np.uint32)), positions=corners, indices=[[0, 1, 2], [0, 2, 3]]
    )
    assert picture(device, scene(placed(made))).aov("instance").any()


@pytest.mark.parametrize("kind", [pica.Renderer, pica.PathTracer])
def test_what_was_written_into_arrays_is_found_before_they_are_uploaded(device, kind):
    shown = scene(placed(section(), name="cube"))
    cube = shown.roots[0].mesh.sections[0]
    cube.positions = positions = cube.positions.copy()
    before = positions[5, 0]
    positions[5, 0] = np.nan
    with pytest.raises(SceneError, match=r"^mesh 'cube': part 0: section: positions: row 5 is not finite \(nan\)$"):
        kind(shown, size=SIZE, device=device)
    positions[5, 0] = before
    np.testing.assert_array_equal(
        picture(device, shown, kind).color, picture(device, scene(placed(section())), kind).color
    )


@pytest.mark.parametrize("kind", [pica.Renderer, pica.PathTracer])
def test_a_frame_that_cannot_be_shown_is_refused_until_that_is_mended(device, kind):
    shown = scene(placed(section(), name="cube"))
    renderer = kind(shown, size=SIZE, settings=settings(RAYS), device=device)
    renderer.render(1, camera=CAMERA)
    far = shown.add(Node("far"))
    far.transform = np.diag([1e30, 1e30, 1e30, 1])
    ball = far.add(placed(section(), np.diag([1e30, 1e30, 1e30, 1]), "ball"))
    shown.roots[0].transform = move(0.2, 0, 0)
    for _ in range(2):
        with pytest.raises(SceneError, match=r"^node 'ball': its place in the world is too large for 32-bit floats$"):
            renderer.render(1, camera=CAMERA)
    ball.transform, far.transform = move(-0.5, 0.5, 0), np.eye(4)
    alike = scene(placed(section(), move(0.2, 0, 0)), placed(section(), move(-0.5, 0.5, 0)))
    np.testing.assert_array_equal(first(renderer).aov("depth"), picture(device, alike, kind).aov("depth"))


def test_what_cannot_be_shown_can_be_taken_out_again(device):
    shown = scene(placed(section(), name="cube"))
    renderer = pica.Renderer(shown, size=SIZE, settings=settings(RAYS), device=device)
    expected = renderer.render(1, camera=CAMERA).aov("depth")
    spoilt = placed(section(), name="spoilt")
    indices = spoilt.mesh.sections[0].indices.copy()
    indices[0, 0] = 77
    spoilt.mesh.sections[0].indices = indices
    lamp = Node("lamp", light=SphereLight(radius=1e15))
    lamp.transform = np.diag([1e10, 1, 1, 1])
    for node, fault in ((spoilt, "row 0 names vertex 77 of 24"), (lamp, "with the node's scale it is too large")):
        shown.add(node)
        with pytest.raises(SceneError, match=fault):
            renderer.render(1, camera=CAMERA)
        shown.remove(node)
        np.testing.assert_array_equal(first(renderer).aov("depth"), expected)


def test_an_animated_node_that_leaves_the_numbers_says_so(device):
    shown = scene(placed(section(), name="cube"))
    renderer = pica.Renderer(shown, size=SIZE, settings=settings(RAYS), device=device)
    cube = shown.roots[0]
    renderer.render(1, camera=CAMERA)
    above = shown.add(Node("above"))
    shown.remove(cube)
    above.add(cube)
    above.transform = cube.transform = move(3e38, 0, 0)
    with pytest.raises(SceneError, match=r"^node 'cube': its place in the world"):
        renderer.render(1, camera=CAMERA)
    above.transform = cube.transform = np.eye(4)
    assert renderer.render(1, camera=CAMERA).aov("instance").any()


COUNTED = """
import materials.material_type;
struct Counted : IMaterialType
{
    struct Parameters { float share; int count; }
    static void evaluate(MaterialInput input, inout Surface surface) {}
}
"""


@pytest.mark.parametrize(
    ("name", "value"),
    [("share", value) for value in (np.nan, 1e39, "1", None, (1.0, 2.0), True, 1j)]
    + [("count", value) for value in (0.5, np.nan, 1e300, 1 << 40, "1", None, True)],
)
def test_parameters_of_materials_are_finite_numbers(device, tmp_path, name, value):
    path = tmp_path / "counted.slang"
    path.write_text(COUNTED)
    pica.register_material("counted", path)
    parameters = {"share": np.float64(0.5), "count": 3.0}

    def shown(parameters):
        material = Material("tally", type="counted", parameters=parameters)
        return pica.Renderer(scene(placed(box(1, material))), size=SIZE, device=device)

    shown(parameters).close()
    with pytest.raises(MaterialTypeError, match=rf"^material 'tally': parameter '{name}' is .*, but must be a number"):
        shown({**parameters, name: value})

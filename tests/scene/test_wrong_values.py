"""Whatever a scene is told, it keeps what it can show and refuses the rest with one line that names the field."""

from dataclasses import fields, replace
from functools import partial

import numpy as np
import pytest

import pica
from pica.errors import SceneError
from pica.scene.animation import Animation, Channel, Pose
from pica.scene.anisotropy import Anisotropy
from pica.scene.camera import Camera
from pica.scene.checked_field import CheckedField
from pica.scene.dynamic_vertices import DynamicVertices
from pica.scene.emitter import Emitter
from pica.scene.environment import Environment
from pica.scene.iridescence import Iridescence
from pica.scene.landscape import Landscape
from pica.scene.light import (
    DirectionalLight,
    DiskLight,
    PointLight,
    RectangleLight,
    SphereLight,
    SpotLight,
    TubeLight,
)
from pica.scene.material import Image, Material, Sampler, Texture
from pica.scene.mesh import Mesh, Section
from pica.scene.model import Node, Scene
from pica.scene.particles import Particles, Ribbons, Sprites
from pica.scene.primitives import Primitives, capsules, rounded_boxes, spheres, tori
from pica.scene.sheen import Sheen
from pica.scene.skin import Skin
from pica.scene.spline import Spline, bend
from pica.scenes.basic_meshes import box
from tests.building import lambert
from tests.wrong_values import VALUES, fault_of

PIXELS = np.zeros((2, 2, 4), np.uint8)
LINE = np.array([(0.0, 0, 0), (0, 0, 1), (0, 1, 2)])


def cube() -> Section:
    return box(1, lambert())


def figure() -> Section:
    """A triangle with all that a section can have."""
    plain = cube().take(np.arange(3), np.array([[0, 1, 2]], np.uint32))
    offsets = np.ones((2, 3, 3), np.float32)
    return replace(
        plain,
        joints=np.zeros((3, 1), np.uint16),
        weights=np.ones((3, 1), np.float32),
        morph_positions=offsets,
        morph_normals=offsets,
        morph_tangents=offsets,
        rows=np.arange(3, dtype=np.uint32),
    )


def posed() -> Node:
    return Node("posed", pose=Pose())


def cloth() -> DynamicVertices:
    return DynamicVertices(Node("cloth", mesh=Mesh([cube()])))


OBJECTS = [
    figure(),
    Mesh([cube()], "mesh"),
    Node("node", mesh=Mesh([figure()]), light=PointLight(), camera=Camera(np.eye(4)), pose=Pose()),
    Material("wood"),
    Anisotropy(),
    Iridescence(),
    Sheen(),
    Sampler(),
    Image(PIXELS),
    Texture(Image(PIXELS)),
    Camera(np.eye(4)),
    Camera(np.eye(4), orthographic_height=2.0),
    Environment(np.ones((2, 4, 3), np.float32)),
    *(kind() for kind in (DirectionalLight, PointLight, SpotLight, RectangleLight, DiskLight, SphereLight, TubeLight)),
    spheres([(0, 0, 0)], 1, Material()),
    Particles(np.zeros((4, 3)), identities=np.arange(4)),
    Emitter(10, 2.0),
    Pose(),
    Channel(posed(), "translation", np.array([0.0, 1.0]), np.zeros((2, 3))),
    Skin([posed()], np.eye(4)[None]),
]

CALLS = [
    (
        Camera.look_at,
        {"eye": (0, 0, 1), "target": (0, 0, 0), "vertical_fov": 0.7, "up": (0, 1, 0), "name": "", "near": 0.1},
    ),
    (Camera.framing, {"low": (0, 0, 0), "high": (1, 1, 1), "aspect": 1.0, "vertical_fov": 0.7}),
    (Scene, {"name": "", "environment": None}),
    (Scene("scene").add, {"node": Node()}),
    (Scene("scene").remove, {"node": Node()}),
    (Scene("scene").animate, {"time": 0.0, "animation": None}),
    (Scene("scene").default_camera, {"aspect": 1.0}),
    (Node("node").add, {"child": Node()}),
    (Node("node").show, {"mesh": None}),
    (Node("node").place_instances, {"instances": np.eye(4)[None], "identities": None}),
    (Animation, {"channels": [], "name": "", "duration": 0.0}),
    (cloth, {}),
    (cloth().set, {"positions": cube().positions, "normals": None}),
    (DynamicVertices, {"node": Node(mesh=Mesh([cube()]))}),
    (Sprites, {"capacity": 3, "material": Material(), "name": ""}),
    (Ribbons, {"strands": 2, "points": 2, "material": Material(), "name": ""}),
    (
        Ribbons(2, 2, Material()).set,
        {"positions": np.zeros((2, 2, 3)), "widths": 1.0, "colors": (1, 1, 1, 1), "identities": None},
    ),
    (Spline, {"points": LINE, "rolls": 0.0, "scales": 1.0, "up": (0, 1, 0), "extent": (0, 1)}),
    (Spline(LINE).set, {"points": LINE, "rolls": 0.0, "scales": 1.0}),
    (bend, {"mesh": Mesh([cube()]), "spline": Spline(LINE), "copies": 1, "name": ""}),
    (
        Landscape,
        {
            "heights": np.zeros((5, 5)),
            "spacing": 1.0,
            "material": Material(),
            "patch": 4,
            "levels": 2,
            "full_detail": 5.0,
            "name": "hills",
        },
    ),
    (spheres, {"centers": [(0, 0, 0)], "radii": 1.0, "material": Material()}),
    (capsules, {"starts": [(0, 0, 0)], "ends": [(0, 1, 0)], "radii": 1.0, "material": Material()}),
    (tori, {"centers": [(0, 0, 0)], "radii": 1.0, "tube_radii": 0.1, "material": Material()}),
    (rounded_boxes, {"centers": [(0, 0, 0)], "sizes": (1, 1, 1), "radii": 0.1, "material": Material()}),
    (Emitter(10, 2.0).at, {"time": 0.0}),
    (partial(pica.register_material, path="nowhere.slang"), {"name": "of_mine"}),
    (partial(pica.register_shape, path="nowhere.slang"), {"name": "of_mine"}),
]


def kind_of(case) -> str:
    return type(case).__name__


@pytest.mark.parametrize("made", OBJECTS, ids=kind_of)
def test_every_field_keeps_what_fits_or_names_itself(made):
    unchecked = {"extras", "detail", "children", "parent"}
    tried = [each.name for each in fields(made) if each.init and not each.name.startswith("_")]
    for name in set(tried) - unchecked:
        refused = 0
        for value in VALUES.values():
            fault = fault_of(replace, made, **{name: value})
            assert not fault or name.replace("_", " ").removesuffix("s") in fault.replace("_", " "), fault
            refused += bool(fault)
        assert refused > len(VALUES) / 4, f"{name} takes almost anything"


@pytest.mark.parametrize("made", [made for made in OBJECTS if not type(made).__dataclass_params__.frozen], ids=kind_of)
def test_fields_are_checked_whenever_they_are_set(made):
    for name, field in vars(type(made)).items():
        if not isinstance(field, CheckedField):
            continue
        before = getattr(made, name)
        for value in VALUES.values():
            if fault_of(replace, made, **{name: value}) and not fault_of(setattr, made, name, value):
                setattr(made, name, before)
                assert name in ("positions", "normals", "tangents", "uv0", "uv1", "colors", "indices", "joints") or (
                    isinstance(made, Section | Primitives)
                ), f"{name} = {value!r} is found out only by what else there is"
        assert getattr(made, name) is before or getattr(made, name) == before


@pytest.mark.parametrize(("call", "good"), CALLS, ids=lambda case: getattr(case, "__qualname__", ""))
def test_every_argument_is_taken_or_refused_in_one_line(call, good):
    for name in good:
        for value in VALUES.values():
            fault_of(call, **{**good, name: value})


@pytest.mark.parametrize("name", ["transform", "weights", "skin", "deformer"])
def test_properties_of_nodes_name_themselves(name):
    for label, value in VALUES.items():
        node = Node("the node", mesh=Mesh([cube()]))
        fault = fault_of(setattr, node, name, value)
        fits = (label, name) in {("zero matrix", ""), ("list", "weights")}
        assert fits or ("'the node'" in fault and (name in fault or "weights" in fault)), (label, fault)


@pytest.mark.parametrize(
    ("make", "fault"),
    [
        (lambda: replace(cube(), positions=[[0, 0, np.nan]] * 24), "section: positions: row 0 is not finite (nan)"),
        (lambda: replace(cube(), indices=[[0, 1, 24]]), "section: indices: row 0 names vertex 24 of 24"),
        (lambda: replace(cube(), uv0=np.zeros((1, 2))), "section: uv0: for 1 vertices, but there are 24 positions"),
        (lambda: replace(figure(), weights=np.full((3, 1), 0.5)), "section: weights: row 0 does not add up to 1 (0.5)"),
        (lambda: replace(figure(), weights=None), "section: weights: joints and weights go together, but one is None"),
        (
            lambda: replace(figure(), joints=[[0, 1]] * 3),
            "section: weights: have the shape (3, 1), but joints have (3, 2)",
        ),
        (
            lambda: Mesh([cube(), figure()], "two"),
            "mesh 'two': sections: differ in their number of morph targets, [0, 2]",
        ),
        (lambda: Mesh("cube"), "mesh: sections: 'cube' is text, not several values"),
        (lambda: Material("wood", roughness=1.5), "material 'wood': roughness: 1.5 is not from 0 to 1"),
        (lambda: Material("wood", emission=(0, -1, 0)), "material 'wood': emission: -1 is negative"),
        (lambda: Material("wood", emission=(0, np.inf, 0)), "material 'wood': emission: inf is not finite"),
        (
            lambda: Material("wood", emission=np.array([1e39, 0, 0])),
            "material 'wood': emission: 1e+39 is too large for 32-bit floats",
        ),
        (lambda: Material("wood", base_color=(1, 1, 1)), "material 'wood': base_color: (1, 1, 1) is not 4 numbers"),
        (lambda: Material("wood", ior=0.5), "material 'wood': ior: 0.5 is neither 0 nor 1 or more"),
        (lambda: Material("wood", alpha_mode="MASK"), "material 'wood': alpha_mode: 'MASK' is not an AlphaMode"),
        (lambda: Image(PIXELS.astype(float)), "image: pixels: an array of float64 is not an array of integers"),
        (lambda: Image(PIXELS[:0]), "image: pixels: 2x0 texels; width and height must be 1 to 16384"),
        (lambda: Environment(np.full((2, 4, 3), -1.0)), "environment: radiance: row 0 is negative (-1)"),
        (
            lambda: Environment(np.full((2, 4), 1.0)),
            "environment: radiance: has the shape (2, 4), not (height, width, 3)",
        ),
        (
            lambda: Environment(np.full((2, 4, 3), 1e30), 1e30),
            "environment: strength: 1e+30 times the radiance is more than 1e+36 nits",
        ),
        (lambda: SphereLight(radius=1e200), "sphere light: radius: 1e+200 is too large for 32-bit floats"),
        (lambda: DiskLight(radius=0), "disk light: radius: 0.0 is not above 0"),
        (lambda: RectangleLight(width=-1), "rectangle light: width: -1.0 is not above 0"),
        (
            lambda: PointLight((1, 1, 2), 3e38, name="lamp"),
            "point light 'lamp': intensity: 3e+38 times the colour is more than 1e+36",
        ),
        (
            lambda: SpotLight(inner_cone_angle=1.0, outer_cone_angle=0.5),
            "spot light: inner_cone_angle: 1 is not less than outer_cone_angle, 0.5",
        ),
        (lambda: Camera.look_at((np.inf, 0, 0), (0, 0, 0)), "camera '': eye: row 0 is not finite (inf)"),
        (
            lambda: Camera.look_at((1, 0, 0), (1, 0, 0), name="eye"),
            "camera 'eye': eye and target are the same point (1.0, 0.0, 0.0)",
        ),
        (lambda: Camera.look_at((1, 0, 0), (0, 0, 0), up=(0, np.nan, 0)), "camera '': up: row 1 is not finite (nan)"),
        (lambda: Camera.look_at((1, 0, 0), (0, 0, 0), up=(0, 0, 0)), "camera '': up: has no length"),
        (
            lambda: Camera.look_at((1, 0, 0), (0, 0, 0), vertical_fov=45),
            "camera '': vertical_fov: 45.0 is not from 1e-06 to 3.14159 radians; for degrees, write math.radians(45)",
        ),
        (
            lambda: Camera.look_at((1, 0, 0), (0, 0, 0), near=0),
            "camera: near: is 0; a perspective camera's is above it",
        ),
        (lambda: Camera(np.diag([2.0, 1, 1, 1])), "camera: transform: is not rotation and translation alone"),
        (lambda: Camera(np.eye(4), near=2, far=1, orthographic_height=1), "camera: near: 2 does not lie before far, 1"),
        (
            lambda: Camera(np.eye(4), vertical_fov=np.pi),
            "camera: vertical_fov: 3.141592653589793 is not from 1e-06 to 3.14159 radians",
        ),
        (
            lambda: setattr(Node("a"), "transform", np.diag([1e308, 1, 1, 1])),
            "node 'a': transform: row 0 is too large for 32-bit floats (1e+308)",
        ),
        (
            lambda: Node("a", mesh=cube()),
            "node 'a': mesh: a Section is not a Mesh",
        ),
        (lambda: Skin([], np.zeros((0, 4, 4))), "skin: joints: are none"),
        (lambda: Skin([posed()], np.tile(np.eye(4), (2, 1, 1))), "skin: inverse_bind: 2 matrices for 1 joints"),
        (lambda: Pose(rotation=np.zeros(4)), "pose: rotation: a quaternion of zeros is no rotation"),
        (
            lambda: Animation([Channel(posed(), "scale", np.array([0.0, np.nan]), np.ones((2, 3)))], "wave"),
            "animation 'wave': channels: scale of node 'posed': times are not finite (key 1)",
        ),
        (
            lambda: Animation([Channel(posed(), "scale", np.array([1.0, 0.0]), np.ones((2, 3)))], "wave"),
            "animation 'wave': channels: scale of node 'posed': times do not ascend (key 1)",
        ),
        (
            lambda: Animation([Channel(posed(), "rotation", np.arange(2.0), np.eye(4)[:2] * [[1], [0]])]),
            "animation: channels: rotation of node 'posed': a quaternion of zeros is no rotation (key 1)",
        ),
        (
            lambda: Channel(posed(), "scale", [0, 1], np.ones((2, 4))),
            "channel: values: of the shape (2, 4) do not go with 2 times, LINEAR and scale",
        ),
        (lambda: Particles([[0, 0, np.nan]]), "particles: positions: row 0 is not finite (nan)"),
        (lambda: Emitter(10, 2).at(np.nan), "emitter: time: nan is not finite"),
        (
            lambda: spheres([[0, 0, np.inf]], 1, Material()),
            "primitives of shape 'sphere': places: row 0 is not finite (inf)",
        ),
        (lambda: Scene("a").animate("a"), "animate: time 'a' is not a number of seconds"),
        (lambda: Scene("a").animate(0, 1.5), "animate: no animation 1.5; the scene has none"),
        (lambda: Scene("a", "sky.hdr"), "scene 'a': environment: 'sky.hdr' is not an Environment"),
    ],
)
@pytest.mark.filterwarnings("error")
def test_faults_in_words(make, fault):
    with pytest.raises(SceneError) as caught:
        make()
    assert str(caught.value) == fault


def test_numpys_default_types_make_the_same_mesh():
    plain = figure()
    arrays = {name: value for name in vars(plain) if isinstance(value := getattr(plain, name), np.ndarray)}
    assert len(arrays) == 13
    for kind in ("swapped", "wide", "lists", "fortran"):
        given = {
            name: {
                "swapped": lambda a: a.astype(a.dtype.newbyteorder(">")),
                "wide": lambda a: a.astype("f8" if a.dtype.kind == "f" else "i8"),
                "lists": lambda a: a.tolist(),
                "fortran": lambda a: np.asfortranarray(a[::-1])[::-1],
            }[kind](values)
            for name, values in arrays.items()
        }
        made = replace(plain, **given)
        for name, values in arrays.items():
            found = getattr(made, name)
            assert found.dtype == values.dtype and found.dtype.isnative and found.flags.c_contiguous, (kind, name)
            np.testing.assert_array_equal(found, values)


def test_scalars_of_numpy_and_sequences_become_plain_values():
    material = Material(
        base_color=np.ones(4, "f4"), roughness=np.float32(0.5), double_sided=np.True_, emission=[1, 2, 3]
    )
    assert material.base_color == (1, 1, 1, 1) and type(material.base_color[0]) is float
    assert type(material.roughness) is float and material.double_sided is True and material.emission == (1.0, 2.0, 3.0)
    light = PointLight(iter([1, 2, 3]), np.int64(4))
    assert light == PointLight((1.0, 2.0, 3.0), 4.0) and hash(light) == hash(PointLight((1.0, 2.0, 3.0), 4.0))


def test_sections_without_triangles_show_nothing_and_are_no_fault():
    empty = cube().take(np.zeros(0, int), np.zeros((0, 3), np.uint32))
    scene = Scene()
    scene.add(Node(mesh=Mesh([empty])))
    scene.add(Node(mesh=Mesh()))
    scene.check()
    assert scene.bounds()[1].tolist() == [0.5] * 3 and scene.triangle_count() == 0

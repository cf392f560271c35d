"""Whatever can be written in a scene is in the next frame, as in a scene that was built so; all else refuses."""

import dataclasses
from collections.abc import Callable
from copy import deepcopy
from dataclasses import FrozenInstanceError, dataclass, fields, replace
from time import monotonic, sleep
from typing import Any

import numpy as np
import pytest

import pica
from pica.errors import MaterialTypeError, SceneError
from pica.scene.animation import Pose
from pica.scene.anisotropy import Anisotropy
from pica.scene.camera import Camera
from pica.scene.coat import Coat
from pica.scene.dynamic_vertices import DynamicVertices
from pica.scene.emitter import Emitter
from pica.scene.iridescence import Iridescence
from pica.scene.landscape import Landscape
from pica.scene.light import DirectionalLight, PointLight, SphereLight
from pica.scene.material import AlphaMode, Image, Material, Sampler, Texture
from pica.scene.model import Mesh, Node, Scene, Section
from pica.scene.particles import Particles, Ribbons, Sprites
from pica.scene.primitives import Primitives, spheres
from pica.scene.sheen import Sheen
from pica.scene.skin import Skin
from pica.scene.spline import Spline
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import aim, move, turn
from tests.building import RAYS, lambert, placed, scene_of, settings, shining, sky, uniform

SIZE = (48, 32)
CAMERA = Camera.look_at((0, 1.6, 3.4), (0, 0.3, 0))
SETTINGS = settings({**RAYS, "shadows.mode": "hard", "shadows.max_lights": "4", "lighting.environment": "prefiltered"})
"""What moves light about is off: the picture is the scene's alone, to the bit."""


def texture(seed: int, size: int = 8) -> Texture:
    pixels = np.random.default_rng(seed).integers(60, 250, (size, size, 4)).astype(np.uint8)
    return Texture(Image(pixels, f"noise {seed}"), Sampler(linear=False))


def everything() -> Material:
    """A material that has all there is, so that each of its fields shows."""
    slots = [field.name for field in fields(Material) if field.name.endswith("_texture")]
    return Material(
        base_color=(0.8, 0.6, 0.5, 0.9),
        metallic=0.5,
        roughness=0.6,
        emission=(0.1, 0.1, 0.05),
        transmission=0.3,
        coats=(Coat(strength=0.5, roughness=0.3),),
        iridescence=Iridescence(strength=0.5),
        anisotropy=Anisotropy(strength=0.5),
        sheen=Sheen(color=(0.3, 0.3, 0.3)),
        alpha_mode=AlphaMode.MASK,
        alpha_cutoff=0.3,
        **{slot: texture(number) for number, slot in enumerate(slots)},
    )


def stage() -> Scene:
    """A ball, a box, balls that are no triangles, a cloth and a skinned triangle under a sun, a lamp and a sky."""
    ball = placed(sphere(0.4, everything(), segments=16), move(-0.6, 0.4, 0), "ball")
    cube = placed([box(0.5, lambert(0.7, 0.4, 0.2))], move(0.6, 0.25, 0), "box")
    beads = Node("beads", mesh=Mesh(primitives=[spheres([[0, 0.15, 0.9]], 0.15, lambert(0.3, 0.5, 0.8))]))
    morphed = box(0.3, lambert(0.5, 0.8, 0.3))
    offsets = np.zeros((1, len(morphed.positions), 3), np.float32)
    offsets[:, :, 1] = 0.3
    shape = placed(replace(morphed, morph_positions=offsets), move(0, 0.9, 0), "shape")
    floor = placed(plane(6, 6, lambert(0.5)), name="floor")
    channels = frozenset(range(5))
    sun = shining(DirectionalLight(illuminance=2.0, lighting_channels=channels), aim((1, 2, 1), (0, 0, 0)))
    lamp = shining(PointLight(intensity=2.0), move(-1, 1.5, 1))
    return scene_of(ball, cube, beads, shape, floor, sun, lamp, environment=sky())


def named(scene: Scene, name: str) -> Node:
    return next(node for node in scene.nodes() if node.name == name)


def material(scene: Scene) -> Material:
    return named(scene, "ball").mesh.sections[0].material


def section(scene: Scene) -> Section:
    return named(scene, "box").mesh.sections[0]


def limb(scene: Scene) -> Skin:
    """Has a joint of its own for the box."""
    bone = scene.add(Node("bone"))
    bone.transform = move(0.9, 0.6, 0)
    cube = section(scene)
    count = len(cube.positions)
    cube.joints, cube.weights = np.zeros((count, 1), np.uint16), np.ones((count, 1), np.float32)
    return Skin([bone], np.eye(4)[None])


@dataclass
class Case:
    holder: Callable[[Scene], Any]
    value: Callable[[Any, Scene], Any]
    """Takes the value before."""
    shows: bool = True


def moved(before: np.ndarray, scene: Scene) -> np.ndarray:
    return before * np.float32(1.4)


def other_texture(before: Texture | None, scene: Scene) -> Texture:
    return texture(77, 4)


MATERIAL: dict[str, Any] = {
    "name": "other",
    "base_color": (0.2, 0.9, 0.4, 0.9),
    "metallic": 0.9,
    "roughness": 0.2,
    "emission": (0.0, 2.0, 0.0),
    "normal_scale": -1.0,
    "occlusion_strength": 0.2,
    "alpha_mode": AlphaMode.OPAQUE,
    "alpha_cutoff": 0.6,
    "double_sided": True,
    "unlit": True,
    "ior": 2.4,
    "specular": 0.1,
    "specular_color": (0.2, 1.0, 0.2),
    "transmission": 0.9,
    "thin_walled": False,
    "coats": (Coat(strength=1.0, absorption=(0.1, 0.5, 0.9), thickness=1.0),),
    "coat_normal_scale": -1.0,
    "iridescence": Iridescence(strength=1.0, ior=1.8),
    "anisotropy": Anisotropy(strength=0.9, rotation=1.0),
    "sheen": Sheen(color=(0.9, 0.1, 0.1)),
    "type": "standard",
    "parameters": {},
    "extras": {"a": 1},
}
QUIET = {"name", "type", "parameters", "extras"}
CASES: dict[tuple[type, str], Case] = {
    **{
        (Material, field.name): Case(
            material,
            other_texture if field.name.endswith("_texture") else lambda before, scene, name=field.name: MATERIAL[name],
            field.name not in QUIET,
        )
        for field in fields(Material)
    },
    (Image, "pixels"): Case(
        lambda scene: material(scene).base_color_texture.image, lambda before, scene: 255 - before[:4, :4]
    ),
    (Image, "encoding"): Case(lambda scene: material(scene).base_color_texture.image, lambda *_: "linear"),
    (Image, "name"): Case(lambda scene: material(scene).base_color_texture.image, lambda *_: "other", False),
    (Section, "positions"): Case(section, moved),
    (Section, "normals"): Case(section, lambda before, scene: np.roll(before, 3, axis=0)),
    (Section, "tangents"): Case(section, lambda before, scene: -before, False),
    (Section, "uv0"): Case(lambda scene: named(scene, "ball").mesh.sections[0], moved),
    (Section, "uv1"): Case(section, lambda before, scene: before + 1, False),
    (Section, "colors"): Case(section, lambda before, scene: before * np.float32(0.5)),
    (Section, "indices"): Case(section, lambda before, scene: before[: len(before) // 2]),
    (Section, "material"): Case(section, lambda before, scene: material(scene)),
    (Section, "flat"): Case(section, lambda *_: True, False),
    (Section, "joints"): Case(section, lambda before, scene: None, False),
    (Section, "weights"): Case(section, lambda before, scene: None, False),
    (Section, "morph_positions"): Case(lambda scene: named(scene, "shape").mesh.sections[0], lambda b, s: 2 * b, False),
    (Section, "morph_normals"): Case(section, lambda before, scene: None, False),
    (Section, "morph_tangents"): Case(section, lambda before, scene: None, False),
    (Section, "rows"): Case(section, lambda before, scene: None, False),
    (Mesh, "sections"): Case(
        lambda scene: named(scene, "box").mesh, lambda before, scene: [*before, box(0.8, lambert(0.9))]
    ),
    (Mesh, "primitives"): Case(
        lambda scene: named(scene, "box").mesh, lambda before, scene: named(scene, "beads").mesh.primitives
    ),
    (Mesh, "name"): Case(lambda scene: named(scene, "box").mesh, lambda *_: "other", False),
    (Primitives, "shape"): Case(
        lambda scene: named(scene, "beads").mesh.primitives[0], lambda before, scene: before, False
    ),
    (Primitives, "parameters"): Case(
        lambda scene: named(scene, "beads").mesh.primitives[0],
        lambda before, scene: {**before, "radius": before["radius"] * 0.6},
    ),
    (Primitives, "bounds"): Case(lambda scene: named(scene, "beads").mesh.primitives[0], lambda b, s: b * 1.1, False),
    (Primitives, "material"): Case(
        lambda scene: named(scene, "beads").mesh.primitives[0], lambda *_: lambert(0.9, 0.1, 0.1)
    ),
    (Node, "name"): Case(lambda scene: named(scene, "box"), lambda *_: "cube", False),
    (Node, "mesh"): Case(lambda scene: named(scene, "box"), lambda before, scene: named(scene, "ball").mesh),
    (Node, "light"): Case(lambda scene: scene.roots[-1], lambda *_: SphereLight(radiance=20.0, radius=0.3)),
    (Node, "camera"): Case(lambda scene: named(scene, "box"), lambda *_: CAMERA, False),
    (Node, "instances"): Case(
        lambda scene: named(scene, "box"), lambda *_: np.stack([np.eye(4), move(0, 0.7, 0), move(0, 0, 0.7)])
    ),
    (Node, "identities"): Case(lambda scene: named(scene, "box"), lambda *_: [7], False),
    (Node, "extras"): Case(lambda scene: named(scene, "box"), lambda *_: {"class": "box"}, False),
    (Node, "visible_to_camera"): Case(lambda scene: named(scene, "box"), lambda *_: False),
    (Node, "visible_to_reflections"): Case(lambda scene: named(scene, "box"), lambda *_: False),
    (Node, "casts_shadows"): Case(lambda scene: named(scene, "box"), lambda *_: False),
    (Node, "lighting_channels"): Case(lambda scene: named(scene, "box"), lambda *_: frozenset({5})),
    (Node, "pose"): Case(lambda scene: named(scene, "box"), lambda *_: Pose.of(*np.zeros((2, 3)), np.ones(3)), False),
    (Node, "detail"): Case(lambda scene: named(scene, "box"), lambda *_: None, False),
    (Node, "transform"): Case(lambda scene: named(scene, "box"), lambda b, s: b @ turn("y", 40)),
    (Node, "weights"): Case(lambda scene: named(scene, "shape"), lambda *_: [1.0]),
    (Node, "skin"): Case(lambda scene: named(scene, "box"), lambda before, scene: limb(scene)),
    (Node, "deformer"): Case(
        lambda scene: named(scene, "box"), lambda *_: Spline([[0, 0, 0], [0, 0.4, 0.3], [0, 0.9, 0.3]])
    ),
    (Scene, "name"): Case(lambda scene: scene, lambda *_: "other", False),
    (Scene, "environment"): Case(lambda scene: scene, lambda *_: uniform(1, 0.2, 0.2)),
}


def names_of(kind: type) -> set[str]:
    """What can be assigned: fields and properties with a setter."""
    properties = {name for name, value in vars(kind).items() if isinstance(value, property) and value.fset}
    listed = {field.name for field in fields(kind) if field.init} if dataclasses.is_dataclass(kind) else set()
    return {name for name in listed | properties if not name.startswith("_")}


def picture(renderer: Any) -> dict[str, np.ndarray]:
    if isinstance(renderer, pica.Renderer):
        renderer.reset()
    frame = renderer.render(1, camera=CAMERA)
    return {name: frame.aov(name) for name in ("depth", "normal", "albedo", "emission")} | {"color": frame.color}


def differing(some: dict[str, np.ndarray], others: dict[str, np.ndarray]) -> list[str]:
    """Names of the buffers that differ by more than the rounding of what the chance of each light is weighed with."""
    alike = {"rtol": 1e-4, "atol": 1e-5, "equal_nan": True}
    return [name for name, values in some.items() if not np.allclose(values, others[name], **alike)]


def test_every_field_has_a_case():
    for kind in (Scene, Node, Mesh, Section, Primitives, Material, Image):
        wanted = names_of(kind) | ({"name", "environment"} if kind is Scene else set())
        assert wanted == {name for owner, name in CASES if owner is kind}


@pytest.fixture(scope="module")
def shared(device):
    """A stage, its renderer and what it shows, for tests that leave it as it was."""
    scene = stage()
    with pica.Renderer(scene, size=SIZE, settings=SETTINGS, device=device) as renderer:
        yield scene, renderer, picture(renderer)


ONCE = {"skin", "deformer", "weights", "pose"}
"""Fields that cannot be set back to what they were."""


@pytest.mark.parametrize(("kind", "field"), CASES, ids=lambda value: getattr(value, "__name__", value))
def test_what_is_written_is_in_the_next_frame(device, shared, kind, field):
    scene, renderer, before = shared
    case = CASES[kind, field]
    if field in ONCE:
        scene = stage()
        renderer = pica.Renderer(scene, size=SIZE, settings=SETTINGS, device=device)
    holder = case.holder(scene)
    original = getattr(holder, field, None)
    setattr(holder, field, case.value(original, scene))
    after = picture(renderer)
    with pica.Renderer(deepcopy(scene), size=SIZE, settings=SETTINGS, device=device) as fresh:
        assert differing(after, picture(fresh)) == []
    assert bool(differing(before, after)) == case.shows
    if field not in ONCE:
        setattr(holder, field, original)
        assert differing(before, picture(renderer)) == []


FROZEN: list[Any] = [
    Texture(Image(np.zeros((1, 1, 4), np.uint8))),
    Sampler(),
    Coat(),
    Sheen(),
    Iridescence(),
    Anisotropy(),
    DirectionalLight(),
    PointLight(),
    uniform(1),
    CAMERA,
    Particles(np.zeros((1, 3))),
    Emitter(1, 1.0),
    Pose.of(*np.zeros((2, 3)), np.ones(3)),
]


@pytest.mark.parametrize("holder", FROZEN, ids=lambda holder: type(holder).__name__)
def test_what_nobody_follows_refuses_to_be_written(holder):
    for field in fields(holder):
        with pytest.raises(FrozenInstanceError):
            setattr(holder, field.name, getattr(holder, field.name))
        refuses_content(getattr(holder, field.name))


def test_what_is_set_by_methods_refuses_to_be_assigned():
    scene = stage()
    holders = [
        limb(scene),
        Spline([[0, 0, 0], [0, 1, 0]]),
        Landscape(np.zeros((9, 9)), 1.0, lambert(), patch=8),
        Sprites(2, lambert()),
        Ribbons(1, 3, lambert()),
        DynamicVertices(named(scene, "floor")),
    ]
    for holder in holders:
        public = [name for name in vars(holder) if not name.startswith("_")]
        assert public
        for name in public:
            with pytest.raises(SceneError, match=f"{name}: stays as it was made; make another one$"):
                setattr(holder, name, getattr(holder, name))
            refuses_content(getattr(holder, name))


def refuses_content(value: Any) -> None:
    """An array, list or dictionary that is part of a scene."""
    if isinstance(value, np.ndarray):
        with pytest.raises(ValueError, match="read-only"):
            value[...] = 0
    assert not isinstance(value, list)
    if isinstance(value, dict):
        with pytest.raises(SceneError, match="is read-only; assign a new one"):
            value["a"] = 1


def test_no_array_list_or_dictionary_of_a_scene_can_be_written_into():
    scene = stage()
    named(scene, "shape").weights = [0.5]
    for (_, name), case in CASES.items():
        if name != "extras":
            refuses_content(getattr(case.holder(scene), name))
    ball = named(scene, "ball")
    for values in (ball.world, scene.roots, ball.children):
        refuses_content(values)
    assert not hasattr(ball.children, "append") and not hasattr(scene.roots, "append")
    with pytest.raises(AttributeError):
        ball.parent = ball


def test_an_array_that_was_written_into_is_shown_once_it_is_assigned_again(device):
    scene = stage()
    cube = section(scene)
    positions = cube.positions.copy()
    cube.positions = positions
    with pica.Renderer(scene, size=SIZE, settings=SETTINGS, device=device) as renderer:
        before = picture(renderer)
        positions *= 1.5
        assert differing(before, picture(renderer)) == []
        cube.positions = positions
        assert "depth" in differing(before, picture(renderer))


@pytest.mark.parametrize("kind", [pica.Renderer, pica.PathTracer])
def test_those_who_come_later_see_what_was_written_too(device, kind):
    scene = stage()
    with kind(scene, size=SIZE, settings=SETTINGS, device=device) as renderer:
        before = picture(renderer)
        named(scene, "floor").mesh.sections[0].material.base_color = (0.1, 0.8, 0.1, 1)
        section(scene).material = material(scene)
        box_node = named(scene, "box")
        box_node.show(box_node.mesh)
        after = picture(renderer)
        assert "albedo" in differing(before, after)
        with kind(scene, size=SIZE, settings=SETTINGS, device=device) as later:
            assert differing(after, picture(later)) == []


def test_a_material_that_takes_on_something_new_is_shown_as_it_was_until_programs_know_it(device):
    plain = lambert(0.5, 0.2, 0.2)
    scene = scene_of(placed(sphere(0.5, plain, segments=16), name="ball"), environment=uniform(1))
    with pica.Renderer(scene, size=SIZE, settings=SETTINGS, device=device) as renderer:
        renderer.render(1, camera=CAMERA)
        plain.coats, plain.base_color = (Coat(),), (0.2, 0.2, 0.6, 1)
        until = monotonic() + 240
        while monotonic() < until:
            shown = renderer.advance(CAMERA)
            assert shown["visibility"].to_numpy()[..., 0].any(), "it never vanishes"
            if not renderer.pending_shaders:
                break
            sleep(0.05)
        assert not renderer.pending_shaders
        after = picture(renderer)
    with pica.Renderer(deepcopy(scene), size=SIZE, settings=SETTINGS, device=device) as fresh:
        assert differing(after, picture(fresh)) == []


def test_what_does_not_fit_is_refused_in_each_frame_until_it_is_mended(device):
    scene = stage()
    with pica.Renderer(scene, size=SIZE, settings=SETTINGS, device=device) as renderer:
        before = picture(renderer)
        cube = section(scene)
        normals = cube.normals
        cube.normals = normals[:-1]
        for _ in range(2):
            with pytest.raises(SceneError, match=r"^mesh 'box': part 0: section: normals: for 23 vertices, but"):
                picture(renderer)
        cube.normals = normals
        cube.material.type = "nowhere"
        for _ in range(2):
            with pytest.raises(MaterialTypeError, match="material type 'nowhere' is not registered"):
                picture(renderer)
        cube.material.type = "standard"
        assert differing(before, picture(renderer)) == []


def test_materials_share_an_image_that_is_written_to(device):
    shared = texture(3)
    scene = scene_of(
        placed(plane(1, 1, lambert(1.0, base_color_texture=shared)), move(-0.6, 0, 0)),
        placed(plane(1, 1, lambert(1.0, base_color_texture=shared)), move(0.6, 0, 0)),
        environment=uniform(1),
    )
    with pica.Renderer(scene, size=SIZE, settings=SETTINGS, device=device) as renderer:
        picture(renderer)
        memory = device.memory
        for grey in (10, 200, 90):
            shared.image.pixels = np.full((8, 8, 4), grey, np.uint8)
            albedo = picture(renderer)["albedo"]
            assert len(np.unique(albedo[albedo > 0].round(4))) == 1
        assert device.memory == memory, "those before were given back"


def test_light_that_a_material_emits_is_followed(device):
    lamp = Material(base_color=(0, 0, 0, 1), emission=(0.0, 0.0, 0.0))
    scene = scene_of(placed(plane(1, 1, lamp), move(0, 1, 0) @ turn("x", 180)), placed(plane(4, 4, lambert(0.5))))
    with pica.PathTracer(scene, size=SIZE, device=device) as tracer:
        mean = []
        for strength in (0.0, 5.0, 20.0, 0.0):
            lamp.emission = (strength, strength, strength)
            mean.append(float(tracer.render(4, camera=CAMERA).color[-4:].mean()))
    assert mean[0] == mean[3] == 0 and mean[2] == pytest.approx(4 * mean[1], rel=1e-4) and mean[1] > 0


def test_a_thousand_edits_in_a_row_end_where_a_fresh_build_begins(device):
    random = np.random.default_rng(5)
    scene = stage()
    material(scene).emission = (0, 0, 0)  # whose triangles are chosen by chance, in the order in which they came
    cases = [case for case in CASES if case[1] not in ONCE | {"name", "identities", "emission"}]
    originals: dict[tuple[Any, str], Any] = {}
    memory = 0
    with pica.Renderer(scene, size=SIZE, settings=SETTINGS, device=device) as renderer:
        for step in range(1000):
            kind, name = cases[random.integers(len(cases))]
            try:
                holder = CASES[kind, name].holder(scene)
            except (AttributeError, IndexError):  # an edit before has taken it away
                continue
            if (holder, name) in originals:
                setattr(holder, name, originals.pop((holder, name)))
            else:
                originals[holder, name] = before = getattr(holder, name)
                setattr(holder, name, CASES[kind, name].value(before, scene))
            if step % 20 == 19:
                renderer.render(1, camera=CAMERA)
            if step % 250 == 249:
                after = picture(renderer)
                with pica.Renderer(deepcopy(scene), size=SIZE, settings=SETTINGS, device=device) as fresh:
                    assert differing(after, picture(fresh)) == [], step
                memory = memory or device.memory
        assert device.memory < 1.2 * memory

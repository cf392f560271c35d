"""Whatever can be written in a scene is in the next frame, as in a scene that was built so; all else refuses."""

import dataclasses
from copy import deepcopy
from dataclasses import fields
from time import monotonic, sleep
from typing import Any

import numpy as np
import pytest

import pica
from pica.errors import MaterialTypeError, SceneError
from pica.scene.animation import Pose
from pica.scene.anisotropy import Anisotropy
from pica.scene.coat import Coat
from pica.scene.dynamic_vertices import DynamicVertices
from pica.scene.emitter import Emitter
from pica.scene.iridescence import Iridescence
from pica.scene.landscape import Landscape
from pica.scene.light import DirectionalLight, PointLight
from pica.scene.material import Image, Material, Sampler, Texture
from pica.scene.model import Mesh, Node, Scene, Section
from pica.scene.particles import Particles, Ribbons, Sprites
from pica.scene.primitives import Primitives
from pica.scene.sheen import Sheen
from pica.scene.spline import Spline
from pica.scenes.basic_meshes import plane, sphere
from pica.scenes.placing import move, rotate
from tests.building import lambert, placed, scene_of, uniform
from tests.gpu_scene.edits import (
    CAMERA,
    CASES,
    DIFFUSE,
    LIT,
    MATERIAL,
    ONCE,
    SETTINGS,
    SIZE,
    THROUGH,
    differing,
    glass_material,
    limb,
    material,
    named,
    other_texture,
    picture,
    section,
    stage,
    stage_with_window,
    texture,
)


def names_of(kind: type) -> set[str]:
    """What can be assigned: fields and properties with a setter."""
    properties = {name for name, value in vars(kind).items() if isinstance(value, property) and value.fset}
    listed = {field.name for field in fields(kind) if field.init} if dataclasses.is_dataclass(kind) else set()
    return {name for name in listed | properties if not name.startswith("_")}


def test_every_field_has_a_case():
    for kind in (Scene, Node, Mesh, Section, Primitives, Material, Image):
        wanted = names_of(kind) | ({"name", "environment"} if kind is Scene else set())
        wanted -= THROUGH | DIFFUSE if kind is Material else set()
        assert wanted == {name for owner, name in CASES if owner is kind}


@pytest.fixture(scope="module")
def shared(device):
    """A stage, its renderer and what it shows, for tests that leave it as it was."""
    scene = stage()
    with pica.Renderer(scene, size=SIZE, settings=SETTINGS, device=device) as renderer:
        yield scene, renderer, picture(renderer)


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


@pytest.mark.parametrize("field", sorted(THROUGH))
def test_what_is_written_of_glass_is_in_the_next_frame(device, field):
    scene = stage_with_window()
    material = glass_material(scene)
    with pica.Renderer(scene, size=SIZE, settings=LIT, device=device) as renderer:
        before, original = picture(renderer), getattr(material, field)
        setattr(material, field, other_texture(None, scene) if field.endswith("_texture") else MATERIAL[field])
        after = picture(renderer)
        with pica.Renderer(deepcopy(scene), size=SIZE, settings=LIT, device=device) as fresh:
            assert differing(after, picture(fresh)) == []
        assert differing(before, after) == ["color"]
        setattr(material, field, original)
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
    Particles(np.zeros((1, 3)), identities=np.arange(1)),
    Emitter(1, 1.0),
    Pose.of(*np.zeros((2, 3)), np.ones(3)),
]


@pytest.mark.parametrize("holder", FROZEN, ids=lambda holder: type(holder).__name__)
def test_what_nobody_follows_refuses_to_be_written(holder):
    for field in fields(holder):
        with pytest.raises(SceneError, match=f"{field.name}: stays as it was made"):
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
    with pytest.raises(SceneError, match="parent: cannot be assigned"):
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
    if kind is pica.PathTracer:  # all lobes at once would take it minutes to compile, and materials are written alike
        named(scene, "ball").mesh.sections[0].material = lambert(0.2, 0.3, 0.7)
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
    scene = scene_of(placed(plane(1, 1, lamp), move(0, 1, 0) @ rotate("x", 180)), placed(plane(4, 4, lambert(0.5))))
    with pica.PathTracer(scene, size=SIZE, device=device) as tracer:
        mean = []
        for strength in (0.0, 5.0, 20.0, 0.0):
            lamp.emission = (strength, strength, strength)
            mean.append(float(tracer.render(4, camera=CAMERA).color[-4:].mean()))
    assert mean[0] == mean[3] == 0 and mean[2] == pytest.approx(4 * mean[1], rel=1e-4) and mean[1] > 0

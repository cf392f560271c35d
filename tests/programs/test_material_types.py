"""Material types of the user's own: the same in raster, rays, both schedulers and the path tracer."""

import re
import subprocess
import sys

import numpy as np
import pytest

import pica
from pica.errors import MaterialTypeError, PicaError
from pica.programs.material_types import STANDARD_ONLY, plain
from pica.scene import material_registry as material_types
from pica.scene.light import DirectionalLight
from pica.scene.material import AlphaMode, Material, Sampler, Texture
from pica.scene.model import Node, Scene
from pica.scenes.basic_meshes import plane, sphere
from pica.scenes.placing import aim, move, rotate
from pica.tracing import embree
from tests.building import (
    CAMERA,
    EMBREE,
    RASTER,
    RAYS,
    assert_schedulers_agree,
    checkered,
    lambert,
    orthographic,
    placed,
    render,
    scene_of,
    settings,
    shining,
    sky,
    still_life,
    trace,
)
from tests.rays import gpu_scene

FOLDER = "tests/material_types"
FRONT = orthographic((0, 0, 2), (0, 0, 0), 2.0)
SURFACES = {**RASTER, "shadows.mode": "off"}
"""For what is seen of materials, whatever lights them: fewer programs."""
PLAIN = """
import materials.material_type;
struct Plain : IMaterialType
{
    static void evaluate(MaterialInput input, inout Surface surface) { surface.brdf.baseColor = 0.25; }
}
"""


@pytest.fixture(autouse=True)
def fresh_registry(monkeypatch):
    monkeypatch.setattr(material_types, "_registered", {})


@pytest.fixture
def register(tmp_path):
    """Register source under a name; gives the file."""

    def write(name: str, source: str):
        path = tmp_path / f"{name}.slang"
        path.write_text(source)
        pica.register_material(name, path)
        return path

    return write


@pytest.fixture
def own_types(request):
    folder = request.config.rootpath / FOLDER
    for name in ("marble", "perforated", "places", "striped", "textured"):
        pica.register_material(name, folder / f"{name}.slang")


def marble(**more) -> Material:
    parameters = {"vein": (0.1, 0.1, 0.15), "scale": 6.0, "octaves": 4}
    return Material("marble", base_color=(0.9, 0.9, 0.85, 1), type="marble", parameters=parameters, **more)


def perforated(**more) -> Material:
    values = {"alpha_mode": AlphaMode.MASK, "double_sided": True, "parameters": {"holes": 6, "radius": 0.35}}
    return Material("sheet", base_color=(0.9, 0.6, 0.3, 1), roughness=0.4, type="perforated", **values | more)


def places() -> Material:
    return Material(type="places", parameters={"first": 0.5, "pair": (-3, 4), "offset": (0.5, 0, 0), "last": 7})


def textured(**more) -> Material:
    return Material(base_color_texture=Texture(checkered(), Sampler(linear=False)), **more)


def samples() -> list[Node]:
    """Nodes of the types of `stones`, which no ray meets."""
    nodes = [placed(plane(0.1, 0.1, material)) for material in (lambert(), marble(), perforated())]
    for node in nodes:
        node.visible_to_camera = node.visible_to_reflections = node.casts_shadows = False
    return nodes


def among_samples(*nodes: Node) -> Scene:
    """A scene of these by the programs that `stones` has: they take most of the time."""
    return scene_of(*samples(), *nodes)


def stones():
    """A marble ball, and one mesh of three sections of three types."""
    mixed = [plane(1.2, 1.2, perforated()), sphere(0.2, marble()), sphere(0.15, lambert(0.2, 0.7, 0.2))]
    return scene_of(
        placed(plane(4, 4, lambert(0.6)), name="floor"),
        placed(sphere(0.5, marble()), move(-0.6, 0.5, 0), "ball"),
        placed(mixed, move(0.6, 0.7, 0.3) @ rotate("x", 60), "mixed"),
        shining(DirectionalLight(illuminance=2.0, angular_diameter=0.05), aim((1, 2, 1.5), (0, 0, 0))),
        environment=sky(),
    )


@pytest.mark.slow
def test_schedulers_agree_to_the_bit(device, own_types):
    assert_schedulers_agree(device, stones)


@pytest.mark.skipif(bool(embree.missing()), reason="Embree is not installed")
def test_embree_sees_the_same_surfaces(device, own_types):
    """Hits differ by rounding alone, so that few samples take another way."""
    pipeline, traced = (trace(device, stones(), 2, CAMERA, values=values).color for values in (RAYS, EMBREE))
    same = np.isclose(pipeline, traced, rtol=2e-3).all(axis=-1)
    assert same.mean() > 0.99


def test_raster_and_rays_see_the_same_surfaces(device, own_types):
    raster, rays = (render(device, stones(), 1, CAMERA, values=values) for values in (RASTER, RAYS))
    for name in ("albedo", "roughness", "metallic"):
        differing = np.abs(raster.aov(name) - rays.aov(name)).reshape(*raster.color.shape[:2], -1).max(-1) > 1e-3
        assert differing.mean() < 0.003, name
    ball = rays.aov("instance") == 2
    assert rays.aov("albedo")[ball].std(axis=0).min() > 0.05, "the veins are seen"


def test_path_tracer_and_hybrid_agree(device, own_types):
    """Direct light of both is the same in the mean, holes and their shadows too."""
    hybrid = render(device, stones(), 64, CAMERA, (48, 32), values=RAYS).color
    traced = trace(device, stones(), 64, CAMERA, (48, 32), max_depth=2, values=RAYS).color
    np.testing.assert_allclose(hybrid.mean(axis=(0, 1)) / traced.mean(axis=(0, 1)), 1, atol=0.03)


def test_holes_are_where_the_type_says(device, own_types):
    wall = plane(2, 2, perforated(parameters={"holes": 2, "radius": 0.25}))
    for values in (RASTER, RAYS):
        scene = among_samples(placed(wall, rotate("x", 90)))
        seen = render(device, scene, 1, FRONT, (64, 64), values=values).aov("instance")
        y, x = (np.indices((64, 64)) + 0.5) / 32 % 1 - 0.5
        distance = np.hypot(x, y)
        clear = np.abs(distance - 0.25) > 0.03
        np.testing.assert_array_equal((seen > 0)[clear], (distance > 0.25)[clear])


def test_a_type_knows_places_and_parameters(device, own_types):
    """Every kind of parameter arrives, and positions are those of the object and of the world."""
    node = placed(plane(1, 1, places()), move(0.5, 0, 0) @ rotate("x", 90))
    camera = orthographic((0.5, 0, 2), (0.5, 0, 0), 1.0)
    albedo = render(device, scene_of(node), 1, camera, (32, 32), SURFACES).aov("albedo")
    ramp = np.tile((np.arange(32) + 0.5) / 32, (32, 1))
    np.testing.assert_allclose(albedo[..., 0], ramp, atol=1e-3)
    np.testing.assert_allclose(albedo[..., 1], ramp, atol=1e-3)
    np.testing.assert_array_equal(albedo[..., 2], 1)


def test_emission_of_a_type_is_sampled_as_it_shines(device, own_types):
    """A lamp with a pattern of its own lights a wall as much when its light is sampled as when rays find it."""

    def lit(width: float, side: float, material: Material, values=None) -> np.ndarray:
        lamp = placed(plane(width, 1, material), move(side, 1, 0) @ rotate("x", 180))
        scene = scene_of(placed(plane(4, 4, lambert(0.5))), lamp)
        camera = orthographic((0, 0.5, 0), (0, 0, 0.0001), 2.0)
        return trace(device, scene, 256, camera, (16, 16), max_depth=2, values=values).color

    found = lit(1, 0, Material(type="striped", emission=(1, 1, 1), base_color=(0, 0, 0, 1)), RAYS)
    expected = [lit(0.5, side, lambert(0.0, emission=(3, 3, 3))) for side in (-0.25, 0.25)]
    errors = [np.abs(found.mean(axis=(0, 2)) - e.mean(axis=(0, 2))).max() / e.mean() for e in expected]
    assert min(errors) < 0.05 and max(errors) > 0.1


def test_only_types_in_use_are_compiled_in(device, own_types):
    assert tuple(plain(gpu_scene(device, still_life()).material_types).values()) == STANDARD_ONLY
    only_marble = scene_of(placed(sphere(0.5, marble())))
    assert [source.name for source in gpu_scene(device, only_marble).material_types] == ["marble"]


def test_a_type_may_come_while_frames_are_rendered(device, own_types):
    scene = scene_of(placed(plane(4, 4, lambert(0.6)), name="floor"), environment=sky())
    renderer = pica.Renderer(scene, size=(48, 32), settings=settings(RASTER), device=device)
    before = renderer.render(1, camera=CAMERA)
    assert len(np.unique(before.aov("material"))) <= 2
    for node in samples():
        scene.add(node)
    scene.add(placed(sphere(0.5, marble()), move(0, 0.5, 0), "ball"))
    renderer.reset()
    after = renderer.render(1, camera=CAMERA).aov("albedo")
    fresh = render(device, scene, 1, CAMERA, (48, 32), RASTER).aov("albedo")
    np.testing.assert_allclose(after, fresh, atol=1e-6)
    assert (after != before.aov("albedo")).any()


def faults(call, *arguments, **named) -> str:
    with pytest.raises(PicaError) as caught:
        call(*arguments, **named)
    assert isinstance(caught.value, MaterialTypeError)
    message = str(caught.value)
    assert "\n" not in message
    return message


def shown(device, material: Material) -> str:
    return faults(pica.Renderer, scene_of(placed(sphere(0.5, material))), size=(8, 8), device=device)


def test_registering_says_what_is_wrong(tmp_path, register):
    assert "nothing.slang: No such file" in faults(pica.register_material, "nothing", tmp_path / "nothing.slang")
    path = register("plain", PLAIN)
    pica.register_material("plain", path)
    assert "taken by pica itself" in faults(pica.register_material, "standard", path)
    assert "'Big Stone'" in faults(pica.register_material, "Big Stone", path)
    path.write_bytes(b"\xff\xfe\xfa")
    assert "not a text file" in faults(pica.register_material, "binary", path)


def test_unknown_type_is_named(device, register):
    register("plain", PLAIN)
    assert "'plane' is not registered; there are standard, plain" in shown(device, Material(type="plane"))


@pytest.mark.parametrize(
    ("source", "fault"),
    [
        (PLAIN.replace("baseColor", "color"), "faulty.slang:5: 'color' is not a member"),
        (PLAIN.replace(" : IMaterialType", ""), "faulty.slang: no struct implements IMaterialType"),
        ("float one() { return 1; }", "faulty.slang: no struct implements IMaterialType"),
        (PLAIN.replace("evaluate", "evaluated"), "faulty.slang:3: .*required interface member 'evaluate'"),
        (PLAIN + PLAIN.split("type;")[1].replace("Plain", "Other"), "faulty.slang: 2 structs implement"),
        ("module faulty;" + PLAIN, "faulty.slang: struct Plain is not visible"),
        (PLAIN.replace("{\n", "{\n    struct Parameters { float4x4 m; }\n", 1), "parameter 'm' is not a float"),
        (PLAIN.replace("{\n", "{\n    struct Parameters { float4 a, b, c, d, e; }\n", 1), "20 numbers, more than 16"),
    ],
)
def test_faults_in_a_file_are_one_line(device, register, source, fault):
    register("faulty", source)
    message = shown(device, Material(type="faulty"))
    assert message.startswith("material type 'faulty': ")
    assert re.search(fault, message), message


@pytest.mark.parametrize(
    ("parameters", "fault"),
    [
        ({}, "lacks 'holes', 'radius'; its parameters are 'holes', 'radius'"),
        ({"holes": 1, "radius": 1, "color": 2}, "has no 'color'"),
        ({"holes": (1, 2), "radius": 1}, r"parameter 'holes' is \(1, 2\), but must be a number"),
        ({"holes": 1, "radius": "big"}, "parameter 'radius' is 'big', but must be a number"),
    ],
)
def test_parameters_must_fit(device, own_types, parameters, fault):
    assert re.search(fault, shown(device, perforated(parameters=parameters)))


def test_standard_materials_take_no_parameters(device):
    assert "has no 'scale'" in shown(device, Material("wood", parameters={"scale": 1}))


def test_textures_reach_a_type(device, own_types):
    pictures = []
    for material in (textured(type="textured"), textured()):
        wall = placed(plane(2, 2, material), rotate("x", 90))
        pictures.append(render(device, scene_of(wall), 1, FRONT, (32, 32), SURFACES).aov("albedo"))
    np.testing.assert_array_equal(*pictures)
    assert pictures[0].std() > 0.1


LATE = """
import sys
import pica
from pica.errors import MaterialTypeError
from pica.programs.material_types import STANDARD_ONLY, made
from pica.programs.recipes import ForTypesRecipe
from pica.rhi.device import open_device
from pica.rhi.recipes import ComputeRecipe
from pica.scene.material_registry import material_source
pica.register_material("plain", sys.argv[1])
try:
    recipe = ForTypesRecipe(ComputeRecipe("effects/gbuffer/resolve.slang"))
    made(open_device(), recipe, (*STANDARD_ONLY, material_source("plain")))
except MaterialTypeError as error:
    print(error)
"""
ENDLESS = """interface I { float v(); }
struct W<T : I> : I { T t; float v() { return t.v(); } }
struct A : I { float v() { return 1; } }
float f<T : I>(T t, int n) { if (n > 0) { W<T> w; w.t = t; return f(w, n - 1); } return t.v(); }"""


@pytest.mark.parametrize(
    ("function", "call", "fault"),
    [
        ("float f(float x) { return x > 9 ? x : f(x + 1); }", "f(surface.position.x)", "3: recursion detected"),
        (ENDLESS, "f(A(), 3)", "4: generic specialization .* exceeded"),
    ],
)
def test_what_slang_finds_when_it_makes_a_program_is_the_types_fault(device, tmp_path, function, call, fault):
    """In a process of its own, as Slang gives up."""
    file = tmp_path / "plain.slang"
    file.write_text(PLAIN.replace("struct", f"{function}\nstruct", 1).replace("0.25", call))
    done = subprocess.run([sys.executable, "-c", LATE, str(file)], capture_output=True, text=True, timeout=200)
    assert re.fullmatch(rf"material type 'plain': .*plain.slang:{fault}.*\n", done.stdout), done.stdout + done.stderr

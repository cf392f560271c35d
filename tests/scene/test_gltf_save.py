"""Scene.save: what is loaded again is the same scene, and is saved as the same bytes."""

import json
import subprocess
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pica
from pica.errors import PicaError, SceneError
from pica.scene.animation import Animation, Channel, Pose
from pica.scene.camera import Camera
from pica.scene.dynamic_vertices import DynamicVertices
from pica.scene.environment import Environment
from pica.scene.light import (
    DirectionalLight,
    DiskLight,
    Light,
    PointLight,
    RectangleLight,
    SphereLight,
    SpotLight,
    TubeLight,
)
from pica.scene.loading import load
from pica.scene.material import Image, Material, Texture
from pica.scene.mesh import Mesh, Section
from pica.scene.model import Scene
from pica.scene.node import Node
from pica.scene.primitives import spheres
from pica.scene.skin import Skin
from tests.assets import ASSETS, needs_assets
from tests.scene.saved_scenes import SUN, check_node, check_same, content, saved, shown, triangle
from tests.unprivileged import needs_unprivileged, unprivileged

BUILT_IN: dict[str, Callable[[], Scene]] = {
    "cornell": pica.scenes.cornell,
    "court": pica.scenes.court,
    "rooms": pica.scenes.rooms,
    "sphere_grid": pica.scenes.sphere_grid,
    "corridor": pica.scenes.corridor,
    "showroom": pica.scenes.showroom,
    "machine_world": lambda: pica.scenes.machine_world(glass=True),
}
FILES = (
    "Fox.glb", "SimpleSkin.gltf", "BoxAnimated.gltf", "AnisotropyBarnLamp.gltf", "MixedLightingExample.gltf",
    "glass-table.gl*", "morph-stress-test.gl*", "AnimatedMorphCube.gltf", "TextureTransformTest.gltf", "Cameras.gltf",
    "ClearCoatTest.gltf",
)  # fmt: skip
SUFFIXES = (".glb", ".gltf")


@pytest.mark.parametrize("name", BUILT_IN)
def test_built_in_scenes(name: str, tmp_path: Path) -> None:
    check_same(BUILT_IN[name](), tmp_path)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_textures_in_either_kind_of_file(suffix: str, tmp_path: Path) -> None:
    pixels = np.arange(4 * 3 * 4, dtype=np.uint8).reshape(4, 3, 4)
    texture = Texture(Image(pixels, "four by three"))
    check_same(shown(Node(mesh=Mesh([triangle(Material(base_color_texture=texture))]))), tmp_path, suffix)
    names = set(content(tmp_path / "first"))
    assert names == ({"model.glb"} if suffix == ".glb" else {"model.gltf", "model.bin", "model-0.png"})


@needs_assets
@pytest.mark.filterwarnings("ignore:.*(neutral sky|variants)")
@pytest.mark.parametrize("name", FILES)
def test_files(name: str, tmp_path: Path) -> None:
    found = sorted(ASSETS.rglob(name))
    if not found:
        pytest.skip(f"there is no {name}")
    check_same(load(found[0]), tmp_path)


def test_transforms_that_mirror_shear_and_turn(tmp_path: Path) -> None:
    sheared = np.array([[1, 0.5, 0, 0.1], [0, 2, 0.25, 0.2], [0, 0, -1, 1 / 3], [0, 0, 0, 1]])
    scene = Scene("tree", Environment(np.full((2, 4, 3), 0.7), strength=2.0, rotation=0.5, name="grey"))
    scene.background = (0.1, 1 / 3, 2.0)
    top = scene.add(Node("top", extras={"class": "rock", "size": [1, 2.5]}))
    top.transform = sheared
    turned = top.add(
        Node("turned", pose=Pose(np.array([1, 2, 3.0]), np.array([0.5, 0.5, 0.5, 0.5]), np.array([1, -1, 3.0])))
    )
    mesh = Mesh([triangle()], "shared")
    turned.add(Node("left", mesh=mesh))
    top.add(Node("right", mesh=mesh, visible_to_camera=False, casts_shadows=False, lighting_channels=frozenset({1, 4})))
    scene.add(Node("last", mesh=mesh, visible_to_reflections=False))
    loaded = check_same(scene, tmp_path)
    assert loaded.roots[0].children[1].mesh is loaded.roots[1].mesh
    assert loaded.roots[0].pose is None and loaded.roots[0].children[0].pose is not None


def test_a_background_of_its_own(tmp_path: Path) -> None:
    scene = shown(Node(mesh=Mesh([triangle()])))
    radiance = np.arange(2 * 4 * 3, dtype=np.float32).reshape(2, 4, 3)
    scene.background = Environment(radiance, strength=0.5, rotation=1.0, name="clouds")
    assert isinstance(check_same(scene, tmp_path).background, Environment)


def test_attributes_of_vertices(tmp_path: Path) -> None:
    random = np.random.default_rng(1)
    material = Material(normal_texture=Texture.from_array(np.full((2, 2, 3), 128, np.uint8), encoding="linear"))
    whole = triangle(
        material,
        normals=random.normal(size=(3, 3)),
        tangents=np.column_stack([random.normal(size=(3, 3)), [1, -1, 1]]),
        uv=random.random((3, 2)),
        uv1=random.random((3, 2)),
        colors=random.random((3, 4)),
    )
    own_tangents = triangle(normals=random.normal(size=(3, 3)), tangents=random.normal(size=(3, 4)))
    node = check_node(Node(mesh=Mesh([whole, own_tangents, triangle(smooth=False)])), tmp_path)
    assert node.mesh is not None
    assert [section.flat for section in node.mesh.sections] == [False, False, True]
    assert node.mesh.sections[0].material.normal_texture is not None


def test_vertices_and_triangles_that_show_nothing_are_left_out(tmp_path: Path) -> None:
    positions = [[9, 9, 9], [0, 0, 0], [1, 0, 0], [0, 1, 0]]
    section = Section.from_arrays(positions, [[1, 2, 3], [1, 1, 2]], normals=[[0, 0, 1]] * 4)
    empty = Section.from_arrays(positions, np.zeros((0, 3), int))
    loaded = saved(shown(Node(mesh=Mesh([section, empty]))), tmp_path)
    assert loaded.roots[1].mesh is not None
    (only,) = loaded.roots[1].mesh.sections
    np.testing.assert_array_equal(only.positions, positions[1:])


LIGHTS: list[Light] = [
    DirectionalLight((1.0, 0.9, 0.1), 3.0, 0.0093, "sun", shadow_denoiser="off"),
    PointLight((0.1, 0.2, 1.3), 7.7, 0.1, 12.0, lighting_channels=frozenset({2})),
    SpotLight(inner_cone_angle=0.1, outer_cone_angle=0.7, radius=0.2, range=3.0),
    RectangleLight((0.1, 0.2, 0.3), 5.0, 2.0, 0.3, "panel", shadow_denoiser="svgf"),
    DiskLight(radiance=0.1, radius=2.3),
    SphereLight(radius=0.3, lighting_channels=frozenset({0, 5})),
    TubeLight(length=2.2, radius=0.01, name="tube"),
]


@pytest.mark.filterwarnings("ignore:.*shows nothing")
@pytest.mark.parametrize("light", LIGHTS, ids=lambda light: type(light).__name__)
@pytest.mark.parametrize("channels", [frozenset(range(6)), frozenset({1})], ids=["all", "one"])
def test_lights(light: Light, channels: frozenset[int], tmp_path: Path) -> None:
    check_node(Node("lamp", light=light, lighting_channels=channels, extras={"own": {"x": 1}}), tmp_path)


CAMERAS = [
    Camera(np.eye(4), vertical_fov=0.7, near=0.1, name="a"),
    Camera(np.eye(4), vertical_fov=1.1, principal_point=(0.4, 0.7), pixel_aspect=1.2),
    Camera(np.eye(4), orthographic_height=3.3, near=0.0, far=70.0, pixel_aspect=0.9),
    Camera(np.eye(4), f_number=2.8, focus_distance=3.0, sensor_height=0.0157, aperture_blades=6),
]


@pytest.mark.filterwarnings("ignore:.*shows nothing")
@pytest.mark.parametrize("camera", CAMERAS, ids=["plain", "calibrated", "orthographic", "aperture"])
def test_cameras(camera: Camera, tmp_path: Path) -> None:
    check_node(Node("eye", camera=camera), tmp_path)


def test_skins_morph_targets_and_animations(tmp_path: Path) -> None:
    random = np.random.default_rng(2)
    corners = np.arange(300).reshape(-1, 3)
    section = Section.from_arrays(random.normal(size=(300, 3)), corners)
    section.joints = random.integers(0, 2, (300, 5)).astype(np.uint16)
    weights = random.random((300, 5)).astype(np.float32)
    section.weights = weights / weights.sum(axis=1, keepdims=True)
    for name in ("morph_positions", "morph_normals", "morph_tangents"):
        setattr(section, name, random.normal(size=(2, 300, 3)).astype(np.float32))
    root = Node("root", pose=Pose())
    joints = [root.add(Node(f"joint {number}", pose=Pose(np.full(3, float(number))))) for number in range(2)]
    body = root.add(Node("body", mesh=Mesh([section], "body")))
    body.weights = np.array([0.3, 0.7])
    scene = shown(root)
    body.skin = Skin(joints, random.normal(size=(2, 4, 4)) * [[1], [1], [1], [0]] + np.diag([0, 0, 0, 1.0]), "bones")
    times = np.array([0.0, 0.1, 2.0])
    turns = random.normal(size=(3, 3, 4))
    scene.animations = [
        Animation(
            [
                Channel(joints[0], "translation", times, random.normal(size=(3, 3)), "STEP"),
                Channel(joints[1], "rotation", times, turns, "CUBICSPLINE"),
                Channel(body, "weights", times, random.random((3, 3, 2)), "CUBICSPLINE"),
                Channel(root, "scale", times, random.random((3, 3))),
            ],
            "walk",
            duration=7.5,
        ),
        Animation([Channel(joints[0], "scale", times[:1], random.random((1, 3)))], "pose"),
    ]
    check_same(scene, tmp_path)


def matrices(*, shear: bool) -> np.ndarray:
    random = np.random.default_rng(3)
    made = np.tile(np.eye(4), (50, 1, 1))
    made[:, :3, :3] = np.linalg.qr(random.normal(size=(50, 3, 3)))[0] * random.uniform(0.1, 3, (50, 1, 3))
    made[:3, :3, :3] = [np.eye(3), np.diag([-1, -1, 1.0]), [[0, 0, 1], [1, 0, 0], [0, 1, 0.0]]]
    made[:, :3, 3] = random.normal(size=(50, 3))
    made[:, 0, 1] += shear
    return made


@pytest.mark.parametrize("shear", [False, True])
def test_copies(shear: bool, tmp_path: Path) -> None:
    copies = matrices(shear=shear)
    node = saved(shown(Node(mesh=Mesh([triangle()]), instances=copies)), tmp_path, ".gltf").roots[1]
    assert node.instances is not None
    np.testing.assert_allclose(node.instances, copies, atol=1e-6)
    used = json.loads((tmp_path / "first" / "model.gltf").read_text()).get("extensionsUsed", [])
    assert ("EXT_mesh_gpu_instancing" in used) is not shear


def test_what_has_no_place_is_named_once_for_each_kind(tmp_path: Path) -> None:
    scene = Scene("mixed")
    scene.add(Node("sun", light=SUN))
    ball = scene.add(
        Node("ball", mesh=Mesh([triangle()], primitives=[spheres([[0, 0, 0], [1, 0, 0]], 0.1, Material())]))
    )
    ball.extras["array"] = object()
    cloth = scene.add(Node("cloth", mesh=Mesh([triangle()])))
    moved = [[0, 0, 5], [1, 0, 5], [0, 1, 5]]
    DynamicVertices(cloth).set(moved)
    scene.add(Node("own", mesh=Mesh([triangle(Material(type="mine"))])))
    scene.animations = [Animation([], "by code", drivers=[lambda time: None])]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        scene.save(tmp_path / "mixed.glb")
    lines = [str(warning.message) for warning in caught]
    for kind in ("primitives that are not triangles (2)", "extras", "deformations", "material types", "animations by"):
        (line,) = [line for line in lines if kind in line]
        assert line.startswith(f"{tmp_path / 'mixed.glb'}: left out ") and "\n" not in line
    assert len(lines) == 5
    loaded = {node.name: node for node in load(tmp_path / "mixed.glb").nodes()}
    assert loaded["cloth"].mesh is not None and loaded["ball"].mesh is not None
    np.testing.assert_array_equal(loaded["cloth"].mesh.sections[0].positions, moved)


@pytest.mark.filterwarnings("ignore:.*left out")
def test_particles_and_landscapes_are_left_out_and_the_rest_loads(tmp_path: Path) -> None:
    scene = pica.scenes.landscape(plants=50)
    loaded = saved(scene, tmp_path)
    assert [node.name for node in loaded.nodes()] == [node.name for node in scene.nodes()]


def test_binary_files_are_whole_and_aligned(tmp_path: Path) -> None:
    pica.scenes.cornell().save(str(tmp_path / "box.GLB"))
    content = (tmp_path / "box.GLB").read_bytes()
    length, text = (int.from_bytes(content[at : at + 4], "little") for at in (8, 12))
    assert content[:4] == b"glTF" and length == len(content) and text % 4 == 0
    root = json.loads(content[20 : 20 + text])
    for view in root["bufferViews"]:
        assert view["byteOffset"] % 4 == 0
    position = root["accessors"][root["meshes"][0]["primitives"][0]["attributes"]["POSITION"]]
    assert len(position["min"]) == 3 and position["min"] != position["max"]


@pytest.mark.parametrize("name", ["x.obj", "x", "x.glb.zip"])
def test_another_suffix(name: str, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"must end in \.glb or \.gltf$"):
        pica.scenes.cornell().save(tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_what_is_no_path() -> None:
    with pytest.raises(SceneError, match=r"save: 5 is not the path of a file"):
        pica.scenes.cornell().save(5)  # type: ignore[arg-type]


def test_an_existing_file_is_replaced_and_a_folder_is_not(tmp_path: Path) -> None:
    (tmp_path / "box.glb").write_text("old")
    pica.scenes.cornell().save(tmp_path / "box.glb")
    assert load(tmp_path / "box.glb").triangle_count() == 36
    (tmp_path / "folder.glb").mkdir()
    for path in (tmp_path / "folder.glb", tmp_path / "missing" / "box.glb"):
        with pytest.raises(PicaError) as caught:
            pica.scenes.cornell().save(path)
        assert str(path) in str(caught.value) and "\n" not in str(caught.value)
    assert [path.name for path in sorted(tmp_path.iterdir())] == ["box.glb", "folder.glb"]


@needs_unprivileged
def test_a_read_only_folder(tmp_path: Path) -> None:
    tmp_path.chmod(0o555)
    program = f"import pica; pica.scenes.cornell().save({str(tmp_path / 'box.glb')!r})"
    run = subprocess.run(unprivileged([sys.executable, "-c", program]), capture_output=True, text=True, timeout=120)
    tmp_path.chmod(0o755)
    assert run.stderr.splitlines()[-1].endswith(
        f"PicaError: {tmp_path / 'box.glb'}: cannot be written (Permission denied)"
    )
    assert not list(tmp_path.iterdir())


def edited(folder: Path, **pica_keys: Any) -> Path:
    """A saved scene whose JSON has other values in extras.pica, by the place: array, or the first entry of one."""
    texture = Texture(Image(np.zeros((1, 1, 4), np.uint8), encoding="linear"), transform=(1.0, 0.1, 0.0, 0.0, 1.0, 0.0))
    scene = Scene("all", Environment(np.ones((2, 4, 3))))
    scene.add(Node(mesh=Mesh([triangle(Material(base_color_texture=texture))]), camera=CAMERAS[1], light=LIGHTS[0]))
    path = folder / "model.gltf"
    scene.save(path)
    root = json.loads(path.read_text())
    for array, values in pica_keys.items():
        root[array][0].setdefault("extras", {}).setdefault("pica", {}).update(values)
    path.write_text(json.dumps(root))
    return path


FAULTS: dict[str, tuple[str, dict[str, Any], str]] = {
    "row of the environment": ("scenes", {"environment": {"radiance": 0, "width": 5}}, "are no rows of 5"),
    "row of the background": ("scenes", {"background": {"radiance": 0, "width": 5}}, "are no rows of 5"),
    "background below black": ("scenes", {"background": [0, -1, 0]}, "-1 is not a number from 0 to"),
    "environment without pixels": ("scenes", {"environment": {"width": 4}}, "radiance: is missing"),
    "coat": ("materials", {"coats": [{"ior": 0.5}]}, r"coats\[0\].ior: 0.5"),
    "coats": ("materials", {"coats": [{}] * 4}, "4 coats are more than 3"),
    "coefficient": ("materials", {"absorption": [1, -1, 0]}, "absorption"),
    "encoding": ("images", {"encoding": "gamma"}, "encoding: 'gamma' is not one of srgb, linear"),
    "width of pixels": ("cameras", {"pixel_aspect": 0}, "pixel_aspect"),
    "copies": ("nodes", {"instances": 99}, "instances: 99 is out of range"),
    "channel": ("nodes", {"light_channels": [6]}, "light_channels"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_faults_in_keys_of_extras(name: str, tmp_path: Path) -> None:
    array, values, fault = FAULTS[name]
    path = edited(tmp_path, **{array: values})
    with pytest.raises(SceneError, match=fault) as caught:
        load(path)
    assert str(caught.value).startswith(str(path)) and "\n" not in str(caught.value)


def test_the_environment_of_a_file_counts_against_the_limits_and_another_one_replaces_it(tmp_path: Path) -> None:
    path = edited(tmp_path)
    with pytest.raises(SceneError, match=r"extras\.pica\.environment"):
        load(path, limits=pica.Limits(pixels=7))
    other = Environment(np.zeros((1, 2, 3)))
    assert load(path, environment=other).environment is other

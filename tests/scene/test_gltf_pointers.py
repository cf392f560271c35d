"""KHR_animation_pointer: what animations set besides nodes' transforms and weights."""

import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pica.errors import SceneError
from pica.scene.animation import Animation
from pica.scene.coat import Coat
from pica.scene.field_channel import FieldChannel
from pica.scene.gltf import read
from pica.scene.light import PointLight
from pica.scene.material import Material
from pica.scene.model import Node, Scene
from tests.scene.gltf_files import GltfFile

LIGHTS, VISIBILITY = "KHR_lights_punctual", "KHR_node_visibility"


def lamp(**material: Any) -> GltfFile:
    """A file with a triangle of one material."""
    file = GltfFile()
    file.add("materials", **material)
    file.mesh(material=0, node={"name": "thing"})
    return file


def animate(
    file: GltfFile, pointer: str, values: Any, times: Any = (0, 1), interpolation: str = "LINEAR", dtype: str = "f4"
) -> None:
    """Add a channel to the file's one animation."""
    if "animations" not in file.json:
        file.add("animations", samplers=[], channels=[])
    (animation,) = file.json["animations"]
    sampler = {"input": file.accessor(times), "output": file.accessor(values, dtype), "interpolation": interpolation}
    target = {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": pointer}}}
    animation["channels"].append({"sampler": len(animation["samplers"]), "target": target})
    animation["samplers"].append(sampler)


def loaded(file: GltfFile, folder: Path) -> Scene:
    file.json["extensionsUsed"] = ["KHR_animation_pointer"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return read(file.write(folder))


def node(scene: Scene, name: str = "thing") -> Node:
    (found,) = (node for node in scene.nodes() if node.name == name)
    return found


def material(scene: Scene) -> Material:
    mesh = node(scene).mesh
    assert mesh is not None
    return mesh.sections[0].material


def field(holder: Any, name: str) -> Any:
    for part in name.split("."):
        holder = holder[int(part)] if isinstance(holder, tuple) else getattr(holder, part)
    return holder


EXTENSION = "extensions/KHR_materials_"
FACTORS = [
    ("pbrMetallicRoughness/baseColorFactor", [[1, 0, 0, 1], [0, 1, 0, 0]], "base_color", (0.75, 0.25, 0, 0.75)),
    ("pbrMetallicRoughness/metallicFactor", [0, 1], "metallic", 0.25),
    ("pbrMetallicRoughness/roughnessFactor", [1, 0], "roughness", 0.75),
    ("emissiveFactor", [[0, 0, 0], [1, 0.5, 0]], "emission", (0.25, 0.125, 0)),
    ("alphaCutoff", [0, 1], "alpha_cutoff", 0.25),
    (f"{EXTENSION}clearcoat/clearcoatFactor", [0, 1], "coats.0.strength", 0.25),
    (f"{EXTENSION}clearcoat/clearcoatRoughnessFactor", [0, 1], "coats.0.roughness", 0.25),
    (f"{EXTENSION}anisotropy/anisotropyStrength", [0, 1], "anisotropy.strength", 0.25),
    (f"{EXTENSION}anisotropy/anisotropyRotation", [0, -8], "anisotropy.rotation", -2),
    (f"{EXTENSION}iridescence/iridescenceFactor", [0, 1], "iridescence.strength", 0.25),
    (f"{EXTENSION}iridescence/iridescenceThicknessMaximum", [0, 400], "iridescence.thickness_maximum", 100),
    (f"{EXTENSION}sheen/sheenColorFactor", [[0, 0, 0], [1, 0, 0]], "sheen.color", (0.25, 0, 0)),
    (f"{EXTENSION}transmission/transmissionFactor", [0, 1], "transmission", 0.25),
    (f"{EXTENSION}ior/ior", [1, 2], "ior", 1.25),
    (f"{EXTENSION}specular/specularColorFactor", [[1, 1, 1], [1, 1, 5]], "specular_color", (1, 1, 2)),
    (f"{EXTENSION}dispersion/dispersion", [0, 4], "dispersion", 1),
    (f"{EXTENSION}diffuse_transmission/diffuseTransmissionFactor", [0, 1], "diffuse_transmission", 0.25),
]


@pytest.mark.parametrize(("key", "values", "name", "expected"), FACTORS, ids=[case[2] for case in FACTORS])
def test_factors_of_materials(key: str, values: Any, name: str, expected: Any, tmp_path: Path) -> None:
    file = lamp()
    animate(file, f"/materials/0/{key}", values)
    scene = loaded(file, tmp_path)
    scene.animate(0.25)
    assert field(material(scene), name) == pytest.approx(expected)
    scene.animate(9)
    last = np.reshape(values[-1], -1)
    np.testing.assert_allclose(np.reshape(field(material(scene), name), -1), last, atol=1e-6)


def test_the_strength_of_emission_multiplies_its_factor(tmp_path: Path) -> None:
    file = lamp(emissiveFactor=[1, 0.5, 0])
    animate(file, f"/materials/0/{EXTENSION}emissive_strength/emissiveStrength", [0, 100])
    scene = loaded(file, tmp_path)
    scene.animate(0.5)
    assert material(scene).emission == pytest.approx((50, 25, 0))
    animate(file, "/materials/0/emissiveFactor", [[0, 0, 0], [1, 1, 1]])
    scene = loaded(file, tmp_path)
    scene.animate(0.3)
    assert material(scene).emission == pytest.approx((9, 9, 9), abs=0.007)  # linear pieces of a square


def test_attenuation_of_a_volume(tmp_path: Path) -> None:
    volume = {"thicknessFactor": 1, "attenuationColor": [0.5, 1, 1], "attenuationDistance": 1}
    file = lamp(extensions={"KHR_materials_volume": volume})
    animate(file, f"/materials/0/{EXTENSION}volume/attenuationDistance", [1, 2])
    scene = loaded(file, tmp_path)
    scene.animate(1)
    assert material(scene).absorption == pytest.approx((math.log(2) / 2, 0, 0), rel=1e-4)
    scene.animate(0.5)
    assert material(scene).absorption == pytest.approx((math.log(2) / 1.5, 0, 0), rel=1e-3)


def textured() -> GltfFile:
    file = lamp(
        pbrMetallicRoughness={
            "baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform": {"scale": [2, 3]}}}
        }
    )
    file.add("textures", source=0)
    pixel = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
    file.add("images", uri=f"data:image/png;base64,{pixel}")
    return file


def test_texture_transforms(tmp_path: Path) -> None:
    info = "/materials/0/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform"
    file = textured()
    animate(file, f"{info}/offset", [[0, 0], [4, 8]])
    scene = loaded(file, tmp_path)
    image = material(scene).base_color_texture.image  # type: ignore[union-attr]
    scene.animate(0.25)
    moved = material(scene).base_color_texture
    assert moved is not None and moved.image is image
    assert moved.transform == pytest.approx((2, 0, 1, 0, 3, 2))
    animate(file, f"{info}/rotation", [0, math.pi])
    scene = loaded(file, tmp_path)
    scene.animate(0.5)
    turned = material(scene).base_color_texture
    assert turned is not None and turned.transform == pytest.approx((0, 3, 2, -2, 0, 4), abs=1e-6)
    scene.animate(0.5 + 1 / 128)  # in the middle of a linear piece
    angle = math.pi * (0.5 + 1 / 128)
    turned = material(scene).base_color_texture
    assert turned is not None and turned.transform[0] == pytest.approx(2 * math.cos(angle), abs=1e-3)


def test_interpolations(tmp_path: Path) -> None:
    key = "/materials/0/pbrMetallicRoughness/roughnessFactor"
    file = lamp()
    animate(file, key, [0.2, 0.8], interpolation="STEP")
    scene = loaded(file, tmp_path)
    scene.animate(0.99)
    assert material(scene).roughness == pytest.approx(0.2)
    scene.animate(1)
    assert material(scene).roughness == pytest.approx(0.8)
    file = lamp()
    animate(file, key, [0, 0, 0, 0, 1, 0], interpolation="CUBICSPLINE")
    scene = loaded(file, tmp_path)
    scene.animate(0.25)
    assert material(scene).roughness == pytest.approx(3 * 0.25**2 - 2 * 0.25**3)
    file = lamp()
    animate(file, key, [0, 0.5, 9, -9, 0.5, 0], interpolation="CUBICSPLINE")
    scene = loaded(file, tmp_path)
    scene.animate(0.5)
    assert material(scene).roughness == 1  # the spline is at 2.75 there


def test_lights_that_nodes_share(tmp_path: Path) -> None:
    spot = {"type": "spot", "intensity": 10, "range": 5, "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.2}}
    file = lamp()
    file.json["extensions"] = {LIGHTS: {"lights": [spot, {"type": "directional", "intensity": 3}]}}
    for name, light in (("a", 0), ("b", 0), ("sun", 1)):
        file.add("nodes", name=name, extensions={LIGHTS: {"light": light}})
    base = f"/extensions/{LIGHTS}/lights"
    animate(file, f"{base}/0/intensity", [0, 100])
    animate(file, f"{base}/0/color", [[1, 1, 1], [0, 1, 0]])
    animate(file, f"{base}/0/range", [1, 3])
    animate(file, f"{base}/0/spot/innerConeAngle", [0.1, 0.5])
    animate(file, f"{base}/0/spot/outerConeAngle", [0.2, 0.4])
    animate(file, f"{base}/1/intensity", [3, 5])
    scene = loaded(file, tmp_path)
    scene.animate(0.5)
    for name in ("a", "b"):
        light: Any = node(scene, name).light
        assert (light.intensity, light.color, light.range) == pytest.approx((50, pytest.approx((0.5, 1, 0.5)), 2))
        assert light.outer_cone_angle == pytest.approx(0.3)
        assert light.inner_cone_angle < light.outer_cone_angle
    assert node(scene, "sun").light.illuminance == pytest.approx(4)  # type: ignore[union-attr]
    scene.animate(1)
    assert node(scene, "a").light.inner_cone_angle < 0.4  # type: ignore[union-attr]


def test_cameras(tmp_path: Path) -> None:
    file = lamp()
    wide = file.add("cameras", type="perspective", perspective={"yfov": 1, "znear": 0.1})
    flat = file.add("cameras", type="orthographic", orthographic={"xmag": 2, "ymag": 2, "znear": 0, "zfar": 9})
    file.add("nodes", name="wide", camera=wide)
    file.add("nodes", name="flat", camera=flat)
    animate(file, "/cameras/0/perspective/yfov", [1, 0.5])
    animate(file, "/cameras/1/orthographic/ymag", [2, 4])
    scene = loaded(file, tmp_path)
    scene.animate(0.5)
    assert scene.cameras()[0].vertical_fov == pytest.approx(0.75)
    assert scene.cameras()[1].orthographic_height == pytest.approx(6)


def hiding(initially: bool) -> GltfFile:
    """A node with a mesh and a light below one whose visibility is animated."""
    file = lamp()
    file.json["extensions"] = {LIGHTS: {"lights": [{"type": "point", "intensity": 7}]}}
    file.json["nodes"][0]["extensions"] = {LIGHTS: {"light": 0}}
    file.add("nodes", name="above", children=[0], extensions={VISIBILITY: {"visible": initially}})
    animate(file, f"/nodes/1/extensions/{VISIBILITY}/visible", [1, 0, 1], (0, 1, 2), "STEP", "u1")
    return file


def seen(scene: Scene) -> list[Any]:
    thing: Any = node(scene)
    return [thing.visible_to_camera, thing.visible_to_reflections, thing.casts_shadows, thing.light.intensity]


@pytest.mark.parametrize("initially", [True, False])
def test_visibility_of_nodes_and_all_below_them(initially: bool, tmp_path: Path) -> None:
    file = hiding(initially)
    scene = loaded(file, tmp_path)
    assert seen(scene) == [initially] * 3 + [7 * initially]
    for time, expected in ((0.5, True), (1.5, False), (2.0, True)):
        scene.animate(time)
        assert seen(scene) == [expected] * 3 + [7 * expected]
    animate(file, f"/extensions/{LIGHTS}/lights/0/intensity", [0, 100], (0, 2))
    scene = loaded(file, tmp_path)
    scene.animate(0.999)
    assert seen(scene)[3] == pytest.approx(49.95)
    scene.animate(1.5)
    assert seen(scene)[3] == 0


def test_pointers_at_properties_of_nodes_are_their_channels(tmp_path: Path) -> None:
    file = lamp()
    animate(file, "/nodes/0/translation", [[0, 0, 0], [2, 0, 0]])
    scene = loaded(file, tmp_path)
    scene.animate(0.5)
    np.testing.assert_allclose(node(scene).world[:3, 3], [1, 0, 0])


@pytest.mark.parametrize(
    ("pointer", "named"),
    [
        (f"/materials/0/{EXTENSION}volume/thicknessFactor", f"/materials/{{}}/{EXTENSION}volume/thicknessFactor"),
        ("/materials/7/alphaCutoff", "/materials/{}/alphaCutoff"),
        ("/meshes/0/weights", "/meshes/{}/weights"),
        ("/nodes/0/extensions/EXT_other/x", "/nodes/{}/extensions/EXT_other/x"),
    ],
)
def test_what_does_not_map_is_named_and_left_out(pointer: str, named: str, tmp_path: Path) -> None:
    file = lamp()
    animate(file, pointer, [0, 1])
    animate(file, "/materials/0/pbrMetallicRoughness/metallicFactor", [0, 1])
    with pytest.warns(UserWarning, match=f"model.gltf: animates {named}, which is left out$".replace("{}", r"\{\}")):
        scene = read(file.write(tmp_path))
    scene.animate(1)
    assert material(scene).metallic == 1


def test_faults_of_keys_are_named(tmp_path: Path) -> None:
    file = lamp()
    animate(file, "/materials/0/pbrMetallicRoughness/metallicFactor", [0, 1, 2])
    with pytest.raises(SceneError, match=r"samplers\[0\].output: 3 elements do not fit 2 keys of '/materials/0/pbr"):
        read(file.write(tmp_path))
    file = lamp()
    animate(file, "/materials/0/pbrMetallicRoughness/baseColorFactor", [[0, 1], [2, 3]])
    with pytest.raises(SceneError, match=r"samplers\[0\].output: must be VEC4, not VEC2"):
        read(file.write(tmp_path))


def test_saved_animations_of_fields_are_the_same(tmp_path: Path) -> None:
    file = textured()
    file.json["materials"][0]["emissiveFactor"] = [1, 1, 1]
    light = {"type": "point", "intensity": 1}
    file.json["extensions"] = {LIGHTS: {"lights": [light]}}
    for name in ("a", "b"):
        file.add("nodes", name=name, extensions={LIGHTS: {"light": 0}})
    file.add("cameras", type="perspective", perspective={"yfov": 1, "znear": 0.1})
    file.add("nodes", name="eye", camera=0)
    info = "/materials/0/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform"
    animate(file, f"{info}/rotation", [0, 2])
    animate(file, f"{info}/offset", [[0, 0], [1, 1]])
    animate(file, "/materials/0/pbrMetallicRoughness/roughnessFactor", [0.25, 0.75], interpolation="STEP")
    animate(file, f"/materials/0/{EXTENSION}emissive_strength/emissiveStrength", [1, 30])
    animate(file, f"/extensions/{LIGHTS}/lights/0/intensity", [1, 9])
    animate(file, "/cameras/0/perspective/yfov", [1, 0.5])
    scene = loaded(file, tmp_path)
    node(scene, "b").light = PointLight(intensity=1.0, name="a")
    scene.animations = [
        Animation([channel for channel in scene.animations[0].channels if channel.target[0] is not node(scene, "b")])
    ]
    scene.save(tmp_path / "saved.glb")
    again = read(tmp_path / "saved.glb")
    for time in (0.0, 0.3, 1.0):
        scene.animate(time)
        again.animate(time)
        ours, theirs = material(scene), material(again)
        assert theirs.roughness == ours.roughness
        assert theirs.emission == pytest.approx(ours.emission)
        assert ours.base_color_texture is not None and theirs.base_color_texture is not None
        assert theirs.base_color_texture.transform == pytest.approx(ours.base_color_texture.transform, abs=1e-3)
        assert node(again, "a").light.intensity == pytest.approx(node(scene, "a").light.intensity)  # type: ignore[union-attr]
        assert node(again, "b").light.intensity == 1  # type: ignore[union-attr]
        assert again.cameras()[0].vertical_fov == pytest.approx(scene.cameras()[0].vertical_fov)


def test_animations_that_gltf_has_no_place_for_are_named_when_saved(tmp_path: Path) -> None:
    scene = loaded(hiding(True), tmp_path)
    with pytest.warns(UserWarning, match=r"left out animations of fields \(3\), for which glTF has no place"):
        scene.save(tmp_path / "saved.glb")


def test_channels_of_fields_in_code() -> None:
    paint, thing = Material(coats=(Coat(),)), Node("lamp", light=PointLight())
    times, values = np.array([0.0, 1.0]), np.array([[0.0], [1.0]])
    move = Animation(
        [
            FieldChannel(paint, "coats.0.roughness", times, values),
            FieldChannel(thing, "light.color", times, np.array([[0.0, 0, 0], [1, 2, 3]])),
            FieldChannel(thing, "visible_to_camera", times, values, "STEP"),
        ]
    )
    scene = Scene()
    scene.add(thing)
    changes = scene.subscribe()
    move.apply(0.5)
    assert paint.coats[0].roughness == 0.5
    assert thing.light.color == (0.5, 1, 1.5)  # type: ignore[union-attr]
    assert thing.visible_to_camera is False
    assert changes.take().altered == [thing]
    move.apply(0.5)
    assert not changes.take().any()


@pytest.mark.parametrize(
    ("holder", "name", "values", "fault"),
    [
        (Material(), "rougness", [[0.0]], "field channel: rougness: material has no rougness"),
        (Material(), "sheen.color", [[0.0]], "field channel: sheen.color: None has no color"),
        (Material(), "coats.0.roughness", [[0.0]], r"\(\) has no 0$"),
        (
            Material(),
            "base_color",
            [[0.0]],
            r"values: of the shape \(1, 1\) do not go with 1 times, LINEAR and base_color",
        ),
        (Material(), "name", [[0.0]], "field channel: name of material holds no numbers"),
        (Scene(), "name", [[0.0]], "is not a Material or Node"),
    ],
)
def test_wrong_channels_of_fields(holder: Any, name: str, values: Any, fault: str) -> None:
    with pytest.raises(SceneError, match=fault):
        FieldChannel(holder, name, np.zeros(1), np.array(values))


def test_values_that_a_field_refuses() -> None:
    move = Animation([FieldChannel(Material(name="paint"), "roughness", np.zeros(1), np.array([[2.0]]))])
    with pytest.raises(SceneError, match=r"material 'paint': roughness: 2.0 is not from 0 to 1"):
        move.apply(0)

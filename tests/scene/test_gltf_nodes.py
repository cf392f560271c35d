import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pica.errors import SceneError
from pica.scene.channels import ALL_CHANNELS
from pica.scene.gltf import read
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
from tests.scene.gltf_files import GltfFile, rotation_y

QUARTER_TURN = [0, math.sin(math.pi / 4), 0, math.cos(math.pi / 4)]


def test_translation_rotation_and_scale_of_a_hierarchy(tmp_path: Path) -> None:
    file = GltfFile()
    file.mesh(node={"name": "leaf", "scale": [1, 2, 3]})
    file.add("nodes", name="root", children=[0], translation=[10, 0, 0], rotation=QUARTER_TURN)
    root, leaf = read(file.write(tmp_path)).nodes()
    expected = np.eye(4)
    expected[:3, :3] = rotation_y(math.pi / 2) @ np.diag([1, 2, 3])
    expected[:3, 3] = [10, 0, 0]
    assert (root.name, leaf.name, leaf.parent) == ("root", "leaf", root)
    np.testing.assert_allclose(leaf.world, expected, atol=1e-12)


def test_matrices_are_stored_column_by_column(tmp_path: Path) -> None:
    file = GltfFile()
    file.mesh(node={"matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1]})
    (node,) = read(file.write(tmp_path)).nodes()
    np.testing.assert_array_equal(node.transform[:3, 3], [5, 6, 7])


def test_only_the_default_scene_is_read(tmp_path: Path) -> None:
    file = GltfFile()
    for name in ("a", "b"):
        file.mesh(node={"name": name})
    file.json |= {"scenes": [{"nodes": [0]}, {"nodes": [1], "name": "second"}], "scene": 1}
    scene = read(file.write(tmp_path))
    assert (scene.name, [node.name for node in scene.nodes()]) == ("second", ["b"])


def test_a_hierarchy_deeper_than_python_recurses(tmp_path: Path) -> None:
    file = GltfFile()
    for i in range(3000):
        file.add("nodes", children=[i + 1])
    file.mesh()
    assert sum(1 for _ in read(file.write(tmp_path)).nodes()) == 3001


def test_instances(tmp_path: Path) -> None:
    file = GltfFile()
    attributes = {
        "TRANSLATION": file.accessor([[1, 0, 0], [0, 0, 2]]),
        "ROTATION": file.accessor([[0, 0, 0, 127], [0, 127, 0, 0]], "i1", normalized=True),
        "SCALE": file.accessor([[1, 1, 1], [2, 2, 2]]),
    }
    extensions = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    file.mesh(node={"translation": [0, 5, 0], "extensions": extensions})
    scene = read(file.write(tmp_path))
    (node,) = scene.nodes()
    assert scene.triangle_count() == 2
    world = node.instance_transforms()
    np.testing.assert_allclose(world[0][:3, 3], [1, 5, 0])
    np.testing.assert_allclose(world[1] @ [1, 1, 0, 1], [-2, 7, 2, 1], atol=1e-12)


def test_perspective_and_orthographic_camera(tmp_path: Path) -> None:
    file = GltfFile()
    file.add("cameras", type="perspective", perspective={"yfov": 0.7, "znear": 0.1, "aspectRatio": 2}, name="lens")
    file.add("cameras", type="orthographic", orthographic={"xmag": 3, "ymag": 2, "znear": 0, "zfar": 50})
    file.mesh()
    file.add("nodes", camera=0, translation=[0, 0, 4])
    file.add("nodes", camera=1, name="plan")
    perspective, orthographic = read(file.write(tmp_path)).cameras()
    assert (perspective.name, perspective.vertical_fov, perspective.near) == ("lens", 0.7, 0.1)
    assert perspective.orthographic_height is None
    np.testing.assert_array_equal(perspective.transform[:3, 3], [0, 0, 4])
    assert (orthographic.name, orthographic.orthographic_height, orthographic.far) == ("plan", 4, 50)


def light_of(folder: Path, light: dict[str, Any] | None, node: dict[str, Any]) -> Light | None:
    file = GltfFile()
    file.mesh()
    if light is not None:
        file.json["extensions"] = {"KHR_lights_punctual": {"lights": [light]}}
        node = {"extensions": {"KHR_lights_punctual": {"light": 0}}} | node
    file.add("nodes", **node)
    _, carrier = read(file.write(folder)).nodes()
    return carrier.light


def pica(**values: Any) -> dict[str, Any]:
    """An object with extras for pica."""
    return {"extras": {"pica": values, "somebody else": 3}}


@pytest.mark.parametrize(
    ("light", "node", "expected"),
    [
        (
            {"type": "directional", "name": "sun", "intensity": 9, "color": [1, 0.5, 0], **pica(angular_diameter=0.01)},
            {},
            DirectionalLight((1, 0.5, 0), 9, 0.01, "sun"),
        ),
        (
            {"type": "point", "range": 7, **pica(radius=0.2)},
            {"name": "bulb"},
            PointLight(radius=0.2, range=7, name="bulb"),
        ),
        ({"type": "point", **pica(radius=0.2)}, pica(radius=0.3), PointLight(radius=0.3)),
        (
            {"type": "spot", "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.2}},
            {},
            SpotLight(inner_cone_angle=0.1, outer_cone_angle=0.2),
        ),
        ({"type": "spot"}, pica(radius=1), SpotLight(radius=1)),
    ],
)
def test_punctual_lights(light: dict[str, Any], node: dict[str, Any], expected: Light, tmp_path: Path) -> None:
    assert light_of(tmp_path, light, node) == expected


@pytest.mark.parametrize(
    ("light", "expected"),
    [
        (
            {"type": "rectangle", "radiance": 50, "width": 2, "height": 3},
            RectangleLight(radiance=50, width=2, height=3),
        ),
        ({"type": "disk", "radius": 2, "color": [1, 0, 0]}, DiskLight(color=(1, 0, 0), radius=2)),
        ({"type": "sphere"}, SphereLight()),
        ({"type": "tube", "length": 2, "radius": 0.1}, TubeLight(length=2, radius=0.1)),
    ],
)
def test_area_lights_come_from_extras(light: dict[str, Any], expected: Light, tmp_path: Path) -> None:
    assert light_of(tmp_path, None, {"extras": {"pica": {"light": light}}}) == expected


@pytest.mark.parametrize(
    ("light", "node", "fault"),
    [
        ({"type": "tube"}, {}, "type: 'tube' is not one of directional, point, spot"),
        ({"type": "point", "extras": {"pica": {"radius": -1}}}, {}, "radius: -1 is not a number of at least 0"),
        ({"type": "directional"}, {"extras": {"pica": {"angular_diameter": "big"}}}, "angular_diameter: 'big'"),
        ({"type": "spot", "spot": {"innerConeAngle": 1}}, {}, "innerConeAngle 1.0 is not less than"),
        ({"type": "point"}, {"extras": {"pica": {"light": {"type": "sphere"}}}}, "has two lights"),
        (
            {"type": "point"},
            {"extensions": {"KHR_lights_punctual": {"light": 2}}},
            r"nodes\[1\].extensions.KHR_lights_punctual.light: 2 is out of range",
        ),
        (None, {"extras": {"pica": {"light": {"type": "box"}}}}, "'box' is not one of rectangle, disk, sphere, tube"),
        (None, {"extras": {"pica": {"light": {"type": "disk", "width": 1}}}}, "'width' is not a key of a disk light"),
        (None, {"extras": {"pica": {"light": {"type": "disk", "radius": 0}}}}, "a size of 0 gives no light"),
    ],
)
def test_bad_lights_are_named(light: dict[str, Any] | None, node: dict[str, Any], fault: str, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=f"model.gltf: .*{fault}"):
        light_of(tmp_path, light, node)


@pytest.mark.parametrize(
    ("nodes", "fault"),
    [
        ([{"children": [1]}, {"children": [0]}], r"nodes\[0\]: is its own ancestor"),
        ([{"children": [0]}], r"nodes\[0\]: is its own ancestor"),
        ([{"children": [2]}, {"children": [2]}, {}], r"nodes\[2\]: is a child twice"),
        ([{"children": [9]}], r"nodes\[0\].children\[0\]: 9 is out of range"),
        ([{"mesh": 9}], r"nodes\[0\].mesh: 9 is out of range"),
        ([{"mesh": -1}], r"nodes\[0\].mesh: -1 is out of range"),
        ([{"camera": 0}], r"nodes\[0\].camera: 0 is out of range"),
        ([{"translation": [1, 2]}], "is not a list of 3 numbers"),
        ([{"rotation": [0, 0, 0, 0]}], "a quaternion of zeros is no rotation"),
        ([{"matrix": [0] * 16}], "its last row must be"),
    ],
)
def test_bad_nodes_are_named(nodes: list[dict[str, Any]], fault: str, tmp_path: Path) -> None:
    file = GltfFile()
    file.json["nodes"] = nodes
    with pytest.raises(SceneError, match=f"model.gltf: .*{fault}"):
        read(file.write(tmp_path))


def test_visibility_and_lighting_channels_from_extras(tmp_path: Path) -> None:
    file = GltfFile()
    pica = {"visible_to_camera": False, "visible_to_reflections": False, "casts_shadows": False}
    file.mesh(node={"extras": {"pica": {**pica, "lighting_channels": [0, 3]}}})
    file.mesh()
    hidden, plain = read(file.write(tmp_path)).nodes()
    assert (hidden.visible_to_camera, hidden.visible_to_reflections, hidden.casts_shadows) == (False, False, False)
    assert hidden.lighting_channels == {0, 3}
    assert (plain.visible_to_camera, plain.visible_to_reflections, plain.casts_shadows) == (True, True, True)
    assert plain.lighting_channels == ALL_CHANNELS


def test_lighting_channels_of_lights(tmp_path: Path) -> None:
    """A light's own, else those of its node; an area light has its node's."""
    file = GltfFile()
    lights = [{"type": "point", "extras": {"pica": {"lighting_channels": [1]}}}, {"type": "spot", "spot": {}}]
    file.json["extensions"] = {"KHR_lights_punctual": {"lights": lights}}
    channels = {"pica": {"lighting_channels": [5]}}
    for light, extras in ((0, {}), (0, channels), (1, channels), (1, {})):
        file.add("nodes", extensions={"KHR_lights_punctual": {"light": light}}, extras=extras)
    file.add("nodes", extras={"pica": {"light": {"type": "sphere"}, "lighting_channels": []}})
    file.mesh()
    found = [node.light.lighting_channels for node in read(file.write(tmp_path)).nodes() if node.light]
    assert found == [{1}, {5}, {5}, ALL_CHANNELS, frozenset()]


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("visible_to_camera", 1, r"nodes\[0\].extras.pica.visible_to_camera: 1 is not true or false"),
        ("casts_shadows", "no", r"nodes\[0\].extras.pica.casts_shadows: 'no' is not true or false"),
        (
            "lighting_channels",
            [6],
            r"nodes\[0\].extras.pica.lighting_channels\[0\]: 6 is not a whole number from 0 to 5",
        ),
        ("lighting_channels", 2, r"nodes\[0\].*lighting_channels: 2 is not an array"),
    ],
)
def test_wrong_visibility_is_an_error_that_names_the_place(tmp_path: Path, key: str, value: Any, message: str) -> None:
    file = GltfFile()
    file.mesh(node={"extras": {"pica": {key: value}}})
    with pytest.raises(SceneError, match=message):
        read(file.write(tmp_path))


def shining(kind: str, radius: float) -> dict[str, Any]:
    return {"extras": {"pica": {"light": {"type": kind, "radius": radius}}}}


STRETCHED = [1e30, 0, 0, 0, 0, 1e30, 0, 0, 0, 0, 1e30, 0, 0, 0, 0, 1]


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize(
    ("upper", "lower", "fault"),
    [
        ({"scale": [1e30] * 3}, {"scale": [1e30] * 3}, r"nodes\[1\]: node 'lower': .* too large"),
        ({"scale": [1e20] * 3}, {"translation": [1e20, 0, 0]}, r"nodes\[1\]: node 'lower': .* too large"),
        ({"matrix": STRETCHED}, {"scale": [1e30] * 3}, r"nodes\[1\]: node 'lower': .* too large"),
        ({"scale": [1e308] * 3}, {}, r"nodes\[0\].scale\[0\]: 1e\+308 is not a number"),
        (shining("sphere", 1e200), {}, r"nodes\[0\].extras.pica.light.radius: 1e\+200 is not a number"),
        (shining("disk", 1e30), {}, r"nodes\[0\].extras.pica.light: disk light: radius: 1e\+30"),
        ({}, shining("disk", 1e15) | {"scale": [1e15] * 3}, r"nodes\[1\]: node 'lower': light: .* too large"),
    ],
)
def test_what_is_too_large_is_named_by_its_place(upper: Any, lower: Any, fault: str, tmp_path: Path) -> None:
    file = GltfFile()
    file.add("nodes", children=[1], **upper)
    file.mesh(node={"name": "lower", **lower})
    with pytest.raises(SceneError, match=rf"model.gltf: {fault}"):
        read(file.write(tmp_path))

"""All fields of scenes as plain values, to compare a scene with what is loaded of it."""

from dataclasses import fields
from typing import Any

import numpy as np

from pica.scene.camera import Camera
from pica.scene.environment import Environment
from pica.scene.gltf.meshes import TRIANGLES, renumbered, triangulate
from pica.scene.material import Material, Texture
from pica.scene.mesh import Mesh, Section
from pica.scene.model import Scene
from pica.scene.node import Node

UNSEEN = {
    "_transform": "compared as transform",
    "pose": "nodes without a transform have one once they are loaded",
    "identities": "no field of files",
    "detail": "not saved",
    "rows": "of deformers",
    "primitives": "not saved",
}


def fields_of_scene(scene: Scene) -> dict[str, Any]:
    """The scene in nested dictionaries, lists and arrays, with shared objects by the number of their first use."""
    numbers: dict[Any, int] = {}
    nodes = list(scene.nodes())
    rows = {node: row for row, node in enumerate(nodes)}
    return {
        "name": scene.name,
        "environment": _picture(scene.environment),
        "background": _picture(scene.background),
        "nodes": [_node(node, rows, numbers) for node in nodes],
        "animations": [
            {
                "name": animation.name,
                "duration": animation.duration,
                "channels": [
                    [rows[channel.node], channel.path, channel.interpolation, channel.times, channel.values]
                    for channel in animation.channels
                ],
            }
            for animation in scene.animations
            if animation.channels
        ],
    }


def _picture(shown: Any) -> Any:
    return {name: getattr(shown, name) for name in _names(shown)} if isinstance(shown, Environment) else shown


def assert_same(one: Any, other: Any, place: str = "") -> None:
    """Arrays to the last digit, or to 32 bits where `one` has 64; all else by ==."""
    assert type(one) is type(other), f"{place}: {one!r}, {other!r}"
    if isinstance(one, dict):
        assert one.keys() == other.keys(), place
        for key in one:
            assert_same(one[key], other[key], f"{place}.{key}")
    elif isinstance(one, list):
        assert len(one) == len(other), place
        for index, (a, b) in enumerate(zip(one, other, strict=True)):
            assert_same(a, b, f"{place}[{index}]")
    elif isinstance(one, np.ndarray):
        exact = one if one.dtype != np.float64 or place.endswith(("transform", "weights")) else one.astype(np.float32)
        np.testing.assert_array_equal(exact, other, err_msg=place)
    else:
        assert one == other, place


def _names(holder: Any) -> list[str]:
    return [field.name for field in fields(holder) if field.name not in UNSEEN and not field.name.startswith("_")]


def _node(node: Node, rows: dict[Node, int], numbers: dict[Any, int]) -> dict[str, Any]:
    values = {name: getattr(node, name) for name in _names(node)}
    values |= {"transform": node.transform, "parent": None if node.parent is None else rows[node.parent]}
    values["extras"] = _extras(node.extras)
    values["mesh"] = _mesh(node.mesh, numbers)
    values["light"] = None if node.light is None else {**vars(node.light), "name": node.light.name or node.name}
    values["camera"] = _camera(node)
    values["weights"] = None if node.weights is None else node.weights
    skin = node.skin
    values["skin"] = None if skin is None else [skin.name, [rows[joint] for joint in skin.joints], skin.inverse_bind]
    return values


def _camera(node: Node) -> dict[str, Any] | None:
    camera: Camera | None = node.camera
    if camera is None:
        return None
    names = set(_names(camera)) - {"transform"}  # which has no effect in a node
    if camera.orthographic_height is None:
        names -= {"far"}
    else:
        names -= {"vertical_fov"}
    return {name: getattr(camera, name) for name in names} | {"name": camera.name or node.name}


def _mesh(mesh: Mesh | None, numbers: dict[Any, int]) -> Any:
    if mesh is None or not any(len(section.indices) for section in mesh.sections):
        return None
    if mesh in numbers:
        return numbers[mesh]
    numbers[mesh] = len(numbers)
    return [mesh.name, *(_section(section, numbers) for section in mesh.sections)]


def _section(section: Section, numbers: dict[Any, int]) -> dict[str, Any]:
    triangles, used = renumbered(triangulate(section.indices.reshape(-1), TRIANGLES), len(section.positions))
    used = np.arange(len(section.positions)) if used is None else used
    shown = section.take(used, triangles)  # as files are loaded
    return {name: getattr(shown, name) for name in _names(shown)} | {"material": _material(section.material, numbers)}


def _material(material: Material, numbers: dict[Any, int]) -> Any:
    if material in numbers:
        return numbers[material]
    numbers[material] = len(numbers)
    values = {name: getattr(material, name) for name in _names(material)} | {"extras": _extras(material.extras)}
    values["parameters"] = dict(material.parameters)
    for name, value in values.items():
        if isinstance(value, Texture):
            values[name] = {
                "pixels": value.image.pixels,
                "image": [value.image.name, value.image.encoding],
                "use": [value.sampler, value.uv_set, value.transform],
            }
    return values


def _extras(extras: dict[str, object]) -> dict[str, object]:
    return {key: value for key, value in extras.items() if key != "pica"}

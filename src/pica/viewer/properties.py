"""What can be changed of a node, its light and its materials, for inputs of any user interface."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pica.color import srgb_decode, srgb_encode
from pica.scene.animation import Pose
from pica.scene.environment import Environment
from pica.scene.light import Light
from pica.scene.material import Material
from pica.scene.model import Scene
from pica.scene.node import Node
from pica.viewer.edits import Change
from pica.viewer.euler import euler_of, pose_of, quaternion_of
from pica.viewer.visibility import Visibility

Rgb = tuple[int, int, int]
"""sRGB, 0 to 255."""
_STRENGTHS = {"illuminance": "lux", "intensity": "candela", "radiance": "nits"}
"""Units of lights by the field that they have one of."""
_BRIGHT = 1e-6
"""Emission below which it has no colour."""
_MATERIALS = 8
"""Of a node, that have properties here."""


@dataclass(frozen=True)
class Property:
    """One value of the scene, and how it is changed."""

    label: str
    kind: Literal["boolean", "number", "share", "angle", "vector", "color"]
    """number: 0 or more; share: 0 to 1; angle: -180 to 180 degrees; vector: three numbers; color: `Rgb`."""
    read: Callable[[], Any]
    """The value as it is now."""
    changes: Callable[[Any], list[Change]]
    """What another value assigns, for Edits.apply."""
    hint: str = ""


@dataclass(frozen=True)
class PropertyGroup:
    """The properties of one object."""

    label: str
    properties: tuple[Property, ...]


def property_groups(node: Node, materials: Sequence[Material], visibility: Visibility) -> list[PropertyGroup]:
    """The properties of a node, of its light, and of the first of its materials."""
    groups = [PropertyGroup(f"Node {node.name}".strip(), tuple(_node_properties(node, visibility)))]
    if node.light is not None:
        groups.append(PropertyGroup(type(node.light).__name__, tuple(_light_properties(node, node.light))))
    for material in materials[:_MATERIALS]:
        groups.append(PropertyGroup(f"Material {material.name}".strip(), tuple(_material_properties(material))))
    return groups


def environment_properties(scene: Scene) -> list[Property]:
    """The properties of a scene's environment; none without one."""
    if scene.environment is None:
        return []

    def environment() -> Environment:
        assert scene.environment is not None
        return scene.environment

    return [
        Property(
            "Strength",
            "number",
            lambda: environment().strength,
            lambda value: [(scene, "environment", replace(environment(), strength=float(value)))],
            "Multiplies the radiance",
        ),
        Property(
            "Turned by",
            "angle",
            lambda: round((math.degrees(environment().rotation) + 180) % 360 - 180, 3),
            lambda value: [(scene, "environment", replace(environment(), rotation=math.radians(value)))],
            "Degrees about the vertical axis, from +Z towards +X",
        ),
    ]


def _node_properties(node: Node, visibility: Visibility) -> list[Property]:
    properties = []
    if visibility.shows(node) is not None:
        hint = "The meshes and lights of the node and of all below it"
        change = partial(visibility.changes, node)
        properties.append(Property("Visible", "boolean", lambda: visibility.shows(node), change, hint))
    if pose_of(node.transform) is None:
        return properties  # neither rotation nor scale can be told from shear

    def rotation() -> tuple[float, ...]:
        turn = replace(_pose(node), translation=np.zeros(3), scale=np.ones(3)).matrix()
        return tuple(round(angle, 4) for angle in euler_of(turn[:3, :3]))

    def placing(**parts: Any) -> list[Change]:
        pose = replace(_pose(node), **parts)
        return [(node, "pose", pose)] if _is_posed(node) else [(node, "transform", pose.matrix())]

    return [
        *properties,
        Property(
            "Translation",
            "vector",
            lambda: _numbers(_pose(node).translation),
            lambda value: placing(translation=np.array(value)),
            "Metres, relative to its parent",
        ),
        Property(
            "Rotation",
            "vector",
            rotation,
            lambda value: placing(rotation=quaternion_of(value)),
            "Degrees about X, then Y, then Z",
        ),
        Property("Scale", "vector", lambda: _numbers(_pose(node).scale), lambda value: placing(scale=np.array(value))),
    ]


def _light_properties(node: Node, light: Light) -> list[Property]:
    strength = next(name for name in _STRENGTHS if hasattr(light, name))

    def color() -> Rgb:
        assert node.light is not None
        return _encoded(np.array(node.light.color) / max(*node.light.color, 1.0))

    def colored(value: Rgb) -> list[Change]:
        assert node.light is not None
        scale = max(*node.light.color, 1.0)
        return [(node, "light", replace(node.light, color=tuple(scale * _decoded(value))))]

    return [
        Property("Colour", "color", color, colored),
        Property(
            strength.capitalize(),
            "number",
            lambda: float(getattr(node.light, strength)),
            lambda value: [(node, "light", replace(node.light, **{strength: float(value)}))],  # type: ignore[type-var]
            _STRENGTHS[strength].capitalize(),
        ),
    ]


def _material_properties(material: Material) -> list[Property]:
    textured = {
        "base_color": material.base_color_texture is not None,
        "emission": material.emissive_texture is not None,
        "metallic": material.metallic_roughness_texture is not None,
        "roughness": material.metallic_roughness_texture is not None,
    }
    hints = {name: "Multiplies the texture" if has else "" for name, has in textured.items()}

    def emission() -> tuple[NDArray[np.float64], float]:
        """Its colour, with 1 as the largest component, and its radiance."""
        value = np.array(material.emission)
        strength = float(value.max())
        return (value / strength if strength > _BRIGHT else np.ones(3)), strength

    def emitting(color: Rgb) -> list[Change]:
        linear = _decoded(color)
        return [(material, "emission", tuple(emission()[1] * linear / max(linear.max(), _BRIGHT)))]

    return [
        Property(
            "Base colour",
            "color",
            lambda: _encoded(np.array(material.base_color[:3])),
            lambda value: [(material, "base_color", (*_decoded(value), material.base_color[3]))],
            hints["base_color"],
        ),
        *(
            Property(
                name.capitalize(),
                "share",
                lambda name=name: float(getattr(material, name)),  # type: ignore[misc]
                lambda value, name=name: [(material, name, float(value))],  # type: ignore[misc]
                hints[name],
            )
            for name in ("metallic", "roughness")
        ),
        Property(
            "Emission",
            "color",
            lambda: _encoded(emission()[0]),
            emitting,
            hints["emission"] or "Of what is emitted; set its radiance first",
        ),
        Property(
            "Emitted radiance",
            "number",
            lambda: emission()[1],
            lambda value: [(material, "emission", tuple(float(value) * emission()[0]))],
            "Nits",
        ),
    ]


def _is_posed(node: Node) -> bool:
    return node.pose is not None and np.allclose(node.pose.matrix(), node.transform)


def _pose(node: Node) -> Pose:
    pose = node.pose if _is_posed(node) else pose_of(node.transform)
    return Pose() if pose is None else pose


def _numbers(values: NDArray[np.float64]) -> tuple[float, ...]:
    return tuple(float(f"{value:.6g}") for value in values)


def _encoded(linear: NDArray[np.float64]) -> Rgb:
    red, green, blue = (np.clip(srgb_encode(linear.astype(np.float32)), 0, 1) * 255 + 0.5).astype(int).tolist()
    return red, green, blue


def _decoded(color: Rgb) -> NDArray[np.float64]:
    return srgb_decode(np.array(color, np.float64) / 255).astype(np.float64)

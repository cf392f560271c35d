"""The table of lights as lights.slang reads it: shapes in the world and the chance that each is chosen."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pica.scene.channels import channel_bits
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
from pica.scene.model import Scene

LIGHT_DTYPE = np.dtype(
    [
        ("position", np.float32, 3),
        ("type", np.uint32),
        ("emission", np.float32, 3),
        ("selectionProbability", np.float32),
        ("direction", np.float32, 3),
        ("radius", np.float32),
        ("halfX", np.float32, 3),
        ("range", np.float32),
        ("halfY", np.float32, 3),
        ("angleScale", np.float32),
        ("angleOffset", np.float32),
        ("area", np.float32),
        ("channels", np.uint32),
        ("unused", np.uint32),
    ]
)
"""One row, 96 bytes: the struct Light of gpu_scene/lights/lights.slang, field by field."""

LIGHT_TYPES: dict[type[object] | str, int] = {
    DirectionalLight: 0,
    PointLight: 1,
    SpotLight: 2,
    RectangleLight: 3,
    DiskLight: 4,
    SphereLight: 5,
    TubeLight: 6,
    "emissive_triangles": 7,
    "environment": 8,
}
"""The numbers of the enum LightType; the named ones are rows without a shape of their own."""

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
"""Rec. 709 weights (ITU-R BT.709-6, 3.2)."""

Row = NDArray[np.void]
Matrix = NDArray[np.float64]


def pack_lights(scene: Scene) -> Row:
    """(lights,) rows of LIGHT_DTYPE, in the order of scene.nodes(); selection by power."""
    nodes = [(node.light, node.world) for node in scene.nodes() if node.light is not None]
    table = np.zeros(len(nodes), LIGHT_DTYPE)
    radius = scene_radius(scene)
    for row, (light, world) in enumerate(nodes):
        table[row] = pack_light(light, world)
    table["selectionProbability"] = selection_probabilities([light_power(*node, radius) for node in nodes])
    return table


def scene_radius(scene: Scene) -> float:
    """Metres: half the diagonal of the box round the scene's meshes."""
    low, high = scene.bounds()
    return float(np.linalg.norm(high - low)) / 2


def pack_light(light: Light, world: Matrix) -> Row:
    """One light as a LIGHT_DTYPE scalar, placed by its node's (4, 4) world matrix; selection probability 0.

    The node's scale affects rectangles, disks, spheres and tubes and, following KHR_lights_punctual, no other
    light. A sheared rectangle becomes rectangular with the same area; under uneven scale a ball keeps its volume, a
    tube its length and cross-section area.
    """
    row = np.zeros((), LIGHT_DTYPE)
    row["type"] = LIGHT_TYPES[type(light)]
    row["channels"] = channel_bits(light.lighting_channels)
    row["position"] = world[:3, 3]
    strength = _strength(light)
    row["emission"] = np.multiply(light.color, strength)
    row["direction"] = -_unit(world[:3, 2])
    if isinstance(light, RectangleLight | DiskLight):
        row["halfX"], row["halfY"] = _half_axes(light, world)
        row["area"] = _area(light, world)
        row["direction"] = _back_side(world)
    elif isinstance(light, SphereLight):
        row["radius"] = light.radius * _ball_scale(world)
    elif isinstance(light, TubeLight):
        row["halfX"] = world[:3, 0] * light.length / 2
        row["radius"] = light.radius * _tube_scale(world)
    elif isinstance(light, DirectionalLight):
        row["radius"] = math.sin(light.angular_diameter / 2)
    else:
        row["radius"] = light.radius
        row["range"] = light.range or 0.0
    if isinstance(light, SpotLight):
        inner, outer = math.cos(light.inner_cone_angle), math.cos(light.outer_cone_angle)
        # KHR_lights_punctual, "Inner and Outer Cone Angles", reference code
        row["angleScale"] = 1 / max(0.001, inner - outer)
        row["angleOffset"] = -outer * row["angleScale"]
    return row[()]


def light_power(light: Light, world: Matrix, scene_radius: float) -> float:
    """Luminous power in lumen within a scene of `scene_radius` metres, for light selection.

    Pharr, Jakob and Humphreys 2023, section 12.1 and 12.2 (the spot's smooth edge taken half way).
    """
    strength = _strength(light) * float(LUMINANCE @ light.color)
    match light:
        case DirectionalLight():
            return strength * math.pi * scene_radius**2
        case PointLight():
            return strength * 4 * math.pi
        case SpotLight():
            middle = (math.cos(light.inner_cone_angle) + math.cos(light.outer_cone_angle)) / 2
            return strength * 2 * math.pi * (1 - middle)
        case RectangleLight() | DiskLight():
            return strength * math.pi * _area(light, world)
        case SphereLight():
            return strength * (2 * math.pi * light.radius * _ball_scale(world)) ** 2
        case TubeLight():
            radius, length = light.radius * _tube_scale(world), light.length * float(np.linalg.norm(world[:3, 0]))
            return strength * 2 * math.pi**2 * radius * (length + 2 * radius)


def selection_probabilities(powers: Sequence[float] | NDArray[np.float64]) -> NDArray[np.float32]:
    """(lights,) chances that add up to 1, in proportion to the powers; even when all are dark."""
    values = np.asarray(powers, np.float64)
    total = values.sum()
    if not total > 0:
        values, total = np.ones_like(values), max(len(values), 1)
    return (values / total).astype(np.float32)


def _strength(light: Light) -> float:
    match light:
        case DirectionalLight():
            return light.illuminance
        case PointLight() | SpotLight():
            return light.intensity
        case _:
            return light.radiance


def _half_axes(light: RectangleLight | DiskLight, world: Matrix) -> tuple[Matrix, Matrix]:
    if isinstance(light, DiskLight):
        # Under any matrix, the singular vectors are the axes of the disk's ellipse.
        axes, lengths, _ = np.linalg.svd(world[:3, :2] * light.radius, full_matrices=False)
        return axes[:, 0] * lengths[0], axes[:, 1] * lengths[1]
    half_x, half_y = world[:3, 0] * light.width / 2, world[:3, 1] * light.height / 2
    return half_x, half_y - half_x * (half_x @ half_y) / max(float(half_x @ half_x), 1e-300)


def _area(light: RectangleLight | DiskLight, world: Matrix) -> float:
    shape = math.pi * light.radius**2 if isinstance(light, DiskLight) else light.width * light.height
    return shape * float(np.linalg.norm(np.cross(world[:3, 0], world[:3, 1])))


def _back_side(world: Matrix) -> Matrix:
    """The unit normal of the node's XY plane, on its -Z side."""
    normal = np.cross(world[:3, 0], world[:3, 1])
    return -_unit(normal * math.copysign(1.0, float(normal @ world[:3, 2])))


def _ball_scale(world: Matrix) -> float:
    return float(abs(np.linalg.det(world[:3, :3]))) ** (1 / 3)


def _tube_scale(world: Matrix) -> float:
    """Of a tube's radius: square root of the factor on its cross-section."""
    along = float(np.linalg.norm(world[:3, 0]))
    return math.sqrt(float(abs(np.linalg.det(world[:3, :3]))) / max(along, 1e-300))


def _unit(vector: Matrix) -> Matrix:
    return vector / max(float(np.linalg.norm(vector)), 1e-300)

"""KHR_animation_pointer: which keys of a file animations may set, and the fields that have them."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from pica.scene.gltf.texture_places import TEXTURES
from pica.scene.gltf.textures import transform_matrix
from pica.scene.keyframes import Floats
from pica.scene.values import BRIGHTEST, LARGEST

TRANSFORM = "KHR_texture_transform"
STRENGTH = "extensions/KHR_materials_emissive_strength/emissiveStrength"
_MATERIALS = "extensions/KHR_materials_"
_VOLUME = f"{_MATERIALS}volume/"


class Field(NamedTuple):
    """A field with the values of one key."""

    name: str
    """As FieldChannel.field."""
    default: tuple[float, ...]
    """Of the key."""
    low: float = 0.0
    high: float = LARGEST


_ONE, _ZERO, _WHITE = (1.0,), (0.0,), (1.0, 1.0, 1.0)
MATERIAL: dict[str, Field] = {
    "pbrMetallicRoughness/baseColorFactor": Field("base_color", (1.0, 1.0, 1.0, 1.0), 0, 1),
    "pbrMetallicRoughness/metallicFactor": Field("metallic", _ONE, 0, 1),
    "pbrMetallicRoughness/roughnessFactor": Field("roughness", _ONE, 0, 1),
    "alphaCutoff": Field("alpha_cutoff", (0.5,)),
    "normalTexture/scale": Field("normal_scale", _ONE, -LARGEST),
    "occlusionTexture/strength": Field("occlusion_strength", _ONE, 0, 1),
    f"{_MATERIALS}anisotropy/anisotropyRotation": Field("anisotropy.rotation", _ZERO, -LARGEST),
    f"{_MATERIALS}anisotropy/anisotropyStrength": Field("anisotropy.strength", _ZERO, 0, 1),
    f"{_MATERIALS}clearcoat/clearcoatFactor": Field("coats.0.strength", _ZERO, 0, 1),
    f"{_MATERIALS}clearcoat/clearcoatRoughnessFactor": Field("coats.0.roughness", _ZERO, 0, 1),
    f"{_MATERIALS}clearcoat/clearcoatNormalTexture/scale": Field("coat_normal_scale", _ONE, -LARGEST),
    f"{_MATERIALS}diffuse_transmission/diffuseTransmissionFactor": Field("diffuse_transmission", _ZERO, 0, 1),
    f"{_MATERIALS}diffuse_transmission/diffuseTransmissionColorFactor": Field("diffuse_transmission_color", _WHITE),
    f"{_MATERIALS}dispersion/dispersion": Field("dispersion", _ZERO),
    f"{_MATERIALS}ior/ior": Field("ior", (1.5,), 1),
    f"{_MATERIALS}iridescence/iridescenceFactor": Field("iridescence.strength", _ZERO, 0, 1),
    f"{_MATERIALS}iridescence/iridescenceIor": Field("iridescence.ior", (1.3,), 1),
    f"{_MATERIALS}iridescence/iridescenceThicknessMinimum": Field("iridescence.thickness_minimum", (100.0,), 0, 1e5),
    f"{_MATERIALS}iridescence/iridescenceThicknessMaximum": Field("iridescence.thickness_maximum", (400.0,), 0, 1e5),
    f"{_MATERIALS}sheen/sheenColorFactor": Field("sheen.color", (0.0, 0.0, 0.0), 0, 1),
    f"{_MATERIALS}sheen/sheenRoughnessFactor": Field("sheen.roughness", _ZERO, 0, 1),
    f"{_MATERIALS}specular/specularFactor": Field("specular", _ONE, 0, 1),
    f"{_MATERIALS}specular/specularColorFactor": Field("specular_color", _WHITE),
    f"{_MATERIALS}transmission/transmissionFactor": Field("transmission", _ZERO, 0, 1),
    f"{_MATERIALS}volume_scatter/scatterAnisotropy": Field("scatter_anisotropy", _ZERO, -1, 1),
}
"""Keys of materials that are fields as they are."""

CAMERA = {
    "perspective/yfov": Field("camera.vertical_fov", (0.8,), 1e-3, 3.14),
    "perspective/znear": Field("camera.near", (0.01,), 1e-6),
    "orthographic/znear": Field("camera.near", _ZERO),
    "orthographic/zfar": Field("camera.far", (1e4,), 1e-6),
}
"""Keys of cameras that are fields as they are; orthographic/ymag is half of one."""

LIGHT = {
    "color": Field("light.color", _WHITE),
    "range": Field("light.range", (LARGEST,), 1e-6),
}
"""Keys of lights that are fields as they are; intensity has a name for each type, and angles limit each other."""


class Derived(NamedTuple):
    """Fields that are functions of several keys."""

    fields: tuple[str, ...]
    keys: Mapping[str, tuple[float, ...]]
    """With the default of each."""
    function: Callable[..., tuple[Floats, ...]]
    """Of (n, components) values of each key: (n, components) of each field."""
    linear: frozenset[str] = frozenset()
    """Keys in which the function is linear while the others are constant."""


def emission(factor: Floats, strength: Floats) -> tuple[Floats, ...]:
    """Emission of emissiveFactor and KHR_materials_emissive_strength."""
    return (np.clip(np.maximum(factor, 0) * np.maximum(strength, 0), 0, BRIGHTEST),)


EMISSION = Derived(
    ("emission",),
    {"emissiveFactor": (0.0, 0.0, 0.0), STRENGTH: _ONE},
    emission,
    frozenset({"emissiveFactor", STRENGTH}),
)


def transform(offset: Floats, rotation: Floats, scale: Floats) -> tuple[Floats, ...]:
    """Rows of the matrix of KHR_texture_transform."""
    columns = *offset.T, rotation[:, 0], *scale.T
    return (np.array([transform_matrix(*row) for row in zip(*columns, strict=True)]).reshape(-1, 6),)


def texture_transform(info: str) -> Derived:
    """Of the texture info at a place in materials."""
    place = f"{info}/extensions/{TRANSFORM}"
    keys = {f"{place}/offset": (0.0, 0.0), f"{place}/rotation": _ZERO, f"{place}/scale": (1.0, 1.0)}
    linear = frozenset({f"{place}/offset", f"{place}/scale"})
    return Derived((f"{TEXTURES[info]}.transform",), keys, transform, linear)


def medium(coefficients: Callable[..., tuple[Any, Any]]) -> Derived:
    """Absorption and scattering; `coefficients` has them of one colour, distance and scattering colour."""

    def function(color: Floats, distance: Floats, scattered: Floats) -> tuple[Floats, ...]:
        color, scattered = np.clip(color, 0, 1), np.clip(scattered, 0, 1)
        rows = [coefficients(*row) for row in zip(color, np.maximum(distance[:, 0], 0), scattered, strict=True)]
        absorption, scattering = zip(*rows, strict=True)
        return np.array(absorption), np.array(scattering)

    keys = {
        f"{_VOLUME}attenuationColor": _WHITE,
        f"{_VOLUME}attenuationDistance": (float("inf"),),
        f"{_MATERIALS}volume_scatter/multiscatterColor": (0.0, 0.0, 0.0),
    }
    return Derived(("absorption", "scattering"), keys, function)


def clipped(field: Field, *values: Floats) -> tuple[Floats, ...]:
    """The values of a key as its field has them; splines may leave its range."""
    return (np.clip(values[0], field.low, field.high),)


def as_it_is(key: str, field: Field) -> Derived:
    """A field with the values of a key."""
    return Derived((field.name,), {key: field.default}, partial(clipped, field), frozenset({key}))

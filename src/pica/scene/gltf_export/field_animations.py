"""Animated fields of materials, lights and cameras, by KHR_animation_pointer: the inverse of the loader's."""

import numpy as np

from pica.scene.field_channel import FieldChannel
from pica.scene.gltf.curves import Curve
from pica.scene.gltf.pointer_fields import CAMERA, LIGHT, MATERIAL, STRENGTH, TRANSFORM, transform
from pica.scene.gltf.texture_places import TEXTURES
from pica.scene.gltf_export.container import Asset
from pica.scene.gltf_export.materials import Materials, emissive_strength
from pica.scene.keyframes import Floats
from pica.scene.material import Material
from pica.scene.node import Node

_MATERIAL = {field.name: key for key, field in MATERIAL.items()}
_TEXTURES = {f"{field}.transform": info for info, field in TEXTURES.items()}
_LIGHT = {field.name: key for key, field in LIGHT.items()} | {
    "light.intensity": "intensity",
    "light.illuminance": "intensity",
    "light.inner_cone_angle": "spot/innerConeAngle",
    "light.outer_cone_angle": "spot/outerConeAngle",
}
_CAMERA = {field.name: key for key, field in CAMERA.items() if key.startswith("perspective")}
_OFF = 1e-5
"""By how much a matrix of a texture may differ from its rotation and scale."""


def pointers(asset: Asset, channel: FieldChannel, rows: dict[Node, int], materials: Materials) -> dict[str, Curve]:
    """The pointers that a channel becomes, with a curve for each; none where glTF cannot animate the field."""
    curve = Curve(channel.times, channel.values, channel.interpolation)
    holder, name = channel.holder, channel.field
    if isinstance(holder, Material):
        row = materials.added.get(holder)
        curves = {} if row is None else _of_material(name, curve)
        return {f"/materials/{row}/{key}": each for key, each in curves.items()}
    entry = asset.entry("nodes", rows[holder]) if holder in rows else {}
    light = entry.get("extensions", {}).get("KHR_lights_punctual")
    if light is not None and name in _LIGHT:
        return {f"/extensions/KHR_lights_punctual/lights/{light['light']}/{_LIGHT[name]}": curve}
    if "camera" in entry and name in _CAMERA and "perspective" in asset.entry("cameras", entry["camera"]):
        return {f"/cameras/{entry['camera']}/{_CAMERA[name]}": curve}
    return {}


def _of_material(name: str, curve: Curve) -> dict[str, Curve]:
    """The keys of a material that a field becomes."""
    if name in _MATERIAL:
        return {_MATERIAL[name]: curve}
    if name == "emission":
        strength = emissive_strength((float(curve.values.max()), 0.0, 0.0))
        constant = Curve(curve.times[:1], np.array([[strength]]), "STEP")
        return {"emissiveFactor": curve._replace(values=curve.values / strength), STRENGTH: constant}
    if name in _TEXTURES and curve.interpolation != "CUBICSPLINE":
        place = f"{_TEXTURES[name]}/extensions/{TRANSFORM}"
        return {f"{place}/{key}": curve._replace(values=part) for key, part in _parts(curve.values).items()}
    return {}


def _parts(matrices: Floats) -> dict[str, Floats]:
    """Offset, rotation and scale of matrices of textures, (n, 6); nothing if these are not all of them."""
    a, b, shift_u, c, d, shift_v = matrices.T
    angle = np.unwrap(np.arctan2(-c, a))
    scale = np.stack([np.hypot(a, c), d * np.cos(angle) + b * np.sin(angle)], 1)
    parts = {"offset": np.stack([shift_u, shift_v], 1), "rotation": angle[:, None], "scale": scale}
    (composed,) = transform(**parts)
    return parts if np.abs(composed - matrices).max() <= _OFF else {}

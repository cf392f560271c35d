"""Skins (3.7.3)."""

from pica.scene.gltf_export.container import Asset
from pica.scene.node import Node
from pica.scene.skin import Skin


def add_skin(asset: Asset, skin: Skin, rows: dict[Node, int]) -> int | None:
    """The index of a skin; None if one of its joints is in none of `rows`, the indices of nodes."""
    if any(joint not in rows for joint in skin.joints):
        asset.leave_out("skins with joints outside the scene")
        return None
    entry = {
        "name": skin.name,
        "joints": [rows[joint] for joint in skin.joints],
        "inverseBindMatrices": asset.accessor(skin.inverse_bind),
    }
    return asset.add("skins", entry)

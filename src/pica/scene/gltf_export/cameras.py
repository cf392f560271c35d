"""Cameras (3.10)."""

from typing import Any

from pica.scene.gltf_export.container import Asset, differing
from pica.scene.node import Node


def add_camera(asset: Asset, node: Node, is_animated: bool) -> int | None:
    """The index of a node's camera; None if it has none."""
    camera = node.camera
    if camera is None:
        return None
    entry: dict[str, Any] = {"name": camera.name or node.name}
    if camera.orthographic_height is None:
        entry |= {"type": "perspective", "perspective": {"yfov": camera.vertical_fov, "znear": camera.near}}
    else:
        half = camera.orthographic_height / 2
        lens = {"xmag": half * camera.pixel_aspect, "ymag": half, "znear": camera.near, "zfar": camera.far}
        entry |= {"type": "orthographic", "orthographic": lens}
    lens_extras = differing(
        principal_point=(camera.principal_point, (0.5, 0.5)),
        pixel_aspect=(camera.pixel_aspect, 1.0),
        f_number=(camera.f_number, None),
        focus_distance=(camera.focus_distance, None),
        sensor_height=(camera.sensor_height, 0.024),
        aperture_blades=(camera.aperture_blades, 0),
    )
    entry["extras"] = asset.extras({}, lens_extras)
    return asset.add_once("cameras", entry, owner=node if is_animated else None)

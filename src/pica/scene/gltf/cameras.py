"""Cameras (3.10)."""

import math
from typing import Any

import numpy as np

from pica.scene.camera import Camera
from pica.scene.gltf.container import Document
from pica.scene.gltf.element import Element

_PERSPECTIVE, _ORTHOGRAPHIC = "perspective", "orthographic"
_CAMERAS = {kind: kind for kind in (_PERSPECTIVE, _ORTHOGRAPHIC)}
_ORTHOGRAPHIC_FAR = 1e4
_LENS = ("f_number", "focus_distance", "sensor_height")


def read_camera(document: Document, node: Element) -> Camera:
    """A node's camera; the node places it. Raises SceneError."""
    entry = node.reference("camera", document.entries("cameras"))
    kind = entry.choice("type", _CAMERAS)
    lens = entry.object(kind, required=True)
    near = lens.number("znear", low=0)
    pica = entry.pica
    values: dict[str, Any] = {
        "near": near,
        "name": entry.name or node.name,
        "principal_point": pica.numbers("principal_point", 2, default=(0.5, 0.5)),
        "pixel_aspect": pica.number("pixel_aspect", low=0, default=1.0),
        **_aperture(pica),
    }
    if kind == _PERSPECTIVE:
        fov = lens.number("yfov", 0, math.pi)
        if not 0 < fov < math.pi or near == 0:
            raise lens.fault("yfov must lie between 0 and pi and znear above 0")
        return lens.apply(Camera, np.eye(4), vertical_fov=fov, **values)
    far = lens.number("zfar", low=near, default=_ORTHOGRAPHIC_FAR)
    height = 2 * abs(lens.number("ymag"))
    if height == 0 or far == near:
        raise lens.fault("ymag must not be 0 and zfar must lie beyond znear")
    return lens.apply(Camera, np.eye(4), far=far, orthographic_height=height, **values)


def _aperture(extras: Element) -> dict[str, Any]:
    """What a camera's extras tell of its lens (docs/guide/gltf.md)."""
    lens: dict[str, Any] = {key: extras.number(key) for key in _LENS if key in extras}
    if "aperture_blades" in extras:
        lens["aperture_blades"] = extras.integer("aperture_blades")
    if any(value <= 0 for key, value in lens.items() if key in _LENS):
        raise extras.fault("f_number, focus_distance and sensor_height must be above 0")
    if "f_number" in lens and "focus_distance" not in lens:
        raise extras.fault("f_number needs a focus_distance")
    return lens

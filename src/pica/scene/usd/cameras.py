"""Cameras (UsdGeomCamera), whose lengths of film are in tenths of the stage's unit."""

import math
from typing import Any

from pxr import Gf, Usd, UsdGeom

from pica.scene.usd.stage import Stage

_TENTH = 0.1
_NEAREST = 1e-4


def camera_entry(stage: Stage, prim: Usd.Prim, unit: float) -> int | None:
    """The index of a prim's camera; None where it is none. `unit`: metres of a unit of the stage."""
    if prim.GetTypeName() != "Camera":
        return None
    camera: Gf.Camera = UsdGeom.Camera(prim).GetCamera(stage.time)
    film = camera.horizontalAperture, camera.verticalAperture
    shift = camera.horizontalApertureOffset, camera.verticalApertureOffset
    if min(*film, camera.focalLength) <= 0:
        stage.conversion.warn(f"{prim.GetPath()}: a camera without a focal length or film is left out")
        return None
    # The film's centre is shifted to the right and up, so that the principal point goes the other way.
    point = [0.5 - shift[0] / film[0], 0.5 + shift[1] / film[1]]
    pica: dict[str, Any] = {} if point == [0.5, 0.5] else {"principal_point": point}
    near = max(camera.clippingRange.min * unit, 0.0)
    far = max(camera.clippingRange.max * unit, near + 1e-3)
    if camera.projection == Gf.Camera.Orthographic:
        half = film[1] * _TENTH * unit / 2
        lens = {"xmag": film[0] * _TENTH * unit / 2, "ymag": half, "znear": near, "zfar": far}
        entry: dict[str, Any] = {"type": "orthographic", "orthographic": lens}
    else:
        fov = 2 * math.atan(film[1] / 2 / camera.focalLength)
        entry = {"type": "perspective", "perspective": {"yfov": fov, "znear": max(near, _NEAREST), "zfar": far}}
        if camera.fStop > 0 and camera.focusDistance > 0:
            pica |= {
                "f_number": camera.fStop,
                "focus_distance": camera.focusDistance * unit,
                "sensor_height": film[1] * _TENTH * unit,
            }
    asset = stage.conversion.asset
    return asset.add("cameras", entry | {"name": prim.GetName(), "extras": asset.extras({}, pica)})

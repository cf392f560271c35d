"""Dome lights become the environment."""

import math
import tempfile
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd, UsdLux

from pica.errors import SceneError
from pica.scene.usd.lights import light_color
from pica.scene.usd.stage import Stage

_TO_OPENEXR = -math.pi / 2
"""The rotation of a picture whose centre is +X, as pica's, to one with it at +Z, as OpenEXR's latlong maps."""


def dome_environment(stage: Stage, prim: Usd.Prim, world: NDArray[np.float64]) -> dict[str, Any] | None:
    """The environment of the scene's extras; `world`: (4, 4) the dome to +Y up. None where it has no light."""
    color, luminance = light_color(stage, UsdLux.LightAPI(prim))
    radiance = _picture(stage, prim)
    if radiance is None:
        return None
    radiance = radiance * np.float32(np.array(color) * luminance)
    rotation = _rotation(world) @ _pole(stage, prim) @ _about_y(_TO_OPENEXR)
    angle = math.atan2(rotation[0, 2], rotation[2, 2])
    if not np.allclose(rotation, _about_y(angle), atol=1e-4):
        radiance, angle = _turned(radiance, rotation), 0.0
    height, width, _ = radiance.shape
    stage.conversion.budget.take(pixels=width * height, bytes=12 * width * height)
    rows = stage.conversion.asset.accessor(radiance.astype(np.float32).reshape(-1, 3))
    return {"radiance": rows, "width": width, "rotation": angle, "name": prim.GetName()}


def _picture(stage: Stage, prim: Usd.Prim) -> NDArray[np.float32] | None:
    """(height, width, 3) of the dome's texture; white without one."""
    attribute = prim.GetAttribute("inputs:texture:file")
    asset = attribute.Get(stage.time) if attribute else None
    if not isinstance(asset, Sdf.AssetPath) or not asset.path:
        return np.ones((2, 4, 3), np.float32)
    layout = prim.GetAttribute("inputs:texture:format").Get(stage.time)
    if layout not in (None, "automatic", "latlong"):
        stage.conversion.warn(f"a dome's texture of the format {layout} is left out")
        return None
    content = stage.file(attribute, asset, "dome texture")
    if content is None:
        return None
    from pica.images.pictures import read_radiance  # which imports SlangPy

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"dome{PurePosixPath(asset.path).suffix}"
        path.write_bytes(content)
        try:
            radiance = read_radiance(path, stage.conversion.budget.take_picture)
        except SceneError as error:
            fault = str(error).replace(str(path), f"dome texture {asset.path!r}")
            stage.conversion.warn(f"{fault}; left out")
            return None
    return np.where(np.isfinite(radiance), np.maximum(radiance, 0), 0)


def _pole(stage: Stage, prim: Usd.Prim) -> NDArray[np.float64]:
    """+Y to the pole of the picture."""
    attribute = prim.GetAttribute("poleAxis")
    axis = attribute.Get(stage.time) if attribute and prim.GetTypeName() == "DomeLight_1" else "Y"
    if axis == "Z" or (axis == "scene" and stage.up == "z"):
        return np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    return np.eye(3)


def _rotation(world: NDArray[np.float64]) -> NDArray[np.float64]:
    """The rotation of a matrix, without its scale."""
    left, _, right = np.linalg.svd(world[:3, :3])
    rotation: NDArray[np.float64] = left @ right
    return rotation


def _about_y(angle: float) -> NDArray[np.float64]:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def _turned(radiance: NDArray[np.float32], rotation: NDArray[np.float64]) -> NDArray[np.float32]:
    """The picture as it looks after a rotation, by bilinear interpolation."""
    height, width, _ = radiance.shape
    azimuth = ((np.arange(width) + 0.5) / width - 0.5) * 2 * math.pi
    polar = (np.arange(height) + 0.5) / height * math.pi
    turned = np.empty_like(radiance)
    for row, angle in enumerate(polar):
        out = math.sin(angle)
        direction = np.stack([out * np.cos(azimuth), np.full(width, math.cos(angle)), out * np.sin(azimuth)], axis=1)
        x, y, z = (direction @ rotation).T  # the inverse rotation
        u = (0.5 + np.arctan2(z, x) / (2 * math.pi)) * width - 0.5
        v = np.arccos(np.clip(y, -1, 1)) / math.pi * height - 0.5
        left, top = np.floor(u).astype(int), np.floor(v).astype(int)
        share_u, share_v = (u - left)[:, None], (v - top)[:, None]
        above, below = np.clip(top, 0, height - 1), np.clip(top + 1, 0, height - 1)
        columns = left % width, (left + 1) % width
        upper = radiance[above, columns[0]] * (1 - share_u) + radiance[above, columns[1]] * share_u
        lower = radiance[below, columns[0]] * (1 - share_u) + radiance[below, columns[1]] * share_u
        turned[row] = upper * (1 - share_v) + lower * share_v
    return turned

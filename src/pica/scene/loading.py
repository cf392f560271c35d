"""Opening a scene from files."""

import math
import warnings
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pica.errors import SceneError
from pica.images import pictures
from pica.scene import gltf, scene_gc
from pica.scene.conversion import process
from pica.scene.conversion.formats import format_of
from pica.scene.environment import Environment
from pica.scene.illumination import emitted_illuminance, has_lights
from pica.scene.limits import Budget, Limits
from pica.scene.model import Node, Scene
from pica.scene.values import checked, choice, flag, optional, text
from pica.text import printable

SKY_ILLUMINANCE = math.pi
"""Illuminance in lux under a uniform sky of 1 nit."""
_LEAST_SHARE = 0.1
"""Of a neutral sky's illuminance: the minimum that emissive materials must contribute to be the only light. Screens,
labels and indicator lamps emit less, most of it into empty space."""


def load(
    path: str | Path,
    *,
    environment: str | Path | Environment | None = None,
    allow_outside: bool = False,
    limits: Limits | None = None,
    up: str | None = None,
    variant: str | None = None,
) -> Scene:
    """Load a glTF file, or one of another format (docs/guide/files.md), lit from all around by `environment`: a .hdr or
    .exr file, a cube map in .ktx2, or one in memory.

    A .png or .jpg is accepted too, as sRGB: its radiance is 0 to 1 nit, so a sun in it is no brighter than white paper.

    A scene without any light, or with nearly none from its materials, gets a neutral sky, and a warning. One of
    Scene.save has its own environment.
    `allow_outside`: read buffers and pictures from files outside the asset's folder too, such as textures in "../".
    `limits`: of loading, with the environment; pica.Limits() by default. `up`: "y" or "z", the axis that points up in
    the file, if it is not that of its format; the scene is rotated to +Y up. `variant`: the name of a variant of the
    file's materials (KHR_materials_variants), of those in `Scene.variants`. Raises SceneError, one line with the file
    and the fault; warns about unsupported features of the file.
    """
    checked("load: allow_outside", flag, allow_outside)
    checked("load: up", optional(choice("y", "z")), up)
    checked("load: variant", optional(text), variant)
    scene_gc.collect()
    budget, path = Budget(limits), _checked(path, "path")
    kind = format_of(path)
    with scene_gc.paused():
        if kind is None:
            scene = gltf.read(path, budget, allow_outside, variant)
        else:
            scene = process.read(path, kind, budget, limits or Limits(), allow_outside, up, variant)
    scene_gc.watch(scene)
    if up == "z" and kind is None:
        _turn_upright(scene)
    if isinstance(environment, Environment):
        scene.environment = environment
    elif environment is not None:
        scene.environment = read_environment(_checked(environment, "environment"), budget)
    elif (
        scene.environment is None
        and not has_lights(scene)
        and (share := emitted_illuminance(scene) / SKY_ILLUMINANCE) < _LEAST_SHARE
    ):
        what = f"emits {share:.1g} times what a sky would give" if share else "has no light"
        warnings.warn(
            f"{printable(path)}: {what}, so a neutral sky lights it; an environment would replace that", stacklevel=2
        )
        scene.environment = default_environment()
    return scene


def _turn_upright(scene: Scene) -> None:
    """Put the whole scene under one node, which rotates +Z to +Y."""
    upright = Node("z is up")
    upright.transform = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
    for root in list(scene.roots):
        scene.remove(root)
        upright.add(root)
    scene.add(upright)


def _checked(path: str | Path, name: str) -> Path:
    try:
        return Path(path)
    except TypeError:
        raise SceneError(f"{name}: {path!r} is not the path of a file") from None


def default_environment(width: int = 256) -> Environment:
    """A grey sky over darker ground with one broad key light from the upper right front; 1 nit on average."""
    height = width // 2
    azimuth = ((np.arange(width) + 0.5) / width - 0.5) * 2 * np.pi
    polar = (np.arange(height) + 0.5) / height * np.pi
    up = np.cos(polar)[:, None]
    outward = np.sin(polar)[:, None]
    direction = np.stack(np.broadcast_arrays(outward * np.cos(azimuth), up, outward * np.sin(azimuth)), axis=-1)
    sky = np.where(up > 0, 0.7 + 0.3 * (1 - np.abs(up)), 0.25 + 0.2 * (1 - np.abs(up)))
    key = 12.0 * np.maximum(direction @ _KEY_DIRECTION, 0.0) ** 40
    grey = sky + key
    grey /= np.average(grey, weights=np.broadcast_to(outward, grey.shape))  # outward is also a pixel's solid angle
    radiance = np.repeat(grey[..., None], 3, axis=2).astype(np.float32)
    return Environment(radiance, name="neutral sky")


_KEY_DIRECTION: NDArray[np.float64] = np.array([0.5, 0.7, 0.6]) / np.linalg.norm([0.5, 0.7, 0.6])


def read_environment(path: Path, budget: Budget | None = None) -> Environment:
    """The surroundings in a .hdr, .exr or .ktx2 file, or in a .png or .jpg of 0 to 1 nit. Raises SceneError."""
    budget, name = budget or Budget(), printable(path)
    radiance = pictures.read_radiance(path, budget.take_picture, lambda length: budget.read_file(path, length))
    try:
        if not np.isfinite(radiance).all():
            raise SceneError(f"{name}: holds radiance that is not finite")
        np.maximum(radiance, 0, out=radiance)  # filtering leaves values a little below zero
        return Environment(radiance, name=path.stem)
    except MemoryError:
        raise SceneError(f"{name}: takes more memory than there is") from None


def read_exr(path: str | Path, *, limits: Limits | None = None) -> dict[str, NDArray[np.generic]]:
    """The channels of an OpenEXR file by name, such as "R", "depth.Z" and "instance" of one that Frame.save wrote.

    Each is (height, width), of the file's own type: float32, float16 or uint32. `limits` as load's. Raises SceneError,
    one line that names the file and the fault.
    """
    path, budget = _checked(path, "path"), Budget(limits)
    return pictures.read_exr(path, budget.take_picture, lambda length: budget.read_file(path, length))

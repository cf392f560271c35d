"""The G-buffer as arrays for people: metres, unit vectors, colours, numbers."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.gpu_scene.scene import GpuScene
from pica.scene.camera import Camera

Array = NDArray[Any]


def gbuffer_aovs(
    textures: Mapping[str, spy.Texture], scene: GpuScene, camera: Camera
) -> dict[str, Callable[[], Array]]:
    """Functions that fetch each AOV of a G-buffer; (height, width) or (height, width, channels).

    depth: metres along the view axis, infinity where there is nothing. normal: with normal maps, world space, 0 where
    there is nothing. albedo: base colour. motion: pixels right and down to where the surface was in the previous frame.
    instance: number of the node in the scene's order, from 1; material: number from 1; 0 where there is nothing.
    """

    def fetch(name: str) -> Array:
        return np.asarray(textures[name].to_numpy())

    labels = scene.labels()  # of now: a later frame may have other nodes

    def label(which: int) -> Array:
        seen = fetch("visibility")[..., 0].astype(np.int64)
        return np.where(seen > 0, labels[np.maximum(seen - 1, 0), which], 0).astype(np.uint32)

    def depth() -> Array:
        values = fetch("depth")
        with np.errstate(divide="ignore"):
            if camera.orthographic_height is None:
                return np.asarray(camera.near / values, np.float32)
        return np.where(values > 0, camera.far - values * (camera.far - camera.near), np.inf).astype(np.float32)

    return {
        "depth": depth,
        "normal": lambda: _normals(fetch("normals")[..., 1], fetch("visibility")[..., 0] > 0),
        "geometric_normal": lambda: _normals(fetch("normals")[..., 0], fetch("visibility")[..., 0] > 0),
        "albedo": lambda: _albedo(fetch("material")),
        "metallic": lambda: ((fetch("material")[..., 1] >> 16 & 0xFF) / 255).astype(np.float32),
        "roughness": lambda: ((fetch("material")[..., 2] & 0xFFFF) / 65535).astype(np.float32),
        "emission": lambda: fetch("emission")[..., :3],
        "motion": lambda: fetch("motion")[..., :2],
        "instance": lambda: label(0),
        "material": lambda: label(1),
    }


def _albedo(packed: Array) -> Array:
    channels = np.stack([packed[..., 0] & 0xFFFF, packed[..., 0] >> 16, packed[..., 1] & 0xFFFF], axis=-1)
    return (channels / 65535).astype(np.float32)


def _normals(packed: Array, covered: Array) -> Array:
    """As unpackNormal in shaders/packing.slang."""
    plane = np.stack([packed & 0xFFFF, packed >> 16], axis=-1).astype(np.uint16).view(np.int16)
    plane = np.maximum(plane.astype(np.float32) / 32767, -1)
    height = 1 - np.abs(plane).sum(-1)
    folded = (1 - np.abs(plane[..., ::-1])) * np.where(plane >= 0, 1, -1)
    plane = np.where(height[..., None] < 0, folded, plane)
    vectors = np.concatenate([plane, height[..., None]], axis=-1)
    vectors /= np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-20)
    return np.where(covered[..., None], vectors, 0).astype(np.float32)

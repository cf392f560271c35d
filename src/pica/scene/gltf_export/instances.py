"""Copies of a mesh: EXT_mesh_gpu_instancing, or matrices in a node's extras where copies are sheared."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.scene.animation import compose
from pica.scene.gltf_export.container import Asset
from pica.scene.keyframes import Floats

_OFF = 1e-5
"""By how much a composed matrix may differ, of its largest number."""
_LARGE = 0.4999
"""One component of a unit quaternion has this at least, a little less than the half of four that are equal."""
_DEFAULTS = {"TRANSLATION": None, "ROTATION": (0, 0, 0, 1), "SCALE": (1, 1, 1)}


def instancing(asset: Asset, instances: Floats) -> tuple[dict[str, Any] | None, int | None]:
    """The extension for copies, (count, 4, 4), or the accessor of their matrices for the extras."""
    parts = _decomposed(instances)
    composed = compose(*(part.astype(np.float64) for part in parts))
    if not (np.abs(composed - instances) <= _OFF * np.abs(instances).max(axis=(1, 2), keepdims=True)).all():
        return None, asset.accessor(instances)
    attributes = {
        name: asset.accessor(part)
        for (name, default), part in zip(_DEFAULTS.items(), parts, strict=True)
        if default is None or (part != default).any()
    }
    return {"attributes": attributes}, None


def _decomposed(matrices: Floats) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Translation (count, 3), rotation (count, 4) and scale (count, 3); of matrices without shear, the same ones."""
    linear = matrices[:, :3, :3]
    scale = np.linalg.norm(linear, axis=1)
    scale[:, 0] *= np.where(np.linalg.det(linear) < 0, -1, 1)
    turned = linear / np.where(scale == 0, 1, scale)[:, None]
    return matrices[:, :3, 3].astype(np.float32), _stable(quaternions(turned)), scale.astype(np.float32)


def quaternions(rotations: Floats) -> Floats:
    """(count, 4) x, y, z, w, the first of w, x, y, z that is not 0 above it."""
    # Shepperd 1978, "Quaternion from Rotation Matrix": the largest component is found without cancellation
    (a, b, c), (d, e, f), (g, h, i) = rotations.transpose(1, 2, 0)
    rows = np.array(
        [
            [1 + a - e - i, b + d, c + g, h - f],
            [b + d, 1 - a + e - i, f + h, c - g],
            [c + g, f + h, 1 - a - e + i, d - b],
            [h - f, c - g, d - b, 1 + a + e + i],
        ]
    ).transpose(2, 0, 1)
    largest = np.argmax(np.diagonal(rows, axis1=1, axis2=2), axis=1)
    found = rows[np.arange(len(rows)), largest]
    found /= np.linalg.norm(found, axis=1, keepdims=True)
    ordered = np.where(np.abs(found) > 1e-6, found, 0)[:, [3, 0, 1, 2]]
    first = np.argmax(ordered != 0, axis=1)
    return found * np.sign(ordered[np.arange(len(found)), first])[:, None]


def _stable(quaternions: Floats) -> NDArray[np.float32]:
    """The unit quaternions rounded such that they are the same after being normalized and rounded again.

    One of the largest components follows from the others as rounded. The length is then so near 1 that normalizing
    moves these by less than half a digit.
    """
    rounded = quaternions.astype(np.float32)
    rows, large = np.arange(len(rounded)), np.argmax(np.abs(quaternions) >= _LARGE, axis=1)
    squares = rounded.astype(np.float64) ** 2
    squares[rows, large] = 0
    rest = np.sqrt(np.maximum(1 - squares.sum(axis=1), 0))
    rounded[rows, large] = np.copysign(rest, quaternions[rows, large])
    return rounded

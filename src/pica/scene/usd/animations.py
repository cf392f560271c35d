"""Time samples of transforms become keys of translation, rotation and scale."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from pica.errors import SceneError
from pica.scene.animation import compose
from pica.scene.gltf_export.instances import quaternions
from pica.scene.usd.stage import Stage

_MOST_KEYS = 1_000_000
"""Of all nodes: the rotation between samples is sampled too."""
_OFF = 1e-4
"""By how much a composed matrix may differ, of its largest number."""
_STRAIGHT = (UsdGeom.XformOp.TypeTranslate, UsdGeom.XformOp.TypeScale)


class Pose(NamedTuple):
    """Translation, rotation and scale, (keys, 3), (keys, 4) x, y, z, w, and (keys, 3)."""

    translation: NDArray[np.float64]
    rotation: NDArray[np.float64]
    scale: NDArray[np.float64]


class Animations:
    """The one animation of a stage, of all nodes; 0 s is its start time code."""

    def __init__(self, stage: Stage) -> None:
        self._stage, self._asset = stage, stage.conversion.asset
        self._samplers: list[dict[str, Any]] = []
        self._channels: list[dict[str, Any]] = []
        self._keys = 0

    def times(self, xform: UsdGeom.Xformable) -> list[float]:
        """Time codes from the start on at which a prim's transform is sampled; fewer than two if it stands still."""
        given = list(xform.GetTimeSamples())
        if len(given) < 2:
            return []
        curved = len(xform.GetOrderedXformOps()) > 3 or any(
            op.GetOpType() not in _STRAIGHT for op in xform.GetOrderedXformOps()
        )
        return self.sampled(given, curved)

    def sampled(self, given: list[float], curved: bool) -> list[float]:
        """Samples from the start on; `curved`: and the whole time codes between them. Raises SceneError."""
        start = self._stage.start
        if curved and given[-1] - given[0] < _MOST_KEYS:
            codes = np.arange(np.ceil(given[0]), np.floor(given[-1]) + 1)
            given = sorted({*given, *codes.tolist()})
        times = sorted({max(each, start) for each in given})
        self._keys += len(times)
        if self._keys > _MOST_KEYS:
            raise SceneError(f"its animations have more than {_MOST_KEYS:,} keys")
        return times

    def add(self, node: int, times: list[float], values: dict[str, NDArray[Any]]) -> None:
        """Keys of a node, by glTF's names of what moves."""
        seconds = (np.array(times) - self._stage.start) / self._stage.codes_per_second
        for path, keys in values.items():
            if path != "weights" and (keys == keys[0]).all():
                continue
            output = keys.reshape(-1) if path == "weights" else keys
            sampler = {
                "input": self._asset.accessor(seconds.astype(np.float32), bounded=True),
                "output": self._asset.accessor(output.astype(np.float32)),
            }
            self._samplers.append(sampler)
            self._channels.append({"sampler": len(self._samplers) - 1, "target": {"node": node, "path": path}})

    def finish(self) -> None:
        """Add the animation, if anything moves."""
        if self._channels:
            self._asset.add("animations", {"name": "stage", "samplers": self._samplers, "channels": self._channels})

    def pose(self, xform: UsdGeom.Xformable, times: list[float]) -> Pose | None:
        """The poses of a prim at time codes; None, with a warning, where they are sheared."""
        matrices = np.array([np.array(xform.GetLocalTransformation(Usd.TimeCode(time))) for time in times])
        pose = decomposed(matrices.transpose(0, 2, 1))
        if pose is None:
            self._stage.conversion.warn(f"{xform.GetPath()}: its motion has shear and is left out")
        return pose


def decomposed(matrices: NDArray[np.float64]) -> Pose | None:
    """Of (keys, 4, 4) without shear, for column vectors; None for others."""
    linear = matrices[:, :3, :3]
    scale = np.linalg.norm(linear, axis=1)
    scale[:, 0] *= np.where(np.linalg.det(linear) < 0, -1, 1)
    # A scale of 0 has no axis; the next key's would jump.
    rotation = quaternions(linear / np.where(np.abs(scale) < 1e-12, 1, scale)[:, None])
    for key in range(1, len(rotation)):
        if rotation[key] @ rotation[key - 1] < 0:
            rotation[key] *= -1
    pose = Pose(matrices[:, :3, 3], rotation, scale)
    largest = np.maximum(np.abs(matrices).max(axis=(1, 2), keepdims=True), 1e-12)
    return pose if (np.abs(compose(*pose) - matrices) <= _OFF * largest).all() else None

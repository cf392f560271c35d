"""Values between keys (glTF 2.0, 3.11 and appendix C)."""

from collections.abc import Callable, Sequence
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from pica.scene.arrays import doubles
from pica.scene.values import LARGEST, Check, UnfitError

Floats = NDArray[np.float64]
Interpolation = Literal["STEP", "LINEAR", "CUBICSPLINE"]
NO_TURN = "a quaternion of zeros is no rotation"


_KEYS = {(1,): "(keys,)", (2, 3): "(keys, components) or, for CUBICSPLINE, (keys, 3, components)"}


def keyed(*dimensions: int) -> Check[Floats]:
    """A float64 array with this number of dimensions. Keyframes checks all of them for finite values at once."""

    def check(values: Any) -> Floats:
        if not (type(values) is np.ndarray and values.dtype == np.float64):
            values = doubles()(values)
        if values.ndim not in dimensions or not len(values):
            raise UnfitError(f"has the shape {values.shape}; give one or more keys, {_KEYS[dimensions]}")
        return np.asarray(values)

    return check


class Keys(Protocol):
    """Keys of a channel."""

    @property
    def times(self) -> Floats:
        """(keys,) seconds."""

    @property
    def values(self) -> Floats:
        """(keys, components); CUBICSPLINE: (keys, 3, components)."""

    @property
    def interpolation(self) -> Interpolation:
        """How values change between keys."""


class Keyframes:
    """Channels of one interpolation and number of components: sampled in one go. `turns`: values are quaternions."""

    def __init__(self, channels: Sequence[Keys], turns: bool, label: Callable[[int], str]) -> None:
        """Raises UnfitError, with the `label` of the channel at fault by its index."""
        self._interpolation, self._turns = channels[0].interpolation, turns
        self._times = np.concatenate([channel.times for channel in channels]).astype(np.float64)
        self._values = np.concatenate([channel.values for channel in channels]).astype(np.float64)
        counts = np.array([len(channel.times) for channel in channels])
        self._first = np.cumsum(counts) - counts
        self._last = self._first + counts - 1
        self._check(label)
        if turns and self._interpolation != "CUBICSPLINE":
            self._values = unit(self._values)

    def _check(self, label: Callable[[int], str]) -> None:
        descends = np.diff(self._times, prepend=-np.inf) < 0
        descends[self._first] = False
        faults = {
            "times are not finite": ~(np.abs(self._times) <= LARGEST),
            "times do not ascend": descends,
            "values are not finite, or too large for 32-bit floats": ~(np.abs(self._values) <= LARGEST),
        }
        if self._turns:
            values = self._values[:, 1] if self._interpolation == "CUBICSPLINE" else self._values
            faults[NO_TURN] = ~(np.linalg.norm(values, axis=1) > 0)
        for fault, bad in faults.items():
            if bad.any():
                row = int(np.argwhere(bad)[0][0])
                channel = int(np.searchsorted(self._first, row, "right")) - 1
                key = f"key {row - self._first[channel]}"
                raise UnfitError(f"{label(channel)}: {fault} ({key})")

    def at(self, time: float) -> Floats:
        """(channels, components) at `time`."""
        before, after = self._keys_around(time)
        start, length = self._times[before], self._times[after] - self._times[before]
        elapsed = np.where(length > 0, (time - start) / np.where(length > 0, length, 1), 1)
        fraction = np.clip(elapsed, 0, 1)[:, None]
        if self._interpolation == "CUBICSPLINE":
            return self._spline(before, after, fraction, length[:, None])
        if self._interpolation == "STEP":
            fraction = np.floor(fraction)
        if self._turns:
            return _slerp(self._values[before], self._values[after], fraction)
        return self._values[before] * (1 - fraction) + self._values[after] * fraction

    def _keys_around(self, time: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """(channels,) the keys between which `time` lies, by bisection in all channels at once."""
        before, after = self._first, self._last
        while (after - before > 1).any():
            middle = (before + after) // 2
            passed = self._times[middle] <= time
            before, after = np.where(passed, middle, before), np.where(passed, after, middle)
        return before, after

    def _spline(self, before: NDArray[np.intp], after: NDArray[np.intp], t: Floats, length: Floats) -> Floats:
        # glTF 2.0, appendix C.5: a cubic Hermite spline whose tangents are scaled by the time between the keys
        value, leaving = self._values[before, 1], self._values[before, 2] * length
        next_value, arriving = self._values[after, 1], self._values[after, 0] * length
        t2, t3 = t * t, t * t * t
        result = (
            (2 * t3 - 3 * t2 + 1) * value
            + (t3 - 2 * t2 + t) * leaving
            + (3 * t2 - 2 * t3) * next_value
            + (t3 - t2) * arriving
        )
        if not self._turns:
            return result
        return unit(np.where(result.any(axis=1, keepdims=True), result, value))


def _slerp(start: Floats, end: Floats, fraction: Floats) -> Floats:
    """(count, 4) unit quaternions on the shorter arc from start to end."""
    # glTF 2.0, appendix C.4
    cosine = np.sum(start * end, axis=1, keepdims=True)
    angle = np.arccos(np.minimum(np.abs(cosine), 1.0))
    sine = np.sin(angle)
    curved = sine > 1e-6  # otherwise linear interpolation is accurate
    divisor = np.where(curved, sine, 1.0)
    from_start = np.where(curved, np.sin(angle * (1 - fraction)) / divisor, 1 - fraction)
    from_end = np.where(curved, np.sin(angle * fraction) / divisor, fraction)
    return unit(from_start * start + np.copysign(from_end, cosine) * end)


def unit(quaternions: Floats) -> Floats:
    """(count, 4) of length 1, of any length but 0."""
    return quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)

"""Geometry other than triangles: spheres, capsules, rings, rounded boxes and users' own shapes."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pica.errors import SceneError, shown
from pica.scene.arrays import doubles, floats, numbers
from pica.scene.changes import Followed
from pica.scene.checked_field import check_again, read_only
from pica.scene.construction import fields_only
from pica.scene.material import Material
from pica.scene.tracked_field import TrackedField
from pica.scene.values import UnfitError, checked, instance, text

_Floats = NDArray[np.float64]


def _arrays(values: Any) -> dict[str, NDArray[np.generic]]:
    """Parameters by name."""
    kept = {}
    for name, given in instance(dict)(values).items():
        try:
            kept[text(name)] = read_only(numbers()(given))
        except UnfitError as unfit:
            raise UnfitError(f"{shown(name)}: {unfit}") from None
    return kept


@fields_only
@dataclass(eq=False)
class Primitives(Followed):
    """A part of a mesh with one material: primitives of one shape, which rays intersect analytically.

    The functions below make the built-in shapes; docs/guide/primitives.md describes others. Raises SceneError for
    inconsistent arrays.
    """

    shape: TrackedField[str] = TrackedField(text)
    """"sphere", "capsule", "torus", "rounded_box", or the name that register_shape gave to one of your own."""
    parameters: TrackedField[dict[str, NDArray[np.generic]]] = TrackedField(_arrays)
    """The fields of the shape's `struct Parameters`: (count,) or (count, components) each."""
    bounds: TrackedField[NDArray[np.float32]] = TrackedField(floats())
    """(count, 2, 3) metres, object space: lowest and highest corner of each primitive's bounds."""
    material: TrackedField[Material] = TrackedField(instance(Material))

    def __post_init__(self) -> None:
        primitives = f"primitives of shape {self.shape!r}"
        if self.bounds.ndim != 3 or self.bounds.shape[1:] != (2, 3):
            raise SceneError(f"{primitives}: bounds are {self.bounds.shape}, not (count, 2, 3)")
        if not (self.bounds[:, 0] <= self.bounds[:, 1]).all():
            raise SceneError(f"{primitives}: bounds are not finite, or low lies above high")
        for name, values in self.parameters.items():
            if values.ndim not in (1, 2) or len(values) != len(self):
                fault = f"parameter {shown(name)} is {values.shape}, but there are {len(self)} bounds"
                raise SceneError(f"{primitives}: {fault}")

    def check(self) -> None:
        """Raises SceneError when the arrays, as they are now, do not fit their fields or each other."""
        check_again(self)
        self.__post_init__()

    def __len__(self) -> int:
        return len(self.bounds)


def spheres(centers: ArrayLike, radii: ArrayLike, material: Material) -> Primitives:
    """Spheres round (n, 3) `centers` with (n,) `radii`, or one for all; metres."""
    center, radius = _points("sphere", centers), _lengths("sphere", radii, centers)
    return _made("sphere", material, center - radius[:, None], center + radius[:, None], center=center, radius=radius)


def capsules(starts: ArrayLike, ends: ArrayLike, radii: ArrayLike, material: Material) -> Primitives:
    """Spheres of (n,) `radii` swept from (n, 3) `starts` to (n, 3) `ends`; metres."""
    start, end, radius = _points("capsule", starts), _points("capsule", ends), _lengths("capsule", radii, starts)
    if start.shape != end.shape:
        raise SceneError(f"primitives of shape 'capsule': {len(start)} starts, but {len(end)} ends")
    low, high = np.minimum(start, end) - radius[:, None], np.maximum(start, end) + radius[:, None]
    return _made("capsule", material, low, high, start=start, end=end, radius=radius)


def tori(centers: ArrayLike, radii: ArrayLike, tube_radii: ArrayLike, material: Material) -> Primitives:
    """Rings about axes parallel to Y through (n, 3) `centers`; metres.

    (n,) `radii` reach to the middle of the tubes, whose own are `tube_radii`. Nodes and instances rotate them.
    """
    center, radius = _points("torus", centers), _lengths("torus", radii, centers)
    tube = _lengths("torus", tube_radii, centers)
    reach = np.stack([radius + tube, tube, radius + tube], -1)
    return _made("torus", material, center - reach, center + reach, center=center, radius=radius, tubeRadius=tube)


def rounded_boxes(centers: ArrayLike, sizes: ArrayLike, radii: ArrayLike, material: Material) -> Primitives:
    """Boxes along the axes of (n, 3) `sizes` round (n, 3) `centers`, edges rounded by (n,) `radii`; metres."""
    center, radius = _points("rounded_box", centers), _lengths("rounded_box", radii, centers)
    given = checked("primitives of shape 'rounded_box': sizes", doubles(), sizes)
    if given.shape not in ((), (3,), (1, 3), center.shape):
        raise SceneError(f"primitives of shape 'rounded_box': {given.shape} sizes for {len(center)} places")
    half = np.broadcast_to(given / 2, center.shape)
    if (half.min(1, initial=np.inf) < radius).any():
        raise SceneError("primitives of shape 'rounded_box': a radius is larger than half of the box's least size")
    return _made("rounded_box", material, center - half, center + half, center=center, halfSize=half, radius=radius)


def _made(shape: str, material: Material, low: _Floats, high: _Floats, **parameters: _Floats) -> Primitives:
    # Rounded outwards, by more than the shapes' own rounding.
    slack = 1e-6 * (np.abs(low) + np.abs(high))
    given: dict[str, NDArray[np.generic]] = {name: values.astype(np.float32) for name, values in parameters.items()}
    return Primitives(shape, given, np.stack([low - slack, high + slack], 1), material)


def _points(shape: str, values: ArrayLike) -> NDArray[np.float64]:
    points = checked(f"primitives of shape {shape!r}: places", doubles(), values)
    if points.ndim != 2 or points.shape[1] != 3:
        raise SceneError(f"primitives of shape {shape!r}: places are {points.shape}, not (count, 3)")
    return points


def _lengths(shape: str, values: ArrayLike, points: ArrayLike) -> NDArray[np.float64]:
    count = len(_points(shape, points))
    try:
        lengths = doubles()(values)
    except UnfitError as unfit:
        raise SceneError(f"primitives of shape {shape!r}: a radius is negative or not a number; {unfit}") from None
    if lengths.shape not in ((), (count,)):
        raise SceneError(f"primitives of shape {shape!r}: {lengths.shape} radii for {count} places")
    if not (lengths >= 0).all():
        raise SceneError(f"primitives of shape {shape!r}: a radius is negative or not a number")
    return np.broadcast_to(lengths, (count,))

"""Bounds of meshes in the world: of all, and of the subject.

A picture of an object on a large ground should show the object. Grounds, walls and skies, the backdrop, are detected
from sizes alone:

* a part is flat if it is ten times as wide as thick; flat parts of one size in one plane, such as tiles, are merged;
* flat parts are backdrop if they extend over twice as far as all parts that are not flat;
* a part that is not flat is backdrop if it encloses all others and is eight times as large, like a sky;
* if all parts are flat, a part much larger than all others is backdrop. If nothing else is left, there is none.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pica.errors import SceneError
from pica.scene.camera import Camera
from pica.scene.checked_field import described
from pica.scene.mesh import Mesh
from pica.scene.node import Node, all_instance_transforms
from pica.scene.skin import deformed_positions
from pica.scene.values import LARGEST

Floats = NDArray[np.float64]
Box = tuple[Floats, Floats]
"""Lowest and highest corner."""

_FLAT = 0.1
"""Of a part's thickness to the shorter of its other two sides."""
_BACKDROP = 2.0
"""Minimum size of a ground or a wall, over that of the subject."""
_SKY = 8.0
"""Minimum size of an enclosing part, likewise."""
_SAME_PLANE = 0.05
"""Tolerances for merging planes: radians between them, and their distance over the size of the subject."""
_TINY = float(np.finfo(np.float64).tiny)
_ROOM = 0.95
"""Of the distance to a wall, to which a camera may back away."""


@dataclass(frozen=True)
class _Placed:
    """A mesh, wherever nodes show it."""

    parts: Floats
    """(parts, 2, 3) lowest and highest corners of sections and primitives, in the mesh's own space."""
    world: Floats
    """(copies, 4, 4)"""
    low: Floats
    """(copies, 3) of the box round all parts, in the world."""
    high: Floats


@dataclass(frozen=True)
class _Parts:
    """Parts of meshes in the world, one row each."""

    low: Floats
    high: Floats
    normal: Floats
    """(n, 3) across their thinnest side."""
    flat: NDArray[np.bool_]

    def __getitem__(self, rows: NDArray[np.bool_]) -> "_Parts":
        return _Parts(self.low[rows], self.high[rows], self.normal[rows], self.flat[rows])


def whole_box(nodes: Iterable[Node]) -> Box:
    """The bounds of all meshes; a unit box if there are none. Raises SceneError."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for placed in _all_placed(nodes):
        low, high = (
            np.minimum(low, placed.low.min(0, initial=np.inf)),
            np.maximum(high, placed.high.max(0, initial=-np.inf)),
        )
    return _or_unit(low, high)


def subject_box(nodes: Iterable[Node]) -> Box:
    """The bounds of the subject; a unit box if there is none. Raises SceneError."""
    parts = _parts(nodes)
    return _box(parts[~_backdrops(parts)])


def framed(nodes: Iterable[Node], aspect: float) -> Camera:
    """A camera that frames the subject, on this side of surrounding walls if there is room. Raises
    SceneError."""
    parts = _parts(nodes)
    behind = _backdrops(parts)
    low, high = _box(parts[~behind])
    camera = Camera.framing(low, high, aspect=aspect)
    if not behind.any():
        return camera
    room = _ROOM * _distance(parts[behind], (low + high) / 2, camera.transform[:3, 2])
    if math.isinf(room) or room < _diagonal(low, high) / 2:
        return camera
    return Camera.framing(low, high, aspect=aspect, farthest=room)


def _all_placed(nodes: Iterable[Node]) -> Iterator[_Placed]:
    alike: dict[Mesh | Node, list[Node]] = {}
    for node in nodes:
        if node.mesh is not None:
            alike.setdefault(node if node.deforms else node.mesh, []).append(node)
    for showing in alike.values():
        parts = _part_boxes(showing[0])
        if not len(parts):
            continue
        world, counts = all_instance_transforms(showing)
        low, high = parts[:, 0].min(0), parts[:, 1].max(0)
        corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
        points = np.einsum("nij,pj->npi", world[:, :3, :3], corners) + world[:, None, :3, 3]
        far = ~(np.abs(points) <= LARGEST).all((1, 2))
        if far.any():
            node = showing[int(np.repeat(np.arange(len(showing)), counts)[far][0])]
            raise SceneError(f"{described(node)}: its mesh is too large in the world for 32-bit floats")
        yield _Placed(parts, world, points.min(1), points.max(1))


def _part_boxes(node: Node) -> Floats:
    """(parts, 2, 3) bounds of parts that are not empty. Raises SceneError."""
    assert node.mesh is not None
    node.mesh.check()
    node.check()
    used = [
        (deformed_positions(section, node) if node.deforms else section.positions)[np.unique(section.indices)]
        for section in node.mesh.sections
        if len(section.indices)
    ]
    used += [primitives.bounds.reshape(-1, 3) for primitives in node.mesh.primitives if len(primitives.bounds)]
    boxes = [np.stack([points.min(0), points.max(0)]) for points in used]
    return np.stack(boxes).astype(np.float64) if boxes else np.zeros((0, 2, 3))


def _parts(nodes: Iterable[Node]) -> _Parts:
    rows: list[tuple[Floats, Floats, Floats, NDArray[np.bool_]]] = []
    for placed in _all_placed(nodes):
        axes, places = placed.world[:, :3, :3], placed.world[:, None, :3, 3]
        middle = np.einsum("nij,pj->npi", axes, placed.parts.mean(1)) + places
        reach = np.einsum("nij,pj->npi", np.abs(axes), np.ptp(placed.parts, axis=1) / 2)
        lengths = np.linalg.norm(axes, axis=1)
        sides = lengths[:, None] * np.ptp(placed.parts, axis=1)  # (copies, parts, 3)
        thin = sides.argmin(2)
        # Copies, parts and the axis across the thinnest side of each.
        across = np.swapaxes(axes, 1, 2)[np.arange(len(axes))[:, None], thin]
        across = across / np.maximum(np.linalg.norm(across, axis=2, keepdims=True), _TINY)
        ordered = np.sort(sides, axis=2)
        flat = ordered[..., 0] <= _FLAT * ordered[..., 1]
        rows.append(
            ((middle - reach).reshape(-1, 3), (middle + reach).reshape(-1, 3), across.reshape(-1, 3), flat.ravel())
        )
    if not rows:
        none = np.zeros((0, 3))
        return _Parts(none, none, none, np.zeros(0, bool))
    lows, highs, normals, flats = zip(*rows, strict=True)
    return _Parts(np.concatenate(lows), np.concatenate(highs), np.concatenate(normals), np.concatenate(flats))


def _backdrops(parts: _Parts) -> NDArray[np.bool_]:
    """(n,) which parts are grounds, walls and skies."""
    mask = _skies(parts)
    solid, flat = ~parts.flat & ~mask, parts.flat & ~mask
    if not flat.any():
        return mask
    size = _diagonal(*_box(parts[solid])) if solid.any() else float(_sizes(parts[flat]).min())
    plane = _planes(parts[flat], _SAME_PLANE * size)
    planes = plane.max() + 1
    low, high = np.full((planes, 3), np.inf), np.full((planes, 3), -np.inf)
    np.minimum.at(low, plane, parts.low[flat])
    np.maximum.at(high, plane, parts.high[flat])
    sizes = np.linalg.norm(high - low, axis=1)
    if not solid.any():
        size = _before_the_widest_gap(sizes)
    mask[flat] = (sizes > _BACKDROP * size)[plane]
    return mask


def _skies(parts: _Parts) -> NDArray[np.bool_]:
    """(n,) which parts are not flat and enclose all others by far."""
    mask = np.zeros(len(parts.low), bool)
    considered = ~parts.flat if np.count_nonzero(~parts.flat) > 1 else np.ones(len(parts.low), bool)
    sizes = np.where(considered, _sizes(parts), 0)
    for largest in np.argsort(sizes)[::-1]:
        others = considered & ~mask
        others[largest] = False
        if parts.flat[largest] or not others.any():
            break
        low, high = _box(parts[others])
        encloses = (parts.low[largest] <= low).all() and (parts.high[largest] >= high).all()
        if not (encloses and sizes[largest] > _SKY * _diagonal(low, high)):
            break
        mask[largest] = True
    return mask


def _planes(flat: _Parts, step: float) -> NDArray[np.intp]:
    """(n,) the same number for flat parts in one plane that are about as large."""
    normal = np.round(flat.normal / _SAME_PLANE) * _SAME_PLANE
    largest = np.abs(normal).argmax(1)[:, None]
    normal *= np.sign(np.take_along_axis(normal, largest, 1))
    distance = np.einsum("ni,ni->n", normal, (flat.low + flat.high) / 2)
    places = np.round(distance / max(step, _TINY))
    keys = np.column_stack([np.round(normal / _SAME_PLANE), places, np.floor(np.log2(np.maximum(_sizes(flat), _TINY)))])
    return np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1)


def _before_the_widest_gap(sizes: Floats) -> float:
    """The largest of the parts that are small compared with the rest; the largest of all if there is none."""
    ordered = np.sort(sizes)
    ratios = ordered[1:] / np.maximum(ordered[:-1], _TINY)
    widest = int(ratios.argmax()) if len(ratios) else 0
    return float(ordered[widest] if len(ratios) and ratios[widest] > _BACKDROP else ordered[-1])


def _distance(backdrops: _Parts, start: Floats, direction: Floats) -> float:
    """Metres from a point along a unit direction to the first of some backdrops."""
    middle, reach = (backdrops.low + backdrops.high) / 2, (backdrops.high - backdrops.low) / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        to_plane = np.einsum("ni,ni->n", backdrops.normal, middle - start) / (backdrops.normal @ direction)
        to_sides = (np.where(direction > 0, backdrops.high, backdrops.low) - start) / direction
    out = np.where(np.isfinite(to_sides), to_sides, np.inf).min(1)
    along = np.where(backdrops.flat, to_plane, out)
    is_hit = (along > 0) & np.isfinite(along)
    at = start + np.where(is_hit, along, 0)[:, None] * direction
    is_hit &= (np.abs(at - middle) <= reach * (1 + 1e-6) + 1e-9).all(1)
    return float(along[is_hit].min(initial=np.inf))


def _sizes(parts: _Parts) -> Floats:
    return np.asarray(np.linalg.norm(parts.high - parts.low, axis=1))


def _box(parts: _Parts) -> Box:
    return _or_unit(parts.low.min(0, initial=np.inf), parts.high.max(0, initial=-np.inf))


def _or_unit(low: Floats, high: Floats) -> Box:
    return (low, high) if (low <= high).all() else (np.full(3, -0.5), np.full(3, 0.5))


def _diagonal(low: Floats, high: Floats) -> float:
    return math.dist(low, high)

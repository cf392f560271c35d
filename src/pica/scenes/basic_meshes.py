"""Simple closed shapes as sections: boxes, shapes of revolution, pipes and planes.

Every shape is a grid of vertices with u to the right and v down when seen from outside, so faces run
counter-clockwise from the front, normals point outwards and the tangent frame is never mirrored (w = 1).
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pica.scene.material import Material
from pica.scene.model import Section

Floats = NDArray[np.float64]


def box(size: ArrayLike, material: Material, bevel: float = 0.0, segments: int = 2) -> Section:
    """A box round the origin with (x, y, z) `size` in metres; `bevel` is the radius of its rounded edges."""
    half = np.broadcast_to(np.asarray(size, np.float64) / 2, (3,))
    bevel = min(bevel, float(half.min()))
    angles = np.linspace(-np.pi / 4, 0, segments + 1) if bevel else np.zeros(1)
    # Along each axis of a face: the rounded edge, the flat middle, the rounded edge.
    angles = np.concatenate([angles, -angles[::-1]])
    side = np.repeat((-1.0, 1.0), len(angles) // 2)
    faces = []
    for out_axis in range(3):
        for sign in (1.0, -1.0):
            right, up, out = _face_axes(out_axis, sign)
            u, v = np.meshgrid(np.arange(len(angles)), np.arange(len(angles))[::-1])
            lean = np.tan(angles)[u][..., None] * right + np.tan(angles)[v][..., None] * up
            normals = _unit(out + lean)
            corners = out + side[u][..., None] * right + side[v][..., None] * up
            positions = corners * (half - bevel) + normals * bevel
            along_u = (positions @ np.abs(right)) * np.sign(right.sum()) / (2 * half[np.argmax(np.abs(right))]) + 0.5
            along_v = 0.5 - (positions @ np.abs(up)) * np.sign(up.sum()) / (2 * half[np.argmax(np.abs(up))])
            tangents = _unit(right - (normals @ right)[..., None] * normals)
            faces.append(_grid(positions, normals, tangents, np.stack([along_u, along_v], -1), material))
    return merged(faces)


def lathe(
    outline: ArrayLike,
    material: Material,
    fillet: float = 0.0,
    segments: int = 32,
    closed: bool = False,
    stretch: tuple[float, float] = (0.0, 0.0),
) -> Section:
    """A shape of revolution about +Y from an outline of (radius, height) points, from its top outwards and down.

    Corners are rounded by `fillet` metres, about as finely as the whole is round with `segments`. `closed` joins
    the last point to the first. `stretch` pulls the quarters apart by that many metres along (x, z) each way,
    which turns circles into rounded rectangles.
    """
    widest = float(np.max(np.asarray(outline)[:, 0]))
    steps = max(2 if closed else 1, round(segments / 4 * min(fillet / widest, 1)))
    points, directions = filleted(outline, fillet, steps, closed)
    angles = np.linspace(0, 2 * np.pi, segments + 1)
    pull = np.zeros((len(angles), 2))
    if any(stretch):
        quarter = np.linspace(0, np.pi / 2, max(segments // 4, 1) + 1)
        angles = np.concatenate([quarter + np.pi / 2 * quadrant for quadrant in range(4)] + [[2 * np.pi]])
        signs = np.array([(1, -1), (-1, -1), (-1, 1), (1, 1)], np.float64)
        pull = np.concatenate([np.repeat(signs, len(quarter), 0), signs[:1]]) * stretch
    cos, sin = np.cos(angles), -np.sin(angles)  # counter-clockwise from above: +X towards -Z
    radius, height = points[:, :1], points[:, 1:]
    apart = np.where(radius > 1e-9, 1.0, 0.0)  # vertices on the axis stay there and close the shape
    x, z = radius * cos + apart * pull[:, 0], radius * sin + apart * pull[:, 1]
    positions = np.stack(np.broadcast_arrays(x, height, z), -1)
    out, up = -directions[:, 1:], directions[:, :1]
    normals = np.stack(np.broadcast_arrays(out * cos, up, out * sin), -1)
    tangents = np.broadcast_to(np.stack([sin, np.zeros_like(sin), -cos], -1), positions.shape)
    return _grid(positions, normals, tangents, _grid_uv(positions), material)


def cylinder(radius: float, height: float, material: Material, fillet: float = 0.0, segments: int = 32) -> Section:
    """A cylinder along Y round the origin; a `fillet` of `radius` with enough height makes a capsule."""
    return frustum(radius, radius, height, material, fillet, segments)


def frustum(
    bottom: float, top: float, height: float, material: Material, fillet: float = 0.0, segments: int = 32
) -> Section:
    """A cone along Y round the origin, cut off at radius `top`; 0 leaves a tip."""
    half = height / 2
    return lathe([(0, half), (top, half), (bottom, -half), (0, -half)][top == 0 :], material, fillet, segments)


def sphere(radius: float, material: Material, segments: int = 32) -> Section:
    """A sphere round the origin."""
    outline = [(0, radius), (radius, radius), (radius, -radius), (0, -radius)]
    return lathe(outline, material, radius, segments)


def torus(radius: float, tube_radius: float, material: Material, segments: int = 32) -> Section:
    """A ring round the Y axis; `radius` reaches to the middle of its tube."""
    inner, outer = radius - tube_radius, radius + tube_radius
    outline = [(outer, tube_radius), (outer, -tube_radius), (inner, -tube_radius), (inner, tube_radius)]
    return lathe(outline, material, tube_radius, segments, closed=True)


def ring(
    inner: float, outer: float, height: float, material: Material, fillet: float = 0.0, segments: int = 32
) -> Section:
    """A short pipe along Y round the origin, with walls from radius `inner` to `outer`."""
    half = height / 2
    outline = [(outer, half), (outer, -half), (inner, -half), (inner, half)]
    return lathe(outline, material, fillet, segments, closed=True)


def plate(size: ArrayLike, corner: float, material: Material, bevel: float = 0.0, segments: int = 32) -> Section:
    """A flat (x, y, z) slab round the origin whose outline has round corners of radius `corner`."""
    width, height, depth = np.broadcast_to(np.asarray(size, np.float64), (3,))
    stretch = (float(width) / 2 - corner, float(depth) / 2 - corner)
    half = float(height) / 2
    return lathe([(0, half), (corner, half), (corner, -half), (0, -half)], material, bevel, segments, stretch=stretch)


def plane(width: float, depth: float, material: Material, cells: int = 1) -> Section:
    """A rectangle in XZ that faces +Y, `cells` by `cells` quads; the texture's top is towards -Z."""
    u, v = np.meshgrid(np.linspace(0, 1, cells + 1), np.linspace(0, 1, cells + 1))
    positions = np.stack([(u - 0.5) * width, np.zeros_like(u), (v - 0.5) * depth], -1)
    up, right = (np.broadcast_to(np.eye(3)[axis], positions.shape) for axis in (1, 0))
    return _grid(positions, up, right, np.stack([u, v], -1), material)


def pipe(path: ArrayLike, radius: float, material: Material, segments: int = 12) -> Section:
    """A round pipe with flat ends along `path`, (points, 3) metres; use `filleted` for smooth bends."""
    points = np.asarray(path, np.float64)
    points = points[np.append(True, np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-9)]
    ahead = _unit(np.diff(points, axis=0))
    forward = _unit(np.concatenate([ahead[:1], ahead[:-1] + ahead[1:], ahead[-1:]]))
    side = _transported(forward)
    angles = np.linspace(0, 2 * np.pi, segments + 1)
    # v runs along the path, so u runs clockwise as seen from its end.
    cos, sin = np.cos(angles)[:, None], -np.sin(angles)[:, None]
    other = np.cross(forward, side)
    out = cos * side[:, None] + sin * other[:, None]
    round_u = -(np.sin(angles)[:, None] * side[:, None] + np.cos(angles)[:, None] * other[:, None])
    rings = points[:, None] + radius * out
    centers = np.broadcast_to(points[:, None], rings.shape)
    ends = np.broadcast_to(forward[:, None], rings.shape)
    positions = np.concatenate([centers[:1], rings[:1], rings, rings[-1:], centers[-1:]])
    normals = np.concatenate([-ends[:1], -ends[:1], out, ends[-1:], ends[-1:]])
    tangents = np.concatenate([round_u[:1], round_u[:1], round_u, round_u[-1:], round_u[-1:]])
    return _grid(positions, normals, tangents, _grid_uv(positions), material)


def filleted(points: ArrayLike, radius: float, segments: int = 4, closed: bool = False) -> tuple[Floats, Floats]:
    """A polyline with its corners rounded by arcs: positions and unit directions, (count, dimensions) each.

    A corner that stays sharp appears twice, once with the direction of either side. Radii shrink where a
    corner has no room.
    """
    corners = np.asarray(points, np.float64)
    if closed:  # begin and end halfway along an edge
        middle = (corners[:1] + corners[-1:]) / 2
        corners = np.concatenate([middle, corners, middle])
    edges = np.diff(corners, axis=0)
    lengths = np.linalg.norm(edges, axis=1)
    along = edges / lengths[:, None]
    last = len(along) - 1
    positions, directions = [corners[:1]], [along[:1]]
    for i in range(last):
        before, after = along[i], along[i + 1]
        bend = np.arccos(np.clip(before @ after, -1, 1))
        # An edge between two corners lends each of them half of its length.
        room = min(lengths[i] / (1 if i == 0 else 2), lengths[i + 1] / (1 if i + 1 == last else 2))
        cut = min(radius * np.tan(bend / 2), room)
        toward = after - (before @ after) * before
        if cut < 1e-9 or np.linalg.norm(toward) < 1e-9:
            positions.append(corners[[i + 1, i + 1]])
            directions.append(np.stack([before, after]))
            continue
        angle = np.linspace(0, bend, segments + 1)[:, None]
        toward = toward / np.linalg.norm(toward)
        arc = np.sin(angle) * before + (1 - np.cos(angle)) * toward
        positions.append(corners[i + 1] - cut * before + cut / np.tan(bend / 2) * arc)
        directions.append(np.cos(angle) * before + np.sin(angle) * toward)
    return np.concatenate([*positions, corners[-1:]]), np.concatenate([*directions, along[-1:]])


def transformed(section: Section, matrix: ArrayLike) -> Section:
    """A copy moved by a (4, 4) matrix; a mirroring one keeps faces counter-clockwise."""
    full = np.asarray(matrix, np.float64)
    linear = full[:3, :3]
    mirrored = np.linalg.det(linear) < 0
    tangents = section.tangents.copy()
    tangents[:, :3] = _unit(section.tangents[:, :3] @ linear.T)
    tangents[:, 3] *= -1 if mirrored else 1
    return Section(
        positions=(section.positions @ linear.T + full[:3, 3]).astype(np.float32),
        normals=_unit(section.normals @ np.linalg.inv(linear)).astype(np.float32),
        tangents=tangents,
        uv0=section.uv0,
        uv1=section.uv1,
        colors=section.colors,
        indices=section.indices[:, ::-1] if mirrored else section.indices,
        material=section.material,
    )


def merged(sections: list[Section]) -> Section:
    """One section with the triangles of all, which share the first one's material."""
    starts = np.cumsum([0] + [len(section.positions) for section in sections[:-1]])
    attributes: dict[str, Any] = {
        name: np.concatenate([getattr(section, name) for section in sections])
        for name in ("positions", "normals", "tangents", "uv0", "uv1", "colors")
    }
    return Section(
        **attributes,
        indices=np.concatenate([s.indices + np.uint32(start) for s, start in zip(sections, starts, strict=True)]),
        material=sections[0].material,
    )


def _grid(positions: Floats, normals: Floats, tangents: Floats, uv: Floats, material: Material) -> Section:
    """A section from (rows, columns, …) attributes; triangles without area are left out."""
    rows, columns = positions.shape[:2]
    first = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    below = first + columns
    indices = np.concatenate([np.stack([first, below, below + 1], -1), np.stack([first, below + 1, first + 1], -1)])
    flat = positions.reshape(-1, 3)
    a, b, c = (flat[indices[:, corner]] for corner in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    indices = indices[area > 1e-12]
    used, compact = np.unique(indices, return_inverse=True)
    return Section(
        positions=flat[used].astype(np.float32),
        normals=normals.reshape(-1, 3)[used].astype(np.float32),
        tangents=np.concatenate([tangents.reshape(-1, 3)[used], np.ones((len(used), 1))], -1).astype(np.float32),
        uv0=uv.reshape(-1, 2)[used].astype(np.float32),
        uv1=uv.reshape(-1, 2)[used].astype(np.float32),
        colors=np.ones((len(used), 4), np.float32),
        indices=compact.reshape(-1, 3).astype(np.uint32),
        material=material,
    )


def _grid_uv(positions: Floats) -> Floats:
    """Texture coordinates that grow with the distance along the grid: u by column, v by row, 0 to 1."""

    def share(step: Floats) -> Floats:
        length = np.append(0.0, np.cumsum(step))
        return length / length[-1]

    across = np.linalg.norm(np.diff(positions, axis=1), axis=-1).max(0)
    down = np.linalg.norm(np.diff(positions, axis=0), axis=-1).max(1)
    return np.stack(np.meshgrid(share(across), share(down)), -1)


def _transported(forward: Floats) -> Floats:
    """Unit normals across each direction with minimal rotation from one to the next."""
    start = np.eye(3)[np.argmin(np.abs(forward[0]))]
    sides = [_unit(start - (start @ forward[0]) * forward[0])]
    for direction in forward[1:]:
        sides.append(_unit(sides[-1] - (sides[-1] @ direction) * direction))
    return np.array(sides)


def _face_axes(axis: int, sign: float) -> tuple[Floats, Floats, Floats]:
    out = np.eye(3)[axis] * sign
    up = np.array((0.0, 1.0, 0.0)) if axis != 1 else np.array((0.0, 0.0, -sign))
    return np.cross(up, out), up, out


def _unit(vectors: NDArray[np.floating]) -> Floats:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True), np.float64)

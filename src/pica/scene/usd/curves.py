"""Curves become tubes, with a ring of vertices at each sample (UsdGeomBasisCurves)."""

import math

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from pica.errors import SceneError
from pica.scene.gltf.points_and_lines import LINE_WIDTH
from pica.scene.usd.curve_samples import BASES, Samples, sampled, segment_counts, varying_counts
from pica.scene.usd.geometry import Geometry, Rows
from pica.scene.usd.primvars import Primvar, Sizes, array_of, color_primvars, coordinate_primvars, diagonal, fitting
from pica.scene.usd.stage import Stage

_DETAILS = ((8, 8), (4, 5), (2, 3))
"""Samples of a cubic segment, and sides of a tube: the first pair with which all have at most this many triangles."""
_MOST_TRIANGLES = 1_000_000
_VERTEX_BYTES = 400
"""Memory for a vertex of a ring while it is made."""
_PER_CURVE, _VARYING = ("constant", "uniform"), ("varying", "faceVarying")


def read_curves(stage: Stage, prim: Usd.Prim) -> Geometry | None:
    """The tubes of a BasisCurves prim; None where it has none. Raises SceneError where its arrays do not fit."""
    curves, time = UsdGeom.BasisCurves(prim), stage.time
    points = array_of(curves.GetPointsAttr(), time, 3)
    counts = array_of(curves.GetCurveVertexCountsAttr(), time, 1)[:, 0].astype(np.intp)
    if (counts < 0).any() or counts.sum() != len(points):
        raise SceneError(f"curveVertexCounts: ask for {int(counts.sum())} points, and there are {len(points)}")
    wrap = str(curves.GetWrapAttr().Get(time))
    basis = "linear" if curves.GetTypeAttr().Get(time) == "linear" else str(curves.GetBasisAttr().Get(time))
    if basis not in BASES:
        raise SceneError(f"basis: {basis!r} is not one of {', '.join(BASES)}")
    segments = segment_counts(counts, basis, wrap)
    if not segments.any():
        return None
    total = int(segments.sum())
    steps, sides = next((pair for pair in _DETAILS if 2 * total * math.prod(pair) <= _MOST_TRIANGLES), _DETAILS[-1])
    steps = 1 if basis == "linear" else steps
    vertices = (total * steps + 3 * len(counts)) * sides
    stage.conversion.budget.take(vertices=vertices, bytes=vertices * _VERTEX_BYTES)
    samples = sampled(counts, basis, wrap, steps)
    varying = int(varying_counts(segments, wrap).sum())
    sizes = Sizes(len(points), varying, varying, len(counts))
    widths = array_of(curves.GetWidthsAttr(), time, 1)
    given = fitting("widths", widths, None, str(curves.GetWidthsInterpolation()), sizes)
    if given is None:
        diameters = np.full((int(samples.counts.sum()), 1), LINE_WIDTH * diagonal(points))
    else:
        diameters = _at_samples(given, samples)
    places = samples.at(points)
    ends = np.stack([np.cumsum(samples.counts) - samples.counts, np.cumsum(samples.counts) - 1])[:, samples.counts > 0]
    geometry, rows = _tubes(places, np.abs(diameters[:, 0]) / 2, ends, sides, closed=wrap == "periodic")
    surface = color_primvars(prim, time, sizes) | coordinate_primvars(prim, time, sizes)
    for name, primvar in surface.items():
        geometry.attributes[name] = Primvar(_at_samples(primvar, samples), rows, "vertex")
    return geometry


def _at_samples(primvar: Primvar, samples: Samples) -> NDArray[np.float64]:
    """(samples, components)"""
    if primvar.interpolation in _PER_CURVE:
        return primvar.values[primvar.rows(np.zeros(len(samples.share), np.intp), samples.curves)]
    values = primvar.values[primvar.indices].astype(np.float64)
    return samples.between(values) if primvar.interpolation in _VARYING else samples.at(values)


def _tubes(
    places: NDArray[np.float64], radii: NDArray[np.float64], ends: Rows, sides: int, closed: bool
) -> tuple[Geometry, Rows]:
    """Tubes round samples, and the sample of each vertex. `ends`: (2, curves) first and last samples."""
    along, side = _frames(places, *ends)
    angles = np.arange(sides) * (2 * math.pi / sides)
    other = np.cross(along, side)
    outward = side[:, None] * np.cos(angles)[:, None] + other[:, None] * np.sin(angles)[:, None]
    rings = places[:, None] + radii[:, None, None] * outward
    turn = np.arange(sides)
    starts = np.delete(np.arange(len(places)), ends[1])[:, None] * sides
    quads = np.stack([starts + turn, starts + np.roll(turn, -1)], axis=-1)
    quads = np.concatenate([quads, quads[..., ::-1] + sides], axis=-1)
    first, last = (np.zeros(0, np.intp),) * 2 if closed else ends
    caps = len(places) * sides + np.arange(len(first) + len(last))[:, None] * sides + turn
    caps[: len(first)] = caps[: len(first), ::-1]
    points = np.concatenate([rings, rings[first], rings[last]]).reshape(-1, 3)
    flat = np.repeat(np.concatenate([-along[first], along[last]]), sides, axis=0)
    normals = np.concatenate([outward.reshape(-1, 3), flat])
    geometry = Geometry(
        points,
        np.concatenate([np.full(starts.size * sides, 4), np.full(len(caps), sides)]),
        np.concatenate([quads.reshape(-1), caps.reshape(-1)]),
        {"NORMAL": Primvar(normals, np.arange(len(normals)), "vertex")},
    )
    return geometry, np.repeat(np.concatenate([np.arange(len(places)), first, last]), sides)


def _frames(places: NDArray[np.float64], first: Rows, last: Rows) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(samples, 3) unit vectors along the curves, and at right angles to them, which turn no more than the curves."""
    numbers, lengths = np.arange(len(places)), last - first + 1
    steps = np.zeros_like(places)
    steps[:-1] = np.diff(places, axis=0)
    steps[last] = 0
    steps /= np.maximum(np.linalg.norm(steps, axis=1, keepdims=True), 1e-30)
    before = np.roll(steps, 1, axis=0)
    loops = np.linalg.norm(places[first] - places[last], axis=1) < 1e-6 * diagonal(places)
    before[first[loops]], steps[last[loops]] = steps[last[loops] - 1], steps[first[loops]]
    along = steps + before
    is_known = np.linalg.norm(along, axis=1) > 1e-9
    along[first[~is_known[first]]] = 0.0, 0.0, 1.0
    is_known[first] = True
    along = along[np.maximum.accumulate(np.where(is_known, numbers, 0))]  # that of the last sample that has one
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    side = np.cross(along, np.eye(3)[np.abs(along).argmin(axis=1)])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(along, side)
    # The smallest rotation of one sample's vector along to the next one's takes its side to an angle in the next frame
    # (Bergou et al. 2008, "Discrete Elastic Rods", 4.2.2).
    start, start_side = np.roll(along, 1, axis=0), np.roll(side, 1, axis=0)
    turned = start_side - _dot(start_side, along) / np.maximum(1 + _dot(start, along), 1e-9) * (start + along)
    angles = np.arctan2(_dot(turned, other), _dot(turned, side))[:, 0]
    angles[first] = 0
    angles = np.cumsum(angles)
    angles -= np.repeat(angles[first], lengths)
    left = np.where(loops, (angles[last] + math.pi) % (2 * math.pi) - math.pi, 0)  # so that loops close
    angles -= np.repeat(left, lengths) * (numbers - np.repeat(first, lengths)) / np.repeat(lengths - 1, lengths)
    return along, side * np.cos(angles)[:, None] + other * np.sin(angles)[:, None]


def _dot(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.einsum("ij,ij->i", a, b))[:, None]

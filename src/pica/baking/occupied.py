"""Finds the parts of a light map's box that contain surfaces, and those that need the finest probes."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from pica.light_map.bricks import CELLS, box_of
from pica.scene.model import Node, Scene
from pica.scene.skin import deformed_positions

_MOST_POINTS = 1 << 21
"""Looked at in one go."""
_EVERY_WAY = np.uint64(2**64 - 1)
_CORNERS = np.stack(np.meshgrid((0, 1), (0, 1), (0, 1), indexing="ij"), -1).reshape(8, 3)


def occupied_places(
    scene: Scene, low: NDArray[np.float64], high: NDArray[np.float64], spacing: float
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """(x, y, z) which finest bricks of the box low to high (3,) are within a spacing of a surface; and which of those
    are near surfaces of different orientations, or a primitive's box. Raises SceneError as `box_of`.

    A plane sends no light to itself, and irradiance from others varies over about their distance (Ward and Heckbert
    1992, "Irradiance Gradients"): so probes near a single plane may be coarser.
    """
    origin, size = box_of(low, high, spacing)
    ways = np.zeros(size, np.uint64)
    brick, steps = spacing * CELLS, np.array([size[1] * size[2], size[2], 1], np.int64)

    def mark(points: NDArray[np.float64], facing: NDArray[np.uint64]) -> None:
        first, last = (
            np.clip(np.floor((points + away - origin) / brick), 0, size - 1).astype(np.int64)
            for away in (-spacing, spacing)
        )
        reaches = (first @ steps) * 8 + (last > first) @ (1, 2, 4)
        for way in np.unique(facing):
            numbers, further = np.divmod(np.unique(reaches[facing == way]), 8)
            for which, corner in enumerate(_CORNERS[:, ::-1]):
                ways.reshape(-1)[numbers[further & which == which] + corner @ steps] |= way

    for node in scene.nodes():
        if node.mesh is None:
            continue
        world = node.instance_transforms()
        for triangles in _triangles(node, world):
            for points, facing in _points_on(triangles, spacing):
                mark(points, facing)
        for primitives in node.mesh.primitives:
            for bounds in primitives.bounds.astype(np.float64):
                corners = np.where(_CORNERS, bounds[1], bounds[0])
                for placed in np.einsum("nij,pj->npi", world[:, :3, :3], corners) + world[:, None, :3, 3]:
                    first, last = (
                        np.clip((edge - origin) // brick, 0, size - 1).astype(int)
                        for edge in (placed.min(0) - spacing, placed.max(0) + spacing)
                    )
                    ways[tuple(slice(a, b + 1) for a, b in zip(first, last, strict=True))] = _EVERY_WAY
    return ways != 0, ways & (ways - np.uint64(1)) * (ways != 0) != 0


def _triangles(node: Node, world: NDArray[np.float64]) -> Iterator[NDArray[np.float64]]:
    """(count, 3, 3) corners in the world, metres."""
    assert node.mesh is not None
    for section in node.mesh.sections:
        positions = deformed_positions(section, node) if node.deforms else section.positions
        corners = positions[section.indices].astype(np.float64)
        for chunk in np.array_split(world, max(len(world) * len(corners) * 3 // _MOST_POINTS, 1)):
            placed = np.einsum("nij,tcj->ntci", chunk[:, :3, :3], corners) + chunk[:, None, None, :3, 3]
            yield placed.reshape(-1, 3, 3)


def _points_on(
    triangles: NDArray[np.float64], apart: float
) -> Iterator[tuple[NDArray[np.float64], NDArray[np.uint64]]]:
    """(count, 3) points of triangles (count, 3, 3), so dense that every point of a triangle is within `apart` of one;
    and (count,) the triangle's orientation, as `_facing`."""
    longest = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=-1).max(1, initial=0)
    # Powers of two limit the number of different subdivisions.
    steps = np.exp2(np.ceil(np.log2(np.maximum(longest / apart, 1)))).astype(np.int64)
    for count in np.unique(steps):
        i, j = np.nonzero(np.add.outer(np.arange(count + 1), np.arange(count + 1)) <= count)
        weights = np.stack([i, j, count - i - j], -1) / count
        alike = triangles[steps == count]
        for chunk in np.array_split(alike, len(alike) * len(weights) // _MOST_POINTS + 1):
            points = np.einsum("wc,tci->twi", weights, chunk).reshape(-1, 3)
            yield points, np.repeat(_facing(chunk), len(weights))


def _facing(triangles: NDArray[np.float64]) -> NDArray[np.uint64]:
    """(count,) one of 64 bits, the same for triangles that lie in planes of about the same direction."""
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.maximum(np.abs(normals).max(1, keepdims=True), 1e-300)
    # Independent of the side; the thresholds between two bits are at no common orientation.
    normals *= np.where(normals @ (1.0, 1e-3, 1e-6) < 0, -1, 1)[:, None]
    steps = np.floor(normals * 1.9 + 2.53).astype(np.uint64)
    return np.uint64(1) << (steps @ np.array([1, 5, 25], np.uint64)) % np.uint64(61)

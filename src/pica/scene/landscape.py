"""Heightfield landscapes: a grid of patches with levels of detail by camera distance (RTG 19, 19.2.1.3).

Between patches of different levels, the finer one omits border vertices that the coarser one does not have
(stitching). So neighbours share their border's vertices, bit for bit, and there are no cracks, for rays as well
as for raster. Skirts would add walls, which rays hit from either side; morphing would move vertices, and with
them the bottom-level structures, of all patches with every step of the camera.
"""

from dataclasses import dataclass
from functools import cache
from weakref import WeakValueDictionary

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pica.errors import SceneError, shown
from pica.scene.arrays import doubles
from pica.scene.camera import Camera
from pica.scene.deformer import Floats
from pica.scene.fixed import Fixed
from pica.scene.material import Material
from pica.scene.model import Mesh, Node, Section
from pica.scene.values import checked, positive, whole

Edges = tuple[int, int, int, int]
"""Every how many vertices a patch has one on its borders towards -X, +X, -Z and +Z."""


@dataclass(frozen=True, eq=False)
class Levels:
    """How fine each patch is shown to a camera."""

    levels: NDArray[np.int64]
    """(patches along Z, along X) 0 is the finest."""
    edges: NDArray[np.int64]
    """(patches along Z, along X, 4) every how many of the heights a patch has a vertex on each border, as Edges."""


class Landscape(Fixed):
    """A heightfield round the origin of `node`, in XZ.

    In each view every patch has a level: 0, the finest, within `full_detail` metres, and one more, with
    half as many quads along a side, for each doubling of the distance. It depends on the camera alone. A patch
    whose level or border changes is shown by another mesh, made at first use; the others cost nothing.
    The nodes themselves have the coarsest meshes.
    """

    def __init__(
        self,
        heights: ArrayLike,
        spacing: float,
        material: Material,
        patch: int = 32,
        levels: int = 4,
        full_detail: float = 20.0,
        name: str = "landscape",
    ) -> None:
        """`heights` (rows, columns) metres, rows along +Z, every `spacing` metres; `patch` quads along a patch's side.

        Raises SceneError unless rows and columns are 1 more than multiples of `patch`, which 2^(levels - 1) divides.
        """
        landscape = f"landscape {shown(name)}"
        self.heights = checked(f"{landscape}: heights", doubles("rows", "columns"), heights).copy()
        spacing = checked(f"{landscape}: spacing", positive(), spacing)
        full_detail = checked(f"{landscape}: full_detail", positive(), full_detail)
        patch = checked(f"{landscape}: patch", whole(1, 1 << 15), patch)
        levels = checked(f"{landscape}: levels", whole(1, 16), levels)
        rows, columns = self.heights.shape
        if min(rows, columns) <= patch or (rows - 1) % patch or (columns - 1) % patch:
            raise SceneError(f"{landscape}: {rows} x {columns} heights are not 1 more than patches of {patch}")
        if patch % 2 ** (levels - 1):
            raise SceneError(f"{landscape}: {levels} levels halve a side of {patch} quads too often")
        self.spacing, self.material, self.patch, self.levels = spacing, material, patch, levels
        self.full_detail = full_detail
        self._vertices = self._made()
        self._shape = (rows - 1) // patch, (columns - 1) // patch
        self._boxes = self._bounds()
        self._meshes: WeakValueDictionary[tuple[int, ...], Mesh] = WeakValueDictionary()
        self.node = Node(name)
        self._places: dict[Node, tuple[int, int]] = {}
        coarsest = self._with_edges(np.full(self._shape, levels - 1))
        for z, x in np.ndindex(self._shape):
            patch_node = self.node.add(Node(f"{name} {z} {x}"))
            self._places[patch_node] = z, x
            patch_node.mesh = self.mesh(patch_node, coarsest)
            patch_node.detail = self

    def levels_for(self, camera: Camera) -> Levels:
        """The levels for a camera; the coarsest ones if the node's transform is singular."""
        world = self.node.world
        if not np.linalg.det(world):
            return self._with_edges(np.full(self._shape, self.levels - 1))
        return self._with_edges(self.levels_from((np.linalg.inv(world) @ camera.transform[:, 3])[:3]))

    def differing(self, levels: Levels, before: Levels) -> list[Node]:
        """The patches' nodes that show another mesh at `levels` than they did before."""
        differs = (levels.levels != before.levels) | (levels.edges != before.edges).any(-1)
        nodes = list(self._places)
        return [nodes[place] for place in np.flatnonzero(differs)]

    def mesh(self, node: Node, levels: Levels) -> Mesh:
        """The mesh of a patch's node at these levels; the same Mesh as long as it is in use."""
        z, x = self._places[node]
        step = 2 ** int(levels.levels[z, x])
        edges = tuple(int(edge) // step for edge in levels.edges[z, x])
        key = z, x, step, *edges
        level_mesh = self._meshes.get(key)
        if level_mesh is None:
            indices = patch_triangles(self.patch // step, edges)
            section = self._section(self._rows(z, step), self._rows(x, step), indices)
            level_mesh = self._meshes[key] = Mesh([section], node.name)
        return level_mesh

    def levels_from(self, eye: Floats) -> NDArray[np.int64]:
        """(patches along Z, along X) levels for an eye, (3,) in the node's space, by its distance to their boxes."""
        outside = np.maximum(np.maximum(self._boxes[0] - eye, eye - self._boxes[1]), 0)
        distance = np.linalg.norm(outside, axis=-1)
        doublings = np.floor(np.log2(np.maximum(distance / self.full_detail, 0.5))) + 1
        return np.clip(doublings, 0, self.levels - 1).astype(np.int64)

    def surface(self) -> Section:
        """The whole landscape at its finest, as one section; for scattering things over it."""
        rows, columns = self.heights.shape
        first = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).reshape(-1, 1, 1)
        corners = np.array([[0, columns, columns + 1], [0, columns + 1, 1]])
        return self._section(slice(None), slice(None), (first + corners).reshape(-1, 3).astype(np.uint32))

    def height_at(self, x: ArrayLike, z: ArrayLike) -> Floats:
        """Metres of the finest surface above places of the node's XZ plane; beyond the border it is the border's."""
        rows, columns = self.heights.shape
        u = np.clip(np.asarray(x, np.float64) / self.spacing + (columns - 1) / 2, 0, columns - 1)
        v = np.clip(np.asarray(z, np.float64) / self.spacing + (rows - 1) / 2, 0, rows - 1)
        column, row = (np.minimum(p.astype(np.intp), n - 2) for p, n in ((u, columns), (v, rows)))
        u, v = u - column, v - row
        here, across = self.heights[row, column], self.heights[row + 1, column + 1]
        # Quads are split from their first corner to the one across.
        middle = np.where(v > u, self.heights[row + 1, column], self.heights[row, column + 1])
        low, high = np.minimum(u, v), np.maximum(u, v)
        return np.asarray(here * (1 - high) + middle * (high - low) + across * low)

    def _made(self) -> dict[str, NDArray[np.float32]]:
        """Attributes of all vertices, (rows, columns, …). Coarser levels use some of them."""
        rows, columns = self.heights.shape
        x = (np.arange(columns) - (columns - 1) / 2) * self.spacing
        z = (np.arange(rows) - (rows - 1) / 2) * self.spacing
        grid_x, grid_z = np.meshgrid(x, z)
        slope_z, slope_x = np.gradient(self.heights, self.spacing)
        one, zero = np.ones_like(slope_x), np.zeros_like(slope_x)
        normals, tangents = np.stack([-slope_x, one, -slope_z], -1), np.stack([one, slope_x, zero], -1)
        u, v = np.meshgrid(np.arange(columns) / (columns - 1), np.arange(rows) / (rows - 1))
        made = {
            "positions": np.stack([grid_x, self.heights, grid_z], -1),
            "normals": normals / np.linalg.norm(normals, axis=-1, keepdims=True),
            "tangents": np.dstack([tangents / np.linalg.norm(tangents, axis=-1, keepdims=True), one]),
            "uv0": np.stack([u, v], -1),
        }
        return {name: values.astype(np.float32) for name, values in made.items()}

    def _bounds(self) -> tuple[Floats, Floats]:
        """Lowest and highest corners, (patches along Z, along X, 3) each, of the patches' boxes."""
        positions = self._vertices["positions"].astype(np.float64)
        lows, highs = np.zeros((*self._shape, 3)), np.zeros((*self._shape, 3))
        for z, x in np.ndindex(self._shape):
            there = positions[self._rows(z, 1), self._rows(x, 1)].reshape(-1, 3)
            lows[z, x], highs[z, x] = there.min(0), there.max(0)
        return lows, highs

    def _with_edges(self, levels: NDArray[np.int64]) -> Levels:
        """For each border, the coarser one of the two adjacent levels."""
        padded = np.pad(levels, 1)
        beside = [padded[1:-1, :-2], padded[1:-1, 2:], padded[:-2, 1:-1], padded[2:, 1:-1]]
        return Levels(levels, 2 ** np.maximum(np.stack(beside, -1), levels[..., None]))

    def _rows(self, patch: int, step: int) -> slice:
        return slice(patch * self.patch, (patch + 1) * self.patch + 1, step)

    def _section(self, rows: slice, columns: slice, indices: NDArray[np.uint32]) -> Section:
        used = {name: np.ascontiguousarray(values[rows, columns]) for name, values in self._vertices.items()}
        flat = {name: values.reshape(-1, values.shape[-1]) for name, values in used.items()}
        colors = np.ones((len(flat["positions"]), 4), np.float32)
        return Section(
            flat["positions"],
            flat["normals"],
            flat["tangents"],
            flat["uv0"],
            flat["uv0"],
            colors,
            indices,
            self.material,
        )


@cache
def patch_triangles(quads: int, edges: Edges) -> NDArray[np.uint32]:
    """(triangles, 3) of a patch of `quads` by `quads` quads over (quads + 1)^2 vertices, rows along +Z.

    `edges`: step between vertices on each border. Vertices between move to the nearer of two remaining ones, and
    degenerate triangles are omitted; at equal distance to the one nearer to the patch's corner, so that no
    triangle at a corner is flipped.
    """
    side = quads + 1
    column, row = np.meshgrid(np.arange(side), np.arange(side))
    moved_column, moved_row = column.copy(), row.copy()
    for end in (0, 1):
        moved_row[:, -end] = _kept(quads, edges[end])
        moved_column[-end, :] = _kept(quads, edges[2 + end])
    vertices = moved_row * side + moved_column
    a, b, c, d = vertices[:-1, :-1], vertices[:-1, 1:], vertices[1:, :-1], vertices[1:, 1:]
    triangles = np.concatenate([np.stack(corners, -1).reshape(-1, 3) for corners in ((a, c, d), (a, d, b))])
    first, second, third = triangles.T
    whole = (first != second) & (second != third) & (third != first)
    return triangles[whole].astype(np.uint32)


def _kept(quads: int, step: int) -> NDArray[np.int64]:
    """(quads + 1,) the nearest multiple of `step` for each number; of two as near, the one farther from the middle."""
    numbers = np.arange(quads + 1)
    down = (numbers + (step - 1) // 2) // step * step
    return np.where(numbers <= quads / 2, down, quads - down[::-1])

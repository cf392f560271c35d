"""Objects with maps in texture space: which, how large, and where in the one texture that all share."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pica.frame.context import FrameContext
from pica.gpu_scene.geometry import PlacedSection
from pica.gpu_scene.view import SceneView
from pica.graph.graph import FrameGraph
from pica.programs.library import programs
from pica.rhi.device import Device
from pica.scene.model import Section
from pica.texture_space.unwrap import unwrap

_TILE = 16
"""texture_maps.slang: TILE."""
_OBJECT = np.dtype(
    [("record", "u4"), ("triangles", "u4"), ("first_triangle", "u4"), ("place", "u4", 2), ("side", "u4")]
)
_MOST_TRIANGLES = 1 << 18
"""Of one object: unwrapping takes some 50 microseconds for each, once."""


@dataclass(frozen=True, eq=False)
class _Candidate:
    record: int
    section: Section
    area: float
    """Square metres."""

    @property
    def can_unwrap(self) -> bool:
        """Whether it is a solid that is not too large to unwrap."""
        return not self.section.material.thin_walled and len(self.section.indices) <= _MOST_TRIANGLES


class TextureMaps:
    """The maps, as the block `textureMaps` of texture_maps.slang. They follow the scene's objects, not their motion."""

    def __init__(self, device: Device, side: int) -> None:
        """`side`: of the shared texture, in texels, a power of two."""
        self._device, self.side = device, side
        self._draw = programs(device).compute("texture_space/draw_charts.slang")
        self.block = device.parameter_block("texture_space/texture_maps.slang", "textureMaps")
        self.triangles = device.structured("texture map triangles", np.zeros(side * side, np.uint32))
        self.room = (side // _TILE) ** 2
        """How many objects may have a map."""
        self._longest = 0
        self.count = 0
        """How many objects have a map."""
        self._content: tuple[int, int] | None = None
        self.leaves_out = False
        """Whether surfaces with diffuse transmission have no map."""
        self.changed = False
        """Whether places in the texture differ from those of the frame before."""
        self._bind([], np.zeros((1, 3), np.uint32), np.zeros(1, np.uint32))

    def declare(self, graph: FrameGraph, scene: SceneView, wanted: bool) -> None:
        """Declare what keeps them up to date; passes added later find the block. `wanted`: False leaves all out."""
        graph.provide(textureMaps=self)
        graph.record("follow texture maps", self._follow, scene=scene, wanted=wanted)
        graph.add(
            self._draw,
            lambda frame: (max(self._longest, 1), max(self.count, 1), 1),
            when=lambda frame: self.changed,
            triangles=self.triangles,
        )

    def reset(self) -> None:
        """Place all objects again in the next frame."""
        self._content = None

    def _follow(self, frame: FrameContext, scene: SceneView, wanted: bool) -> None:
        content = id(scene.scene), scene.scene.content_revision
        self.changed = content != self._content
        if self.changed:
            self._content = content
            self._place(scene, wanted)
            frame.encoder.clear_buffer(self.triangles)

    def _place(self, scene: SceneView, wanted: bool) -> None:
        every = _with_diffuse_transmission(scene)
        candidates = [each for each in every if wanted and each.can_unwrap]
        sides = _sides([each.area for each in candidates], self.side)
        objects, corners, unwrapped = [], [], {}
        first = 0
        for each, side, place in zip(candidates, sides, _places(sides), strict=True):
            key = id(each.section), side
            if key not in unwrapped:
                unwrapped[key] = first
                corners.append(unwrap(each.section, side))
                first += len(corners[-1])
            triangles = len(each.section.indices)
            objects.append((each.record, triangles, unwrapped[key], (place[0], place[1]), side))
        object_of = np.zeros(len(scene.records), np.uint32)
        for number, each in enumerate(candidates[: len(objects)], 1):
            object_of[each.record] = number
        self.leaves_out = len(objects) < len(every)
        self._bind(objects, np.concatenate(corners) if corners else np.zeros((1, 3), np.uint32), object_of)

    def _bind(
        self, objects: Sequence[tuple[object, ...]], corners: NDArray[np.uint32], object_of: NDArray[np.uint32]
    ) -> None:
        rows = np.array(objects, _OBJECT) if objects else np.zeros(1, _OBJECT)
        tiles = np.zeros((self.side // _TILE,) * 2, np.uint32)
        for number, row in enumerate(rows[: len(objects)], 1):
            (x, y), across = row["place"] // _TILE, row["side"] // _TILE
            tiles[y : y + across, x : x + across] = number
        self.count = len(objects)
        self._longest = int(rows["triangles"].max())
        make = self._device.structured
        self.block.bind(
            objects=make("mapped objects", rows),
            corners=make("texture map corners", corners.reshape(-1)),
            objectOf=make("texture maps of records", object_of),
            objectAt=make("texture maps of tiles", tiles.reshape(-1)),
            triangleAt=self.triangles,
            side=self.side,
            count=self.count,
            records=len(object_of),
        )


def _with_diffuse_transmission(scene: SceneView) -> list[_Candidate]:
    """Sections with diffuse transmission, the largest first."""
    gpu_scene, found = scene.scene, []
    for placement in gpu_scene.placements.values():
        if placement.mesh is None:
            continue
        parts = placement.mesh.placed
        for number, record in enumerate(placement.records):
            placed = parts[number % len(parts)]
            if not isinstance(placed, PlacedSection):
                continue
            if placed.section.material.passes_diffusely():
                to_world = gpu_scene.instance_table.rows["to_world"][gpu_scene.record_table.rows["instance"][record]]
                found.append(_Candidate(record, placed.section, _area(placed.section, to_world)))
    return sorted(found, key=lambda each: -each.area)


def _area(section: Section, to_world: NDArray[np.float32]) -> float:
    a, b, c = (section.positions[section.indices[:, corner]] @ to_world[:, :3].T for corner in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()) / 2


def _sides(areas: list[float], side: int) -> list[int]:
    """Sides of the maps of objects, a power of two each, for as many of the objects as have room.

    Texels go with the square root of the area: large objects tend to be farther away.
    """
    room = (side // _TILE) ** 2
    shares = np.sqrt(np.maximum(areas[:room], 1e-12))
    if len(shares) == 0:
        return []
    scale = 2.0 * room
    while True:
        tiles = 4.0 ** np.floor(np.log2(np.maximum(shares / shares.sum() * scale, 1.0)) / 2)
        if tiles.sum() <= room:
            return (_TILE * np.sqrt(tiles)).astype(int).tolist()
        scale /= 2


def _places(sides: list[int]) -> list[tuple[int, int]]:
    """First texels of squares whose sides are powers of two, the largest first: along a Z-order curve they leave no
    gaps."""
    places, used = [], 0
    for side in sides:
        x = sum((used >> 2 * bit & 1) << bit for bit in range(16))
        y = sum((used >> 2 * bit + 1 & 1) << bit for bit in range(16))
        places.append((x * _TILE, y * _TILE))
        used += (side // _TILE) ** 2
    return places

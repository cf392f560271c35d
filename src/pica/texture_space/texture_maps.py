"""Objects with maps in texture space: which, how large, and where in the one texture that all share."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.frame.context import FrameContext
from pica.gpu_scene.geometry_store import PlacedSection
from pica.gpu_scene.view import SceneView
from pica.graph.graph import FrameGraph
from pica.programs.library import programs
from pica.programs.recipes import MaterialPass
from pica.rhi.device import Device
from pica.scene.material import Material
from pica.scene.model import Section
from pica.texture_space.unwrap import unwrap

_TILE = 16
"""texture_maps.slang: TILE."""
_OBJECT = np.dtype(
    [
        ("record", "u4"),
        ("triangles", "u4"),
        ("first_triangle", "u4"),
        ("place", "u4", 2),
        ("side", "u4"),
        ("is_new", "u4"),
        ("unused", "u4"),
    ]
)
_MOST_TRIANGLES = 1 << 18
"""Of one object: unwrapping takes some 50 microseconds for each, once."""


@dataclass(frozen=True, eq=False)
class _Candidate:
    record: int
    section: Section
    area: float
    """Square metres."""

    look: tuple[object, ...]
    """MappedKind.look"""

    @property
    def key(self) -> tuple[object, ...]:
        """Equal for an object that is as it was."""
        return self.record, id(self.section), self.look


@dataclass(frozen=True)
class MappedKind:
    """Which objects are to have maps, by their materials."""

    has_light: Callable[[Material], bool]
    """Whether they have such light as maps keep."""

    is_mapped: Callable[[Material], bool]
    """Whether maps may keep it."""

    look: Callable[[Material], tuple[object, ...]]
    """What the light in a map depends on: when it changes, the map begins anew."""


class TextureMaps:
    """The maps, as the block `textureMaps` of texture_maps.slang. They follow the scene's objects, not their motion."""

    def __init__(self, device: Device, kind: MappedKind, side: int) -> None:
        """`side`: of the shared texture, in texels, a power of two."""
        self._device, self._kind, self.side = device, kind, side
        self.block = device.parameter_block("texture_space/texture_maps.slang", "textureMaps")
        self.triangles = device.structured("texture map triangles", np.zeros(side * side, np.uint32))
        self.room = (side // _TILE) ** 2
        """How many objects may have a map."""
        self._longest = 0
        self.count = 0
        """How many objects have a map."""
        self._content: int | None = None
        self._placed: dict[tuple[object, ...], _Candidate] = {}
        """By key, side and place. They keep their sections, and so the ids of these, alive."""
        self._buffers: list[spy.Buffer] = []
        self.leaves_out = False
        """Whether surfaces with such light have no map."""
        self.changed = False
        """Whether some texels belong to other objects than in the frame before."""
        self._bind([], [], np.zeros(1, np.uint32))

    @cached_property
    def _draw(self) -> MaterialPass:
        """Made where maps are wanted."""
        return programs(self._device).compute("texture_space/draw_charts.slang")

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
        """Place all objects anew in the next frame."""
        self._content, self._placed = None, {}

    def _follow(self, frame: FrameContext, scene: SceneView, wanted: bool) -> None:
        content = scene.scene.content_revision
        self.changed = content != self._content and self._place(scene, wanted)
        self._content = content
        if self.changed:
            frame.encoder.clear_buffer(self.triangles)

    def _place(self, scene: SceneView, wanted: bool) -> bool:
        """Find places for the scene's objects; False if all are as they were."""
        every = self._candidates(scene)
        candidates = [each for each in every if wanted and self._can_map(each.section)]
        sides = _sides([each.area for each in candidates], self.side)
        self.leaves_out = len(sides) < len(every)
        # Those for which there is no room are the last.
        shown = candidates[: len(sides)]
        placed = {(each.key, *where): each for each, *where in zip(shown, sides, _places(sides), strict=True)}
        if self._content is not None and placed.keys() == self._placed.keys():
            return False
        before, self._placed = self._placed, placed
        objects: list[tuple[object, ...]] = []
        meshes = {(id(each.section), side): (each.section, side) for each, side in zip(shown, sides, strict=True)}
        corners = unwrap(list(meshes.values()))
        lengths = np.array([len(each) for each in corners], np.int64)
        first_of = dict(zip(meshes, (np.cumsum(lengths) - lengths).tolist(), strict=True))
        object_of = np.zeros(len(scene.records), np.uint32)
        for (where, each), side, place in zip(placed.items(), sides, _places(sides), strict=True):
            first = first_of[id(each.section), side]
            objects.append((each.record, len(each.section.indices), first, place, side, where not in before, 0))
            object_of[each.record] = len(objects)
        self._bind(objects, corners, object_of)
        return True

    def _candidates(self, scene: SceneView) -> list[_Candidate]:
        """Sections with such light, the largest first."""
        gpu_scene, found = scene.scene, []
        places, instance_of = gpu_scene.instance_table.rows["to_world"], gpu_scene.record_table.rows["instance"]
        for placement in gpu_scene.placements.values():
            if placement.mesh is None:
                continue
            parts = placement.mesh.placed
            for number, record in enumerate(placement.records):
                placed = parts[number % len(parts)]
                if isinstance(placed, PlacedSection) and self._kind.has_light(placed.section.material):
                    area = _area(placed.section, places[instance_of[record]])
                    look = self._kind.look(placed.section.material)
                    found.append(_Candidate(record, placed.section, area, look))
        # By two digits, so that rounding of transforms does not change the order of equal objects.
        return sorted(found, key=lambda each: (-float(f"{each.area:.2g}"), each.record))

    def _can_map(self, section: Section) -> bool:
        return self._kind.is_mapped(section.material) and len(section.indices) <= _MOST_TRIANGLES

    def _bind(
        self,
        objects: Sequence[tuple[object, ...]],
        corners: Sequence[NDArray[np.uint32]],
        object_of: NDArray[np.uint32],
    ) -> None:
        every = np.concatenate(corners).reshape(-1) if corners else np.zeros(3, np.uint32)
        rows = np.array(objects, _OBJECT) if objects else np.zeros(1, _OBJECT)
        tiles = np.zeros((self.side // _TILE,) * 2, np.uint32)
        for number, row in enumerate(rows[: len(objects)], 1):
            (x, y), across = row["place"] // _TILE, row["side"] // _TILE
            tiles[y : y + across, x : x + across] = number
        self.count = len(objects)
        self._longest = int(rows["triangles"].max())
        contents = {"objects": rows, "corners": every, "objectOf": object_of, "objectAt": tiles.reshape(-1)}
        buffers = {name: self._device.structured(f"texture maps {name}", data) for name, data in contents.items()}
        self._device.give_back(*self._buffers)
        self._buffers = list(buffers.values())
        self.block.bind(
            **buffers,
            triangleAt=self.triangles,
            side=self.side,
            count=self.count,
            records=len(object_of),
        )


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

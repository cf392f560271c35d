"""The raster path's draws: one list of indirect draws for each kind of section."""

from dataclasses import dataclass
from enum import Enum

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.gpu_scene.primitive_buffers import BOX_INDICES
from pica.rhi.device import Device
from pica.rhi.passes import Recording
from pica.rhi.tables import HostTable
from pica.scene.material import AlphaMode
from pica.scene.model import Section
from pica.scene.primitives import Primitives

# VkDrawIndexedIndirectCommand
_ARGUMENTS = np.dtype(
    [("index_count", "u4"), ("instances", "u4"), ("first_index", "u4"), ("vertex_offset", "i4"), ("record", "u4")]
)
DRAW_SIZE = _ARGUMENTS.itemsize
"""Bytes of a draw's arguments."""


class Facing(Enum):
    """Face culling of a section. A mirroring transform reverses the winding on screen."""

    BOTH = "both"
    FRONT = "front"
    FRONT_MIRRORED = "front mirrored"
    BOXES = "boxes"
    """The backs of boxes round primitives."""
    BOXES_MIRRORED = "boxes mirrored"


CULL = {
    Facing.BOTH: spy.CullMode.none,
    Facing.FRONT: spy.CullMode.back,
    Facing.FRONT_MIRRORED: spy.CullMode.back,
    Facing.BOXES: spy.CullMode.front,
    Facing.BOXES_MIRRORED: spy.CullMode.front,
}
FRONT = {
    Facing.BOTH: spy.FrontFaceMode.counter_clockwise,
    Facing.FRONT: spy.FrontFaceMode.counter_clockwise,
    Facing.FRONT_MIRRORED: spy.FrontFaceMode.clockwise,
    Facing.BOXES: spy.FrontFaceMode.counter_clockwise,
    Facing.BOXES_MIRRORED: spy.FrontFaceMode.clockwise,
}


@dataclass(frozen=True)
class DrawKind:
    """The pipeline state of a draw."""

    alpha: AlphaMode
    glass: bool
    facing: Facing

    @property
    def opaque(self) -> bool:
        """Whether all of it covers what lies behind."""
        return self.alpha is AlphaMode.OPAQUE

    @property
    def blends(self) -> bool:
        """Whether it may be layers, which the transparency pass shows."""
        return self.alpha is AlphaMode.BLEND


@dataclass(frozen=True)
class DrawList:
    """The draws of one kind, as indirect arguments; some may be of no instances."""

    kind: DrawKind
    count: int
    arguments: spy.Buffer
    counts: spy.Buffer
    """`count` on the device: on lavapipe, draws without such a buffer have that of earlier draws in the same recording,
    such as those of another view's shadow maps."""


# Properties of a section that determine its draws.
DRAWN_SECTION = np.dtype(
    [("index_count", "u4"), ("instances", "u4"), ("boxes", "?"), ("alpha", "u1"), ("glass", "?"), ("double_sided", "?")]
)
NOT_DRAWN = -1
_ALPHA_MODES = AlphaMode.OPAQUE, AlphaMode.MASK, AlphaMode.BLEND
_KINDS = [DrawKind(alpha, glass, facing) for alpha in _ALPHA_MODES for glass in (False, True) for facing in Facing]
"""Opaque kinds first, so that they occlude those that are costlier to shade."""


class DrawLists:
    """The draws of a set of records, in one list for each kind. Updates cost only added, removed and changed records.

    A removed draw leaves an empty draw in its list until the slot is reused.
    """

    def __init__(self, device: Device) -> None:
        self._device = device
        self._lists: dict[int, _Draws] = {}
        self._kinds = np.full(1, NOT_DRAWN, np.int8)
        self._rows = np.zeros(1, np.int64)
        self._touched = np.zeros(1, bool)
        self._quiet = True
        """Nothing has been touched since the last `take_touched`."""

    def touch(self, records: NDArray[np.int64]) -> None:
        """Update the draws of records that were added, removed or changed kind."""
        count = int(records.max(initial=-1)) + 1
        if count > len(self._kinds):
            more = max(count, 2 * len(self._kinds)) - len(self._kinds)
            self._kinds = np.append(self._kinds, np.full(more, NOT_DRAWN, np.int8))
            self._rows = np.append(self._rows, np.zeros(more, np.int64))
            self._touched = np.append(self._touched, np.zeros(more, bool))
        self._touched[records] = True
        self._quiet = False

    def take_touched(self) -> NDArray[np.int64]:
        """The records that were touched, for `put`."""
        if self._quiet:
            return np.zeros(0, np.int64)
        touched, self._quiet = np.flatnonzero(self._touched), True
        self._touched[touched] = False
        return touched

    def put(self, records: NDArray[np.int64], kinds: NDArray[np.int8], arguments: NDArray[np.void]) -> None:
        """List records (n,) by their kinds, as from `kinds_of`, with the arguments of their draws."""
        before = self._kinds[records]
        for kind in np.unique(before[before != NOT_DRAWN]).tolist():
            self._lists[kind].drop(self._rows[records[before == kind]])
        for kind in np.unique(kinds[kinds != NOT_DRAWN]).tolist():
            if kind not in self._lists:
                self._lists[kind] = _Draws(self._device)
            chosen = kinds == kind
            self._rows[records[chosen]] = self._lists[kind].take(arguments[chosen])
        self._kinds[records] = kinds

    def lists(self, recording: Recording) -> list[DrawList]:
        """The lists that are not empty, opaque ones first; records the upload of changes."""
        draw_lists = []
        for kind, draws in sorted(self._lists.items()):
            draws.table.flush(recording)
            if draws.used:
                draw_lists.append(DrawList(_KINDS[kind], draws.end, draws.table.buffer, draws.counts(recording)))
        return draw_lists


class _Draws:
    """One list: rows of arguments, and which of them are holes."""

    def __init__(self, device: Device) -> None:
        usage = spy.BufferUsage.indirect_argument | spy.BufferUsage.shader_resource | spy.BufferUsage.unordered_access
        self.table = HostTable(device, "draws", _ARGUMENTS, usage)
        self._counts = HostTable(device, "draw count", np.dtype([("count", "u4")]), usage)
        self.end = self.used = 0
        """Number of rows with and without empty draws."""
        self._holes: list[int] = []

    def counts(self, recording: Recording) -> spy.Buffer:
        """`end` on the device; records its upload."""
        if self._counts.rows["count"][0] != self.end:
            self._counts.rows["count"][0] = self.end
            self._counts.touch(slice(0, 1))
            self._counts.flush(recording)
        return self._counts.buffer

    def take(self, arguments: NDArray[np.void]) -> NDArray[np.int64]:
        """The rows for these arguments."""
        again = max(len(self._holes) - len(arguments), 0)
        holes, self._holes = self._holes[again:], self._holes[:again]
        end = self.end + len(arguments) - len(holes)
        rows = np.append(np.array(holes, np.int64), np.arange(self.end, end))
        self.table.reserve(end)
        self.table.rows[rows] = arguments
        self.table.touch(rows)
        self.end, self.used = end, self.used + len(arguments)
        return rows

    def drop(self, rows: NDArray[np.int64]) -> None:
        """Leave holes."""
        self.table.rows[rows] = 0
        self.table.touch(rows)
        self._holes += rows.tolist()
        self.used -= len(rows)


def drawn_section(section: Section | Primitives) -> tuple[int, int, bool, int, bool, bool]:
    """A row of DRAWN_SECTION."""
    boxes = isinstance(section, Primitives)
    indices = BOX_INDICES.size if isinstance(section, Primitives) else section.indices.size
    instances = len(section) if isinstance(section, Primitives) else 1
    material = section.material
    alpha = _ALPHA_MODES.index(material.alpha_mode)
    return indices, instances, boxes, alpha, material.transmission > 0, material.double_sided


def kinds_of(sections: NDArray[np.void], mirrored: NDArray[np.bool_]) -> NDArray[np.int8]:
    """(n,) numbers of the kinds of DRAWN_SECTION rows, of which some are mirrored."""
    turned = mirrored.astype(np.int8)
    facing = np.where(sections["boxes"], 3 + turned, np.where(sections["double_sided"], 0, 1 + turned))
    return (facing + len(Facing) * (2 * sections["alpha"].astype(np.int64) + sections["glass"])).astype(np.int8)


def draw_arguments(
    records: NDArray[np.int64], rows: NDArray[np.void], sections: NDArray[np.void], first_box_index: int
) -> NDArray[np.void]:
    """(n,) arguments of the draws of records, with their RECORD and DRAWN_SECTION rows."""
    arguments = np.zeros(len(records), _ARGUMENTS)
    arguments["index_count"] = sections["index_count"]
    arguments["instances"] = sections["instances"]
    arguments["first_index"] = np.where(sections["boxes"], first_box_index, 3 * rows["first_index"])
    arguments["record"] = records
    return arguments


def is_mirrored(transforms: NDArray[np.float32]) -> NDArray[np.bool_]:
    """(n,) whether (n, 3, 4) transforms flip handedness."""
    return np.asarray(np.linalg.det(transforms[:, :, :3].astype(np.float64)) < 0)

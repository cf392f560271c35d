"""What the raster path draws: one list of indirect draws per kind of section."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.gpu_scene.primitives import BOX_INDICES
from pica.rhi.device import Device
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
    """Which faces the camera sees. A mirroring transform reverses the winding in the picture."""

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
    """What decides about the pipeline of a draw."""

    opaque: bool
    facing: Facing


@dataclass(frozen=True)
class DrawList:
    """The draws of one kind, as indirect arguments."""

    kind: DrawKind
    count: int
    arguments: spy.Buffer


@dataclass
class SectionDraws:
    """Per placed section: (n,) each."""

    record: NDArray[np.int64]
    first_index: NDArray[np.uint32]
    index_count: NDArray[np.uint32]
    instances: NDArray[np.uint32]
    """Of boxes; 1 for triangles."""
    boxes: NDArray[np.bool_]
    """Whether boxes are drawn, with primitives in them, in place of triangles."""
    opaque: NDArray[np.bool_]
    double_sided: NDArray[np.bool_]
    mirrored: NDArray[np.bool_]


def draw_lists(device: Device, sections: SectionDraws) -> list[DrawList]:
    """Opaque ones first, so that they hide what is costlier to shade."""
    arguments = np.zeros(len(sections.first_index), _ARGUMENTS)
    arguments["index_count"] = sections.index_count
    arguments["instances"] = sections.instances
    arguments["first_index"] = sections.first_index
    arguments["record"] = sections.record
    selections = {
        Facing.BOTH: ~sections.boxes & sections.double_sided,
        Facing.FRONT: ~sections.boxes & ~sections.double_sided & ~sections.mirrored,
        Facing.FRONT_MIRRORED: ~sections.boxes & ~sections.double_sided & sections.mirrored,
        Facing.BOXES: sections.boxes & ~sections.mirrored,
        Facing.BOXES_MIRRORED: sections.boxes & sections.mirrored,
    }
    lists = []
    for opaque in (True, False):
        for facing, selected in selections.items():
            chosen = arguments[selected & (sections.opaque == opaque)]
            if len(chosen):
                usage = spy.BufferUsage.indirect_argument | spy.BufferUsage.shader_resource
                buffer = device.buffer("draws", data=chosen.view(np.uint8), usage=usage)
                lists.append(DrawList(DrawKind(opaque, facing), len(chosen), buffer))
    return lists


def section_draws(
    records: NDArray[np.int64],
    rows: NDArray[np.void],
    sections: Sequence[Section | Primitives],
    mirrored: NDArray[np.bool_],
    first_box_index: int,
) -> SectionDraws:
    """What raster needs to know of these records: their numbers, RECORD rows and sections, and which are mirrored."""
    materials = [section.material for section in sections]
    boxes = rows["shape"] > 0
    return SectionDraws(
        record=records,
        first_index=np.where(boxes, first_box_index, rows["first_index"]),
        index_count=np.array([BOX_INDICES.size if isinstance(s, Primitives) else s.indices.size for s in sections]),
        instances=np.array([len(s) if isinstance(s, Primitives) else 1 for s in sections], np.uint32),
        boxes=boxes,
        opaque=np.array([m.alpha_mode is AlphaMode.OPAQUE for m in materials], bool),
        double_sided=np.array([m.double_sided for m in materials], bool),
        mirrored=mirrored,
    )


def is_mirrored(transforms: NDArray[np.float32]) -> NDArray[np.bool_]:
    """(n,) whether (n, 3, 4) transforms turn left hands into right ones."""
    return np.asarray(np.linalg.det(transforms[:, :, :3].astype(np.float64)) < 0)

"""Completes small sections of many meshes together: one by one, NumPy's calls would take most of the time."""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pica.scene.building import Attributes, unit_tangents
from pica.scene.construction import unchecked_constructor
from pica.scene.gltf.element import Element
from pica.scene.material import Material
from pica.scene.mesh import Section
from pica.scene.normals import face_normals, unit_normals

_section = unchecked_constructor(Section)
_NAMES = {"POSITION", "NORMAL", "TANGENT", "TEXCOORD_0", "TEXCOORD_1", "COLOR_0"}
_SMALL = 1 << 10
"""Maximum vertices and corners of a section in a batch."""
_FULL = 1 << 16
"""Maximum vertices and corners of a batch."""


class _Part(NamedTuple):
    source: Element
    attributes: Attributes
    triangles: NDArray[np.uint32]
    section: Section


class SectionBatch:
    """Makes sections from the files' attributes, and completes them in batches, or on request."""

    def __init__(self) -> None:
        self._smooth: list[_Part] = []
        self._flat: list[_Part] = []
        self._size = 0

    @staticmethod
    def takes(attributes: Attributes, triangles: NDArray[np.uint32]) -> bool:
        """Whether a section is one for a batch: small, and it does not deform."""
        small = len(attributes["POSITION"]) <= _SMALL and triangles.size <= _SMALL
        return small and attributes.keys() <= _NAMES

    def add(
        self, source: Element, attributes: Attributes, triangles: NDArray[np.uint32], material: Material
    ) -> Section:  # fmt: skip
        """A section that has its material and triangles at once, and the rest once it is complete."""
        flat = "NORMAL" not in attributes
        section = _section(material=material, indices=triangles, flat=flat)
        (self._flat if flat else self._smooth).append(_Part(source, attributes, triangles, section))
        self._size += len(attributes["POSITION"]) + triangles.size
        if self._size > _FULL:
            self.complete()
        return section

    def complete(self) -> None:
        """Complete the attributes of all queued sections."""
        for parts, flat in ((self._smooth, False), (self._flat, True)):
            if parts:
                _complete(parts, flat)
                parts.clear()
        self._size = 0


def _complete(parts: Sequence[_Part], flat: bool) -> None:
    counts = [len(part.triangles) for part in parts]
    bounds = np.cumsum([0, *(len(part.attributes["POSITION"]) for part in parts)])
    firsts = np.repeat(bounds[:-1], counts).astype(np.uint32)
    triangles = np.concatenate([part.triangles for part in parts]) + firsts[:, None]
    positions = np.concatenate([part.attributes["POSITION"] for part in parts])
    uv0, uv1 = (_joined(parts, bounds, f"TEXCOORD_{number}", 2, 0) for number in range(2))
    colors = _joined(parts, bounds, "COLOR_0", 4, 1)
    tangents = _joined(parts, bounds, "TANGENT", 4, 0)
    if flat:  # 3.7.2.1: vertices are not shared, and the file's tangents are ignored
        normals = np.repeat(face_normals(positions, triangles), 3, axis=0)
        taken = triangles.reshape(-1).astype(np.intp)
        positions, uv0, uv1, colors = (values[taken] for values in (positions, uv0, uv1, colors))
        tangents = np.zeros((len(taken), 4), np.float32)
        bounds = 3 * np.cumsum([0, *counts])
        order = np.arange(len(taken), dtype=np.uint32)
        order.setflags(write=False)
    else:
        normals = unit_normals(np.concatenate([part.attributes["NORMAL"] for part in parts]), positions, triangles)
    tangents = unit_tangents(tangents, normals)
    arrays = {
        "positions": positions, "normals": normals, "tangents": tangents, "uv0": uv0, "uv1": uv1, "colors": colors,
    }  # fmt: skip
    sound = all(np.isfinite(values).all() for values in arrays.values())
    for values in arrays.values():
        values.setflags(write=False)  # shared by sections
    for part, (start, end) in zip(parts, pairwise(bounds.tolist()), strict=True):
        kept = vars(part.section)
        for name, values in arrays.items():
            kept[name] = values[start:end]
        if flat:
            kept["indices"] = order[: end - start].reshape(-1, 3)
        if not sound:
            part.source.apply(part.section.check)


def _joined(
    parts: Sequence[_Part], bounds: NDArray[np.intp], name: str, width: int, missing: float
) -> NDArray[np.float32]:  # fmt: skip
    """(vertices, width) an attribute of all, `missing` where one lacks it or some of its components."""
    values = np.full((int(bounds[-1]), width), missing, np.float32)
    for part, first in zip(parts, bounds.tolist(), strict=False):
        given = part.attributes.get(name)
        if given is not None:
            values[first : first + len(given), : given.shape[1]] = given
    return values

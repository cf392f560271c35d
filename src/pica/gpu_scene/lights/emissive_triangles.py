"""The emissive triangles, in one table with their selection probabilities."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from pica.rhi.tables import Runs
from pica.scene.illumination import average_emission
from pica.scene.model import Section

# gpu_scene/table_rows.slang: EmissiveTriangle
EMISSIVE_TRIANGLE = np.dtype([("record", "u4"), ("primitive", "u4"), ("cumulative", "f4")])
_AT_ONCE = 1 << 20
"""Number of triangles whose areas are computed in one batch."""


class EmissiveTriangles:
    """Runs of triangles, each of one section as placed by some records. They keep their rows while others are added and
    removed; removed ones leave rows without power, which are never chosen."""

    def __init__(self) -> None:
        self._runs = Runs()
        self._added: dict[int, list[tuple[NDArray[np.int64], int, int]]] = {}
        """By key: records, first triangle of the first one, triangles of each."""
        self._rows = np.zeros(0, EMISSIVE_TRIANGLE)
        self._powers = np.zeros(0)
        self.revision = 0
        """Counts the changes."""
        self._records: tuple[int, NDArray[np.int64]] = 0, np.zeros(0, np.int64)
        """As of which revision, and which."""

    def __bool__(self) -> bool:
        return bool(self._added)

    @property
    def rows(self) -> NDArray[np.void]:
        """(n,) EMISSIVE_TRIANGLE, including removed ones, without cumulative fields."""
        return self._rows[: self._runs.end]

    @property
    def powers(self) -> NDArray[np.float64]:
        """(n,) lumen; 0 for holes."""
        return self._powers[: self._runs.end]

    def has(self, key: int) -> bool:
        """Whether triangles were added under this key."""
        return key in self._added

    def records(self) -> NDArray[np.int64]:
        """(n,) records that have triangles."""
        if self._records[0] != self.revision:
            every = [records for records, _ in self.starts()]
            self._records = self.revision, np.concatenate([np.zeros(0, np.int64), *every])
        return self._records[1]

    def starts(self) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64]]]:
        """Records and their first triangles, (n,) each."""
        for added in self._added.values():
            for records, first, triangles in added:
                yield records, first + triangles * np.arange(len(records))

    def add(
        self, key: int, records: NDArray[np.int64], section: Section, to_world: NDArray[np.float32]
    ) -> NDArray[np.int64]:
        """Add the triangles of a section, placed by records (n,) at `to_world` (n, 3, 4); returns first rows, (n,)."""
        triangles = len(section.indices)
        count = triangles * len(records)
        first = self._runs.take(count)
        if self._runs.end > len(self._rows):
            more = max(self._runs.end, 2 * len(self._rows)) - len(self._rows)
            self._rows = np.append(self._rows, np.zeros(more, EMISSIVE_TRIANGLE))
            self._powers = np.append(self._powers, np.zeros(more))
        rows = self._rows[first : first + count].reshape(len(records), triangles)
        rows["record"], rows["primitive"] = records[:, None], np.arange(triangles)
        sides = 2 if section.material.double_sided else 1
        strength = average_emission(section.material) * np.pi * sides
        powers = self._powers[first : first + count].reshape(len(records), triangles)
        step = max(_AT_ONCE // triangles, 1)
        for start in range(0, len(records), step):
            powers[start : start + step] = strength * _areas(section, to_world[start : start + step, :, :3])
        self._added.setdefault(key, []).append((records, first, triangles))
        self.revision += 1
        return first + triangles * np.arange(len(records))

    def remove(self, key: int) -> None:
        """Remove the triangles under this key."""
        added = self._added.pop(key, [])
        for records, first, triangles in added:
            count = triangles * len(records)
            self._powers[first : first + count] = 0
            self._runs.give_back(first, count)
        self.revision += bool(added)


def emissive_table(parts: Sequence[EmissiveTriangles]) -> tuple[NDArray[np.void], float]:
    """(n,) EMISSIVE_TRIANGLE of all tables, one after the other, and their total power in lumen.

    Half of the selection is by power, half by object: a lamp is not starved by large lights that shine elsewhere."""
    if not any(parts):
        return np.zeros(0, EMISSIVE_TRIANGLE), 0.0
    rows, powers = (np.concatenate(values) for values in zip(*((p.rows, p.powers) for p in parts), strict=True))
    total = float(powers.sum())
    of_object = np.bincount(rows["record"], powers)
    by_object = powers / np.maximum(of_object[rows["record"]], 1e-300) / max(np.count_nonzero(of_object), 1)
    rows["cumulative"] = np.cumsum(powers / max(total, 1e-300) + by_object) / 2
    bright = np.flatnonzero(powers)
    rows["cumulative"][bright[-1] if len(bright) else -1 :] = 1.0
    return rows, total


def _areas(section: Section, linear: NDArray[np.float32]) -> NDArray[np.float64]:
    """(n, triangles) areas under linear maps (n, 3, 3)."""
    corners = section.positions[section.indices].astype(np.float64)
    edges = corners[:, 1:] - corners[:, :1]
    moved = np.einsum("nij,tej->ntei", linear.astype(np.float64), edges)
    return np.asarray(np.linalg.norm(np.cross(moved[:, :, 0], moved[:, :, 1]), axis=2) / 2)

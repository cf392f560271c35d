"""Unwraps meshes: charts that do not overlap, by xatlas, kept in the cache folder by the mesh's content."""

import warnings
from collections.abc import Sequence
from hashlib import blake2b
from importlib.metadata import version
from pathlib import Path

import numpy as np
import xatlas
from numpy.typing import NDArray

from pica.caches.places import caches
from pica.errors import PicaError
from pica.images.saving import write_whole
from pica.scene.model import Section
from pica.texture_space.unwrap_progress import REPORTS

GUTTER = 3
"""Texels between charts, about: charts that need more room than the map has are shrunk, with their gaps."""
_FOLDER = f"unwrapped-{version('xatlas')}"


def unwrap(wanted: Sequence[tuple[Section, int]]) -> list[NDArray[np.uint32]]:
    """Of each section, for a square map of so many texels along its side: (triangles, 3) place there of each triangle's
    corners: u and v in 0 to 65535 of the side, u in the lower 16 bits; 0 for triangles that have no place, as
    degenerate ones.

    Those that the cache does not have are reported to `unwrap_progress.REPORTS`.
    """
    meshes = [_Mesh(section, side) for section, side in wanted]
    found = [mesh.load() for mesh in meshes]
    missing = [number for number, corners in enumerate(found) if corners is None]
    total, done, listener = sum(len(meshes[number].indices) for number in missing), 0, REPORTS.listener
    for number in missing:
        if listener is not None:
            listener(done, total)
        found[number] = meshes[number].unwrap()
        done += len(meshes[number].indices)
    if missing and listener is not None:
        listener(done, total)
    return [corners for corners in found if corners is not None]


class _Mesh:
    """What is to be unwrapped, and its file in the cache."""

    def __init__(self, section: Section, side: int) -> None:
        self._positions = np.ascontiguousarray(section.positions, np.float32)
        self.indices = np.ascontiguousarray(section.indices, np.uint32).reshape(-1, 3)
        self._side = side
        state = blake2b(self._positions.tobytes(), digest_size=16)
        state.update(self.indices.tobytes())
        folder = caches()
        self._file = None if folder is None else folder / _FOLDER / f"{state.hexdigest()}-{side}.npy"

    def load(self) -> NDArray[np.uint32] | None:
        """The cache's; None if it has none."""
        return None if self._file is None else _read(self._file, len(self.indices))

    def unwrap(self) -> NDArray[np.uint32]:
        """Anew, and into the cache."""
        corners = _unwrapped(self._positions, self.indices, self._side)
        if self._file is not None:
            _write(self._file, corners)
        return corners


def _unwrapped(positions: NDArray[np.float32], indices: NDArray[np.uint32], side: int) -> NDArray[np.uint32]:
    options = xatlas.PackOptions()
    options.resolution, options.padding, options.bilinear, options.create_image = side, GUTTER, True, False
    atlas = xatlas.Atlas()
    atlas.add_mesh(positions, indices)
    atlas.generate(xatlas.ChartOptions(), options, False)
    _, charted, places = atlas[0]
    corners = np.rint(np.clip(places, 0, 1) * 65535).astype(np.uint32)[charted]
    return corners[..., 0] | corners[..., 1] << np.uint32(16)


def _read(file: Path, triangles: int) -> NDArray[np.uint32] | None:
    """None if there is no such file, or another content than a whole one has."""
    try:
        corners = np.load(file, allow_pickle=False)
    except (OSError, ValueError, EOFError):
        return None
    return corners if corners.shape == (triangles, 3) and corners.dtype == np.uint32 else None


def _write(file: Path, corners: NDArray[np.uint32]) -> None:
    def write(temporary: Path) -> None:
        with temporary.open("wb") as out:
            np.save(out, corners)

    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        write_whole(file, write)
    except (OSError, PicaError) as error:
        warnings.warn(f"{file}: unwrapped meshes are not kept: {error}", stacklevel=2)

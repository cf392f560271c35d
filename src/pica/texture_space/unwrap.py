"""Unwraps meshes: charts that do not overlap, by xatlas, kept in the cache folder by the mesh's content."""

import warnings
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

GUTTER = 3
"""Texels between charts, about: charts that need more room than the map has are shrunk, with their gaps."""
_FOLDER = f"unwrapped-{version('xatlas')}"


def unwrap(section: Section, side: int) -> NDArray[np.uint32]:
    """(triangles, 3) place in a square map of each triangle's corners: u and v in 0 to 65535 of its side, u in the
    lower 16 bits; 0 for triangles that have no place, as degenerate ones.

    `side`: of the map in texels.
    """
    positions = np.ascontiguousarray(section.positions, np.float32)
    indices = np.ascontiguousarray(section.indices, np.uint32).reshape(-1, 3)
    state = blake2b(positions.tobytes(), digest_size=16)
    state.update(indices.tobytes())
    folder = caches()
    file = None if folder is None else folder / _FOLDER / f"{state.hexdigest()}-{side}.npy"
    corners = None if file is None else _read(file, len(indices))
    if corners is None:
        corners = _unwrapped(positions, indices, side)
        if file is not None:
            _write(file, corners)
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

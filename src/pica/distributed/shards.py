"""Shards: .tar files of samples, as WebDataset reads them, the same bytes for the same content."""

import io
import json
import tarfile
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import PIL.Image
from numpy.typing import NDArray

from pica.errors import PicaError
from pica.images.saving import write_whole

Files = Mapping[str, bytes]
"""The files of a sample by the ends of their names, such as "depth.npy"."""


def png(pixels: NDArray[Any]) -> bytes:
    """(height, width[, 3]) of 8 or 16 bits as the bytes of a PNG."""
    stream = io.BytesIO()
    PIL.Image.fromarray(pixels).save(stream, "PNG")
    return stream.getvalue()


def npy(values: NDArray[Any]) -> bytes:
    """The bytes of NumPy's file of an array."""
    stream = io.BytesIO()
    np.save(stream, values, allow_pickle=False)
    return stream.getvalue()


def write_shard(path: Path, samples: Iterable[tuple[str, Files]]) -> None:
    """Write samples of (key, files), whole or not at all. Raises PicaError if it cannot be written."""

    def write(temporary: Path) -> None:
        with tarfile.open(temporary, "w", format=tarfile.USTAR_FORMAT) as archive:
            for key, files in samples:
                for name, content in files.items():
                    entry = tarfile.TarInfo(f"{key}.{name}")  # of 1970 and nobody, so that content alone counts
                    entry.size = len(content)
                    archive.addfile(entry, io.BytesIO(content))

    write_whole(path, write)


def is_whole(path: Path, count: int) -> bool:
    """Whether a shard is there with the records of `count` samples and can be read to its end."""
    try:
        return sum(1 for _ in records(path)) == count
    except PicaError:
        return False


def records(path: Path) -> Iterator[dict[str, Any]]:
    """The .json of each sample of a shard. Raises PicaError if it cannot be read."""
    try:
        with tarfile.open(path, "r:") as archive:
            for entry in archive:
                if entry.name.endswith(".json"):
                    file = archive.extractfile(entry)
                    assert file is not None
                    yield json.load(file)
    except (OSError, tarfile.TarError, ValueError, AssertionError) as error:
        raise PicaError(f"{path}: cannot be read ({error}); remove it and resume") from None

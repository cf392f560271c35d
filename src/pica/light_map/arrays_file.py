"""Named arrays in a file as NumPy's .npz: a ZIP archive of .npy members. Nothing in it is run or taken unchecked."""

import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from pica.errors import PicaError
from pica.files import open_file
from pica.saving import write_whole

MOST_BYTES = 4 << 30
"""Of all arrays of a file together."""
_LONGEST_HEADER = 1 << 12
_SMALLEST = 1 << 10
"""What a compressed byte may become; zlib's own limit is 1032."""
_WHEN = (1980, 1, 1, 0, 0, 0)
"""The same arrays give the same file."""


@dataclass(frozen=True)
class Wanted:
    """An array that a file must have: lengths, -1 for any, and what its elements are."""

    shape: tuple[int, ...]
    dtype: str


def write_arrays(path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write them, whole or not at all. Raises PicaError."""

    def write(temporary: Path) -> None:
        with zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as archive:
            for name, array in arrays.items():
                with archive.open(zipfile.ZipInfo(f"{name}.npy", _WHEN), "w", force_zip64=True) as member:
                    member.write(_header(array.copy(order="C")))
                    member.write(array.tobytes())

    write_whole(path, write)


def read_arrays(path: Path, wanted: Mapping[str, Wanted]) -> dict[str, NDArray[Any]]:
    """Those arrays of a file by name. Raises PicaError, which names the file, where one is missing or does not fit."""
    with open_file(path, str(path)) as file:
        try:
            with zipfile.ZipFile(file) as archive:
                return _members(archive, wanted)
        except (zipfile.BadZipFile, zlib.error, EOFError, OSError, NotImplementedError, RuntimeError) as error:
            raise PicaError(f"{path}: is damaged, or not such a file ({error})") from None
        except ValueError as error:
            raise PicaError(f"{path}: {error}") from None


def _members(archive: zipfile.ZipFile, wanted: Mapping[str, Wanted]) -> dict[str, NDArray[Any]]:
    """Raises ValueError for what is not as it is wanted."""
    infos = {info.filename: info for info in archive.infolist()}
    found, total = {}, 0
    for name, expected in wanted.items():
        info = infos.get(f"{name}.npy")
        if info is None:
            raise ValueError(f"has no array {name!r}")
        total += info.file_size
        if total > MOST_BYTES or info.file_size > _SMALLEST * (info.compress_size + _SMALLEST):
            raise ValueError(f"array {name!r} is larger than a file of that size can hold")
        with archive.open(info) as member:
            found[name] = _array(member, name, expected, info.file_size)
    return found


def _header(array: NDArray[Any]) -> bytes:
    """Of one whose elements lie one after the other, the last index fastest."""
    header = BytesIO()
    np.lib.format.write_array_header_1_0(header, np.lib.format.header_data_from_array_1_0(array))
    return header.getvalue()


def _array(member: Any, name: str, expected: Wanted, size: int) -> NDArray[Any]:
    """Looks at the header before memory is taken for what follows it."""
    file: BinaryIO = member
    if np.lib.format.read_magic(file) != (1, 0):
        raise ValueError(f"array {name!r} is of another version of NumPy's format")
    shape, is_fortran, dtype = np.lib.format.read_array_header_1_0(file, max_header_size=_LONGEST_HEADER)
    fits = len(shape) == len(expected.shape) and all(
        length == most or most < 0 <= length for length, most in zip(shape, expected.shape, strict=True)
    )
    if dtype != np.dtype(expected.dtype) or is_fortran or not fits:
        raise ValueError(f"array {name!r} is {shape} of {dtype}, not {expected.shape} of {expected.dtype}")
    length = dtype.itemsize
    for side in shape:
        length *= side
    if length > size:
        raise ValueError(f"array {name!r} is cut short")
    data = file.read(length)
    if len(data) != length:
        raise ValueError(f"array {name!r} is cut short")
    return np.frombuffer(data, dtype).reshape(shape)

"""Named arrays in a file as NumPy's .npz: a ZIP archive of .npy members. Content is validated and never executed."""

import math
import re
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from pica.errors import PicaError
from pica.files import open_file
from pica.images.saving import write_whole

_MAGIC = b"\x93NUMPY\x01\x00"
_HEADER = re.compile(
    rb"\{'descr': '([^'\\]{1,8})', 'fortran_order': False, 'shape': \(((?:[0-9]{1,18}, ?)*(?:[0-9]{1,18})?)\), \} *\n"
)
"""The format of NumPy's headers of plain arrays. NumPy's own reader parses them as Python, and may raise anything."""
_LONGEST_HEADER = 1 << 12
_MOST_RATIO, _RATIO_FROM = 1 << 10, 1 << 10
"""Bytes that a compressed byte may become, in all beyond the first kB; zlib's own limit is 1032."""
_WAYS = zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED
_WHEN = (1980, 1, 1, 0, 0, 0)
"""Equal arrays give equal files."""


@dataclass(frozen=True)
class Wanted:
    """A required array of a file: lengths, -1 for any, and the type of its elements.

    `stored`: it is not compressed, so the file's size bounds the memory to read it.
    """

    shape: tuple[int, ...]
    dtype: str
    stored: bool = False


Lengths = Mapping[str, int]
"""The first length of each array of a file that has any."""


def write_arrays(path: Path, arrays: Mapping[str, NDArray[Any]], kinds: Mapping[str, Wanted]) -> None:
    """Write them, whole or not at all; `kinds`: as `read_arrays` has it. Raises PicaError."""

    def write(temporary: Path) -> None:
        with zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as archive:
            for name, kind in kinds.items():
                array = np.asarray(arrays[name], kind.dtype)
                info = zipfile.ZipInfo(f"{name}.npy", _WHEN)
                info.compress_type = zipfile.ZIP_STORED if kind.stored else zipfile.ZIP_DEFLATED
                with archive.open(info, "w", force_zip64=True) as member:
                    member.write(_header(array.copy(order="C")))
                    member.write(array.tobytes())

    write_whole(path, write)


def read_arrays(path: Path, kinds: Mapping[str, Wanted], check: Callable[[Lengths], None]) -> dict[str, NDArray[Any]]:
    """The arrays of a file by name. Raises PicaError, with the file's name, if one is missing or invalid.

    `check` is called before any array is read, and raises ValueError for inconsistent lengths.
    """
    with open_file(path, str(path)) as file:
        try:
            return _arrays(file, kinds, check)
        except _UnfitError as error:
            raise PicaError(f"{path}: {error}") from None
        except Exception as error:  # zipfile and zlib raise anything for forged numbers
            fault = str(error) or type(error).__name__
            raise PicaError(f"{path}: is damaged, or not such a file ({fault})") from None


class _UnfitError(Exception):
    """The fault of an array, compared with its requirements."""


def _arrays(file: IO[bytes], kinds: Mapping[str, Wanted], check: Callable[[Lengths], None]) -> dict[str, NDArray[Any]]:
    with zipfile.ZipFile(file) as archive:
        infos = {info.filename: info for info in archive.infolist()}
        shapes = {}
        for name, kind in kinds.items():
            info = infos.get(f"{name}.npy")
            if info is None:
                raise _UnfitError(f"has no array {name!r}")
            _check_member(name, info, kind)
            with archive.open(info) as member:
                shapes[name] = _shape(member, name, kind, info.file_size)
        try:
            check({name: shape[0] for name, shape in shapes.items() if shape})
        except ValueError as error:
            raise _UnfitError(f"is damaged: {error}") from None
        return {name: _array(archive, name, kind, shapes[name]) for name, kind in kinds.items()}


def _check_member(name: str, info: zipfile.ZipInfo, kind: Wanted) -> None:
    if info.compress_type not in _WAYS or (kind.stored and info.compress_type != zipfile.ZIP_STORED):
        raise _UnfitError(f"array {name!r} is compressed in another way than pica does it")
    if info.file_size > _MOST_RATIO * (info.compress_size + _RATIO_FROM):
        raise _UnfitError(f"array {name!r} is larger than a file of that size can hold")


def _header(array: NDArray[Any]) -> bytes:
    """Strides of a contiguous array, last index fastest."""
    header = BytesIO()
    np.lib.format.write_array_header_1_0(header, np.lib.format.header_data_from_array_1_0(array))
    return header.getvalue()


def _shape(member: IO[bytes], name: str, expected: Wanted, size: int) -> tuple[int, ...]:
    """The array's type and shape from a member's header, once it is valid; the data follows."""
    begin = member.read(len(_MAGIC) + 2)
    length = int.from_bytes(begin[len(_MAGIC) :], "little")
    if not begin.startswith(_MAGIC) or length > _LONGEST_HEADER:
        raise _UnfitError(f"array {name!r} is of another version of NumPy's format")
    header = _HEADER.fullmatch(member.read(length))
    if header is None:
        raise _UnfitError(f"array {name!r} is no plain array")
    dtype, shape = header[1].decode("latin-1"), tuple(int(side) for side in header[2].split(b",") if side.strip())
    fits = len(shape) == len(expected.shape) and all(
        length == most or most < 0 for length, most in zip(shape, expected.shape, strict=True)
    )
    if dtype != expected.dtype or not fits:
        raise _UnfitError(f"array {name!r} is {shape} of {dtype}, not {expected.shape} of {expected.dtype}")
    if len(begin) + length + math.prod(shape) * np.dtype(dtype).itemsize != size:
        raise _UnfitError(f"array {name!r} is cut short")
    return shape


def _array(archive: zipfile.ZipFile, name: str, kind: Wanted, shape: tuple[int, ...]) -> NDArray[Any]:
    with archive.open(f"{name}.npy") as member:
        _shape(member, name, kind, archive.getinfo(f"{name}.npy").file_size)
        size = math.prod(shape) * np.dtype(kind.dtype).itemsize
        data = member.read(size)
        if len(data) != size:
            raise _UnfitError(f"array {name!r} is cut short")
        return np.frombuffer(data, kind.dtype).reshape(shape)

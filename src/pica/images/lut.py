"""3D colour look-up tables, and .cube files."""

import warnings
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pica.errors import PicaError, shown
from pica.files import open_file, read, size_of

_LARGEST = 129
"""Entries along a side; the format allows 256, which would take 268 MB on the device."""
_LONGEST = 18
"""Digits of a size."""
_MOST_BYTES = 100_000_000
_NUMBERS = frozenset("+-.0123456789")
"""With which lines of the table begin."""


@dataclass(frozen=True, eq=False)
class Lut:
    """A 3D look-up table of display colours, applied after the tone map: sRGB encoded colours in and out."""

    table: NDArray[np.float32]
    """(n, n, n, 3) red, green and blue by blue, green and red."""
    domain: tuple[tuple[float, float, float], tuple[float, float, float]] = ((0, 0, 0), (1, 1, 1))
    """The colours of the first and the last entry."""

    @staticmethod
    def load(path: str | PathLike[str]) -> "Lut":
        """Read a .cube file (Adobe, "Cube LUT Specification 1.0", 2013) with a 3D table of 2 to 129 entries a side.

        Raises PicaError for a file that is not one, and above 100 MB.
        """
        path = Path(path)
        name = str(path)
        with open_file(path, name) as file:
            if size_of(file) > _MOST_BYTES:
                raise PicaError(f"{name}: is larger than {_MOST_BYTES // 10**6} MB")
            lines = read(file, _MOST_BYTES, name).decode("utf-8", "replace").splitlines()
        return _parsed(name, lines)


def _parsed(name: str, lines: list[str]) -> Lut:
    size, low, high, rows = 0, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), []
    for number, line in enumerate(map(str.strip, lines), 1):
        if not line or line[0] == "#":
            continue
        if line[0] in _NUMBERS:
            rows.append(line)
            continue
        keyword, *values = line.split()
        where = f"{name}: line {number}"
        if keyword == "LUT_3D_SIZE":
            digits = values[0] if len(values) == 1 and values[0].isascii() and values[0].isdigit() else "0"
            size = int(digits) if len(digits) <= _LONGEST else 0  # Python refuses thousands of digits
            if not 2 <= size <= _LARGEST:
                raise PicaError(f"{where}: {shown(' '.join(values))} is not a size of 2 to {_LARGEST}")
        elif keyword == "DOMAIN_MIN":
            low = _color(where, values)
        elif keyword == "DOMAIN_MAX":
            high = _color(where, values)
        elif keyword != "TITLE":
            raise PicaError(f"{where}: {shown(keyword)} is not a keyword of a file with a 3D table")
    if not size:
        raise PicaError(f"{name}: has no LUT_3D_SIZE, so no 3D table")
    if not all(first < last for first, last in zip(low, high, strict=True)):
        raise PicaError(f"{name}: DOMAIN_MIN is not below DOMAIN_MAX")
    if len(rows) != size**3:
        raise PicaError(f"{name}: has {len(rows)} colours, not {size**3} as LUT_3D_SIZE {size} needs")
    return Lut(_colors(name, rows).reshape(size, size, size, 3), (low, high))


def _colors(name: str, rows: list[str]) -> NDArray[np.float32]:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            colors = np.loadtxt(rows, np.float32, ndmin=2)
        except (ValueError, Warning):
            raise PicaError(f"{name}: a line of the table is not three numbers") from None
    if colors.shape[1] != 3 or not np.isfinite(colors).all():
        raise PicaError(f"{name}: a line of the table is not three finite numbers")
    return colors


def _color(where: str, values: list[str]) -> tuple[float, float, float]:
    try:
        red, green, blue = map(float, values)
    except ValueError:
        red = green = blue = float("nan")
    if not all(abs(value) < 1e6 for value in (red, green, blue)):
        raise PicaError(f"{where}: {shown(' '.join(values))} is not three numbers")
    return red, green, blue

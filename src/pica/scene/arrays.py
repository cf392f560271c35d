"""Types of arrays for the fields of a scene; values.py documents checked fields.

Contiguous arrays of the required type are stored without a copy, so that they can be shared. Others are converted
to a new array: floats of any kind are rounded, integers must be exact, in any byte and memory order. Tensors of
other libraries count as arrays (host_arrays.py).
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from pica.errors import shown
from pica.scene.host_arrays import host_array
from pica.scene.values import LARGEST, TOO_LARGE, Check, UnfitError

Shape = int | str
"""An array's length along one axis, or a name for any length. Without a shape an array may have
any."""
LARGEST_SIDE = 16384
"""Texels of a picture along one side; more is not for every device."""
_LAST_ROW = [0.0, 0.0, 0.0, 1.0]
_EXACT = 1 << 24
"""All integers up to this are 32-bit floats."""


def floats(*shape: Shape, low: float = -LARGEST) -> Check[NDArray[np.float32]]:
    """Finite numbers of at least `low` as 32-bit floats."""
    return _numbers(np.dtype(np.float32), shape, low)


def doubles(*shape: Shape, low: float = -LARGEST) -> Check[NDArray[np.float64]]:
    """Finite numbers that fit 32-bit floats too, which they will be on the device, as 64-bit ones."""
    return _numbers(np.dtype(np.float64), shape, low)


def shares(*shape: Shape) -> Check[NDArray[np.float32]]:
    """Numbers from 0 to 1 as 32-bit floats; uint8 counts 255ths, as glTF's normalized integers do."""
    given = floats(*shape)

    def check(values: Any) -> NDArray[np.float32]:
        array = as_array(values, shape, "fiu", "numbers")
        result = given(array / np.float32(255) if array.dtype == np.uint8 else array)
        check_shares(result)
        return result

    return check


def check_shares(values: NDArray[np.float32]) -> None:
    """Raises UnfitError for values outside 0 to 1."""
    if values.min(initial=0) < 0 or values.max(initial=0) > 1:
        outside = (values < 0) | (values > 1)
        hint = "; numbers up to 255 must be uint8" if values.max() > 1 else ""
        raise UnfitError(f"{place_of(outside)}is not from 0 to 1 ({values[outside][0]:g}){hint}")


def numbers(*shape: Shape) -> Check[NDArray[Any]]:
    """Finite numbers within the range of 32-bit floats, of any type."""

    def check(values: Any) -> NDArray[Any]:
        array = as_array(values, shape, "fiu", "numbers")
        floats()(array if array.dtype.kind == "f" else array.astype(np.float64))
        return array

    return check


def integers(dtype: DTypeLike, *shape: Shape) -> Check[NDArray[Any]]:
    """Integers that fit a type of them."""
    made = np.dtype(dtype)

    def check(values: Any) -> NDArray[Any]:
        array = as_array(values, shape, "iu", "integers")
        if array.dtype != made:
            _check_range(array, np.iinfo(made))
        return _converted(array, made)

    return check


def picture(texels: Check[NDArray[Any]]) -> Check[NDArray[Any]]:
    """Of (height, width, channels), sides from 1 to LARGEST_SIDE."""

    def check(values: Any) -> NDArray[Any]:
        result = texels(values)
        height, width, _ = result.shape
        if not (min(height, width) >= 1 and max(height, width) <= LARGEST_SIDE):
            raise UnfitError(f"{width}x{height} texels; width and height must be 1 to {LARGEST_SIDE}")
        return result

    return check


def affine(matrix: ArrayLike) -> NDArray[np.float64]:
    """A copy of a (4, 4) affine matrix: finite, last row 0, 0, 0, 1. It may be singular."""
    plain = type(matrix) is np.ndarray and matrix.dtype == np.float64 and matrix.shape == (4, 4)
    result = np.array(matrix) if plain else _MATRIX(matrix).copy()
    # One product instead of sixteen comparisons, because moving nodes set it in every frame.
    if not np.vdot(result, result) <= LARGEST or result[3].tolist() != _LAST_ROW:
        _MATRIX(result)
        _check_last_rows(result[None])
        result[3] = _LAST_ROW
    return result


def affines(matrices: ArrayLike) -> NDArray[np.float64]:
    """(count, 4, 4) of such matrices, not copied."""
    result = _MATRICES(matrices)
    _check_last_rows(result)
    return result


def place_of(bad: NDArray[np.bool_]) -> str:
    """The position of the first True: "row 3 "; empty for scalars."""
    return f"row {np.argwhere(bad)[0][0]} " if bad.ndim else ""


def _numbers(dtype: np.dtype[Any], shape: tuple[Shape, ...], low: float) -> Callable[[Any], NDArray[Any]]:
    def check(values: Any) -> NDArray[Any]:
        array = as_array(values, shape, "fiu", "numbers")
        result = _converted(array, dtype)
        # A finite sum of squares proves that all values are valid; otherwise they are searched.
        if not np.vdot(result, result) <= LARGEST:
            bad = ~(np.abs(result) <= LARGEST)
            if bad.any():
                given = _first(array, bad)
                fault = TOO_LARGE if np.isfinite(given) else "is not finite"
                raise UnfitError(f"{place_of(bad)}{fault} ({given:g})")
        if array.dtype.kind != "f":
            _check_exact(array, result)
        if low > -LARGEST and result.min(initial=low) < low:
            bad = result < low
            fault = "is negative" if low == 0 else f"is less than {low:g}"
            raise UnfitError(f"{place_of(bad)}{fault} ({_first(array, bad):g})")
        return result

    return check


def _converted(array: NDArray[Any], dtype: np.dtype[Any]) -> NDArray[Any]:
    """In native byte order and C order; the array itself if it is so already."""
    if array.dtype == dtype and array.flags.c_contiguous and array.flags.aligned:
        return array
    with np.errstate(over="ignore"):
        return np.array(array, dtype, order="C")


def as_array(values: Any, shape: tuple[Shape, ...], kinds: str, what: str) -> NDArray[Any]:
    """The values as an array of a shape and of some kinds of numbers."""
    try:
        array = np.asarray(host_array(values))
    except Exception as error:  # raised by an object's own conversion
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise UnfitError(f"is not an array of {what} ({shown(reason)})") from None
    if array.dtype.kind not in kinds:
        given = shown(values) if array.ndim == 0 else f"an array of {array.dtype.name}"
        raise UnfitError(f"{given} is not an array of {what}")
    if shape and not (
        array.ndim == len(shape)
        and all(isinstance(side, str) or side == length for side, length in zip(shape, array.shape, strict=True))
    ):
        expected = ", ".join(map(str, shape)) + ("," if len(shape) == 1 else "")
        raise UnfitError(f"has the shape {array.shape}, not ({expected})")
    return array


def _first(array: NDArray[Any], bad: NDArray[np.bool_]) -> Any:
    return array[tuple(np.argwhere(bad)[0])]


def _check_range(array: NDArray[Any], limits: "np.iinfo[Any]") -> None:
    least, most = int(limits.min), int(limits.max)
    if not array.size or (int(array.min()) >= least and int(array.max()) <= most):
        return
    exact = array.astype(object)
    bad = np.array((exact < least) | (exact > most), bool)
    raise UnfitError(f"{place_of(bad)}is not from {least} to {most} ({shown(_first(array, bad))})")


def _check_exact(given: NDArray[Any], result: NDArray[Any]) -> None:
    """Raises UnfitError for integers that floats do not hold."""
    large = np.asarray((given > _EXACT) | (given < -_EXACT)) if given.dtype.itemsize > 2 else np.zeros(0, bool)
    if not large.any():
        return
    # Python compares integers and floats exactly.
    lost = large.copy()
    lost[large] = result[large].astype(object) != given[large].astype(object)
    if lost.any():
        fault = f"is an integer that {result.dtype.name} does not hold ({_first(given, lost)}); round it to a float"
        raise UnfitError(f"{place_of(lost)}{fault}")


def _check_last_rows(matrices: NDArray[np.float64]) -> None:
    off = np.abs(matrices[:, 3] - _LAST_ROW) > 1e-4  # the accuracy of files and inverses
    if off.any():
        row = matrices[int(np.argwhere(off)[0][0]), 3].tolist()
        raise UnfitError(f"its last row is {shown(row)}, not 0, 0, 0, 1")


_MATRIX, _MATRICES = doubles(4, 4), doubles("count", 4, 4)

"""Primvars: attributes of geometry, for each corner, vertex or face, or constant."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from pica.errors import SceneError

_PER_VERTEX = (UsdGeom.Tokens.vertex, UsdGeom.Tokens.varying)


@dataclass
class Primvar:
    """Values, and which of them each element has."""

    values: NDArray[Any]
    """(values, components)"""
    indices: NDArray[np.intp]
    """(elements,)"""
    interpolation: str

    def rows(self, corners: NDArray[np.intp], faces: NDArray[np.intp]) -> NDArray[np.intp]:
        """(corners,) the rows of `values`, by the vertex and the face of each corner."""
        if self.interpolation == UsdGeom.Tokens.constant:
            return np.zeros(len(corners), np.intp)
        if self.interpolation == UsdGeom.Tokens.uniform:
            return self.indices[faces]
        return self.indices[corners] if self.interpolation in _PER_VERTEX else self.indices


def read_primvar(
    prim: Usd.Prim, name: str, time: Usd.TimeCode, vertices: int, corners: int, faces: int
) -> Primvar | None:
    """A primvar of the prim or inherited by it; None if there is none. Raises SceneError where it does not fit."""
    primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name)
    if not primvar or not primvar.HasValue():
        return None
    given = primvar.Get(time)
    if given is None:
        return None
    values = rows_of(given)
    indices = primvar.GetIndices(time) if primvar.IsIndexed() else None
    interpolation = str(primvar.GetInterpolation())
    return fitting(name, values, indices, interpolation, vertices, corners, faces)


def fitting(
    name: str, values: NDArray[Any], indices: Any, interpolation: str, vertices: int, corners: int, faces: int
) -> Primvar | None:
    """A primvar of the right length; None where it is empty. Raises SceneError."""
    if not len(values):
        return None
    given = np.arange(len(values)) if indices is None else np.asarray(indices, np.intp)
    count = {"constant": 1, "uniform": faces, "faceVarying": corners}.get(interpolation, vertices)
    if len(given) < count or (len(given) and not (given.min() >= 0 and given.max() < len(values))):
        raise SceneError(f"{name}: {len(given)} indices of {len(values)} values do not fit {count} elements")
    return Primvar(values, given[:count], interpolation)


def rows_of(given: Any) -> NDArray[Any]:
    """(values, components) of an array or a single value."""
    array = np.asarray(given)
    if array.ndim == 0:
        array = array[None]
    return array[:, None] if array.ndim == 1 and not _is_vector(given) else array.reshape(-1, array.shape[-1])


def _is_vector(given: Any) -> bool:
    """Whether it is a single Vec3f and not an array of numbers."""
    return type(given).__name__.startswith("Vec")

"""Primvars: attributes of geometry, for each corner, vertex or face, or constant."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from pica.errors import SceneError

_PER_VERTEX = (UsdGeom.Tokens.vertex, UsdGeom.Tokens.varying)
_TEXTURE_COORDINATES = ("texCoord2f[]", "float2[]", "texCoord2d[]", "double2[]", "texCoord2h[]", "half2[]")


class Sizes(NamedTuple):
    """How many values primvars of each interpolation have."""

    vertex: int
    varying: int
    """Of meshes as many as vertices; of cubic curves one at each end of a segment."""
    face_varying: int
    uniform: int

    @staticmethod
    def of_mesh(points: int, corners: int, faces: int) -> "Sizes":
        """Of polygons."""
        return Sizes(points, points, corners, faces)


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


def read_primvar(prim: Usd.Prim, name: str, time: Usd.TimeCode, sizes: Sizes) -> Primvar | None:
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
    return fitting(name, values, indices, interpolation, sizes)


def color_primvars(prim: Usd.Prim, time: Usd.TimeCode, sizes: Sizes) -> dict[str, Primvar]:
    """Colours and opacities, by the names that geometry has for them: COLOR and OPACITY."""
    return _read_all(prim, time, sizes, {"displayColor": "COLOR", "displayOpacity": "OPACITY"})


def coordinate_primvars(prim: Usd.Prim, time: Usd.TimeCode, sizes: Sizes) -> dict[str, Primvar]:
    """Texture coordinates, as UV:name."""
    given = UsdGeom.PrimvarsAPI(prim).FindPrimvarsWithInheritance()
    names = [str(each.GetPrimvarName()) for each in given if str(each.GetTypeName()) in _TEXTURE_COORDINATES]
    return _read_all(prim, time, sizes, {name: f"UV:{name}" for name in names})


def _read_all(prim: Usd.Prim, time: Usd.TimeCode, sizes: Sizes, names: dict[str, str]) -> dict[str, Primvar]:
    found = {key: read_primvar(prim, name, time, sizes) for name, key in names.items()}
    return {key: primvar for key, primvar in found.items() if primvar is not None}


def array_of(attribute: Usd.Attribute, time: Usd.TimeCode, components: int) -> NDArray[np.float64]:
    """(values, components) of an attribute; of no values where it has none."""
    given = attribute.Get(time)
    return np.asarray(() if given is None else given, np.float64).reshape(-1, components)


def diagonal(points: NDArray[np.float64]) -> float:
    """The length of the diagonal of the points' box; 1 for a single place."""
    return float(np.linalg.norm(points.max(axis=0) - points.min(axis=0)) or 1)


def fitting(name: str, values: NDArray[Any], indices: Any, interpolation: str, sizes: Sizes) -> Primvar | None:
    """A primvar of the right length; None where it is empty. Raises SceneError."""
    if not len(values):
        return None
    given = np.arange(len(values)) if indices is None else np.asarray(indices, np.intp)
    counts = {"constant": 1, "uniform": sizes.uniform, "varying": sizes.varying, "faceVarying": sizes.face_varying}
    count = counts.get(interpolation, sizes.vertex)
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

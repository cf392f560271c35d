"""The shapes of primitives, by name: built-in ones and those that users register."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import ClassVar

from pica.errors import PicaError, ShapeError
from pica.scene.material_registry import MaterialSource, read_source

BUILT_IN = ("sphere", "capsule", "torus", "rounded_box")
_FOLDER = Path(__file__).resolve().parents[1] / "shapes"


@dataclass(frozen=True)
class ShapeSource(MaterialSource):
    """The Slang source of a shape, as it was when registered."""

    kind: ClassVar[str] = "shape"
    word: ClassVar[str] = "shape"
    interface_file: ClassVar[str] = "shapes/signed_distance.slang"
    interfaces: ClassVar[dict[str, str]] = {"IShape": "{}", "ISignedDistance": "SignedDistanceShape<{}>"}
    error: ClassVar[type[PicaError]] = ShapeError


_registered: dict[str, MaterialSource] = {}


def register_shape(name: str, path: str | Path) -> None:
    """Register a shape for primitives: `Primitives("gyroid", parameters, bounds, material)`.

    `path`: a Slang file with one struct that implements IShape or ISignedDistance (docs/guide/primitives.md). It is
    read now and compiled when a renderer first needs the shape. Registering the same file again does
    nothing. Raises ShapeError for a name that is in use or no word, and for a file that cannot be read.
    """
    source = read_source(ShapeSource, name, path)
    if name in BUILT_IN or _registered.get(name, source) != source:
        holder = "pica itself" if name in BUILT_IN else _registered[name].path
        raise source.fault(f"the name is taken by {holder}; choose another")
    _registered[name] = source


@cache
def _built_in(name: str) -> MaterialSource:
    return read_source(ShapeSource, name, _FOLDER / f"{name}.slang")


def shape_source(name: str) -> MaterialSource:
    """The source of a shape. Raises ShapeError for a name that is not registered."""
    if name in BUILT_IN:
        return _built_in(name)
    if name not in _registered:
        known = ", ".join((*BUILT_IN, *_registered))
        raise ShapeError(f"shape {name!r} is not registered; there are {known}; see register_shape")
    return _registered[name]

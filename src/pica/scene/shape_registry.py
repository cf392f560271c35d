"""The shapes of primitives, by name: built-in ones and those that users register."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import ClassVar

from pica.errors import PicaError, ShapeError
from pica.scene.material_registry import MaterialSource, read_source, registered_materials

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


def registered_sources() -> list[MaterialSource]:
    """All that users have registered: material types and shapes."""
    return [*registered_materials().values(), *_registered.values()]


@contextmanager
def sources_read_again() -> Iterator[None]:
    """Take all sources as their files are now, those without a file as they are; as before if the block raises.

    Raises MaterialTypeError or ShapeError for a file that cannot be read."""
    registries = registered_materials(), _registered
    before = [dict(registry) for registry in registries]
    _built_in.cache_clear()
    try:
        for registry in registries:
            for name, source in registry.items():
                if source.path.is_file():
                    registry[name] = read_source(type(source), name, source.path)
        yield
    except BaseException:
        for registry, sources in zip(registries, before, strict=True):
            registry.update(sources)
        raise

"""The material types that scenes can use, by name: the standard one and those that users register."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from pica.errors import MaterialTypeError, PicaError, shown

STANDARD = "standard"
"""glTF's metallic-roughness material."""


@dataclass(frozen=True)
class MaterialSource:
    """The Slang source of a registered material type, as it was when registered."""

    name: str
    path: Path
    text: str
    kind: ClassVar[str] = "material type"
    word: ClassVar[str] = "material"
    """What names of its modules begin with."""
    interface_file: ClassVar[str] = "materials/material_type.slang"
    interfaces: ClassVar[dict[str, str]] = {"IMaterialType": "{}"}
    """What its struct may implement, and what to make of it."""
    error: ClassVar[type[PicaError]] = MaterialTypeError

    def fault(self, what: str) -> PicaError:
        """The error that says what is wrong with it."""
        return self.error(f"{self.kind} {shown(self.name)}: {what}")


def read_source(made: type[MaterialSource], name: str, path: str | Path) -> MaterialSource:
    """A source from its file. Raises its error for a name that is not a word and for a file that cannot be read."""
    if not isinstance(name, str) or not re.fullmatch("[a-z][a-z0-9_]*", name):
        raise made(name, Path(), "").fault("a name is a lower case letter, then letters, digits and _")
    try:
        path = Path(path).resolve()
        return made(name, path, path.read_text(encoding="utf-8"))
    except TypeError:
        raise made(name, Path(), "").fault(f"{shown(path)} is not the path of a file") from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not a text file"
        raise made(name, Path(), "").fault(f"{path}: {reason}") from None


STANDARD_SOURCE = MaterialSource(STANDARD, Path(), "")
"""Stands for pica's own."""
_registered: dict[str, MaterialSource] = {}
_registrations = 0


def register_material(name: str, path: str | Path) -> None:
    """Let materials name a type of their own: `Material(type=name, parameters={...})`.

    `path`: a Slang file with one struct that implements IMaterialType (docs/guide/material-types.md). It is read now
    and compiled when a renderer first meets the type. A name that was registered before now means this source:
    renderers that show the type replace it, once its programs are ready.
    Raises MaterialTypeError for a name that is pica's or not a word, and for a file that cannot be read.
    """
    global _registrations
    source = read_source(MaterialSource, name, path)
    if name == STANDARD:
        raise source.fault("the name is taken by pica itself; choose another")
    if _registered.get(name) != source:
        _registered[name] = source
        _registrations += 1


def registrations() -> int:
    """Grows whenever a name comes to mean another source."""
    return _registrations


def material_source(name: str) -> MaterialSource:
    """The source of a registered type. Raises MaterialTypeError for a name that nobody registered."""
    if name == STANDARD:
        return STANDARD_SOURCE
    if name not in _registered:
        known = ", ".join((STANDARD, *_registered))
        raise MaterialTypeError(f"material type {name!r} is not registered; there are {known}; see register_material")
    return _registered[name]

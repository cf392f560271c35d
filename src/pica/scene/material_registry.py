"""The material types of scenes, by name: the standard one and those that users register."""

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
    """Prefix of the names of its modules."""
    interface_file: ClassVar[str] = "materials/material_type.slang"
    interfaces: ClassVar[dict[str, str]] = {"IMaterialType": "{}"}
    """Interfaces that its struct may implement, and their generated code."""
    error: ClassVar[type[PicaError]] = MaterialTypeError

    def fault(self, what: str) -> PicaError:
        """The error for a fault in it."""
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
"""The source of pica's own type."""
_registered: dict[str, MaterialSource] = {}
_registrations = 0


def register_material(name: str, path: str | Path) -> None:
    """Register a material type of your own: `Material(type=name, parameters={...})`.

    `path`: a Slang file with one struct that implements IMaterialType (docs/guide/material-types.md). It is read now
    and compiled when a renderer first needs the type. Registering a name again replaces its source:
    renderers with the type switch to it, once its programs are compiled.
    Raises MaterialTypeError for a name that is pica's or no word, and for a file that cannot be read.
    """
    global _registrations
    source = read_source(MaterialSource, name, path)
    if name == STANDARD:
        raise source.fault("the name is taken by pica itself; choose another")
    if _registered.get(name) != source:
        _registered[name] = source
        _registrations += 1


def registrations() -> int:
    """Counts registrations that change a name's source."""
    return _registrations


def material_source(name: str) -> MaterialSource:
    """The source of a registered type. Raises MaterialTypeError for a name that is not registered."""
    if name == STANDARD:
        return STANDARD_SOURCE
    if name not in _registered:
        known = ", ".join((STANDARD, *_registered))
        raise MaterialTypeError(f"material type {name!r} is not registered; there are {known}; see register_material")
    return _registered[name]


def registered_materials() -> dict[str, MaterialSource]:
    """The sources of all registered types by name; for changes."""
    return _registered

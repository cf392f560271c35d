"""The material types that scenes can use, by name: the standard one and those that users register."""

import re
from dataclasses import dataclass
from pathlib import Path

from pica.errors import MaterialTypeError

STANDARD = "standard"
"""glTF's metallic-roughness material."""


@dataclass(frozen=True)
class MaterialSource:
    """The Slang source of a registered material type, as it was when registered."""

    name: str
    path: Path
    text: str


_registered: dict[str, MaterialSource] = {}


def register_material(name: str, path: str | Path) -> None:
    """Let materials name a type of their own: `Material(type=name, parameters={...})`.

    `path`: a Slang file with one struct that implements IMaterialType (docs/material-types.md). It is read now and
    compiled when a renderer first meets the type. The same file under the same name again changes nothing.
    Raises MaterialTypeError for a name that is taken or not a word, and for a file that cannot be read.
    """
    path = Path(path).resolve()
    if not re.fullmatch("[a-z][a-z0-9_]*", name):
        raise MaterialTypeError(f"material type {name!r}: a name is a lower case letter, then letters, digits and _")
    try:
        source = MaterialSource(name, path, path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not a text file"
        raise MaterialTypeError(f"material type {name!r}: {path}: {reason}") from None
    if name == STANDARD or _registered.get(name, source) != source:
        holder = "pica itself" if name == STANDARD else _registered[name].path
        raise MaterialTypeError(f"material type {name!r}: the name is taken by {holder}; choose another")
    _registered[name] = source


def material_source(name: str) -> MaterialSource:
    """The source of a registered type. Raises MaterialTypeError for a name that nobody registered."""
    if name not in _registered:
        known = ", ".join((STANDARD, *_registered))
        raise MaterialTypeError(f"material type {name!r} is not registered; there are {known}; see register_material")
    return _registered[name]

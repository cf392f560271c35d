"""What a scene's file says of itself."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Source:
    """The file that a scene was loaded from."""

    format: str
    """Such as "glTF 2.0", or the file's suffix in capitals."""
    bytes: int
    """Size on disk of the file and of all files that it refers to and that were read."""
    copyright: str = ""
    generator: str = ""
    """The program that wrote the file."""
    xmp: Mapping[str, Any] = field(default_factory=dict)
    """The file's XMP metadata, as JSON-LD (KHR_xmp_json_ld)."""
    extensions: Mapping[str, str] = field(default_factory=dict)
    """Of glTF, by name, what is done with each: "supported", "ignored: ..." or "refused"."""

"""What a file says of itself: copyright, generator, metadata (3.2 and KHR_xmp_json_ld), extensions."""

from typing import Any

from pica.scene.gltf.container import Document
from pica.scene.gltf.element import Element
from pica.scene.gltf.extensions import treatments
from pica.scene.source import Source

_XMP = "KHR_xmp_json_ld"
_DEEPEST = 32
"""Levels of a packet; XMP needs about four. Deeper ones, which recursive programs fail on, are left out."""


def read_source(document: Document, converted: bool = False) -> Source:
    """The source of what has been read so far. `converted`: the glTF was made of another file, so its extensions
    are not the file's."""
    asset = document.root.object("asset")
    return Source(
        format=document.suffix.upper() if converted else f"glTF {asset.text('version')}",
        bytes=document.budget.file_bytes,
        copyright=_text(asset, "copyright"),
        generator=_text(asset, "generator"),
        xmp=_packet(document, asset),
        extensions={} if converted else treatments(document),
    )


def _text(asset: Element, key: str) -> str:
    """Metadata of another type is left out: nothing that is shown depends on it."""
    value = asset.values.get(key)
    return value if type(value) is str else ""


def _packet(document: Document, asset: Element) -> dict[str, Any]:
    """The packet that the asset refers to; those of nodes and others are left out."""
    packets, place = (_extension(element).get(key) for element, key in ((document.root, "packets"), (asset, "packet")))
    if type(packets) is not list or type(place) is not int or not 0 <= place < len(packets):
        return {}
    packet = packets[place]
    return packet if type(packet) is dict and _depth(packet) <= _DEEPEST else {}


def _depth(packet: dict[str, Any]) -> int:
    """Levels of objects and lists within one another, at most one more than are read."""
    depth, level = 0, list[Any]([packet])
    while level and depth <= _DEEPEST:
        depth += 1
        below = (each for part in level for each in (part.values() if isinstance(part, dict) else part))
        level = [each for each in below if isinstance(each, dict | list)]
    return depth


def _extension(element: Element) -> dict[str, Any]:
    extensions = element.values.get("extensions")
    found = extensions.get(_XMP) if type(extensions) is dict else None
    return found if type(found) is dict else {}

"""The pointers of KHR_animation_pointer, which name what a channel animates."""

import re
from typing import Any, NamedTuple

_EXTENSION = "KHR_animation_pointer"
VISIBLE = "extensions/KHR_node_visibility/visible"


def animated(root: dict[str, Any]) -> list[str]:
    """The pointers of a file's animations, each once; faults are left to the reader of the channel."""
    found: dict[str, None] = {}
    animations = root.get("animations")
    for animation in animations if type(animations) is list else ():
        channels = animation.get("channels") if type(animation) is dict else None
        for channel in channels if type(channels) is list else ():
            target = channel.get("target") if type(channel) is dict else None
            if type(target) is dict and target.get("path") == "pointer" and (pointer := pointer_of(target)):
                found[pointer] = None
    return list(found)


def pointer_of(target: dict[str, Any]) -> str:
    """The pointer of a channel's target; empty if it has none."""
    extensions = target.get("extensions")
    extension = extensions.get(_EXTENSION) if type(extensions) is dict else None
    pointer = extension.get("pointer") if type(extension) is dict else None
    return pointer if type(pointer) is str else ""


_ENTRY = re.compile(r"/(nodes|materials|cameras|extensions/KHR_lights_punctual/lights)/(0|[1-9]\d{0,8})/(.+)")


class Place(NamedTuple):
    """Where a pointer points."""

    array: str
    row: int
    key: str


def parsed(pointer: str) -> Place | None:
    """The parts of a pointer (RFC 6901; no key that is animated needs escapes); None where it is of no known kind."""
    match = _ENTRY.fullmatch(pointer)
    return None if match is None else Place(match[1], int(match[2]), match[3])

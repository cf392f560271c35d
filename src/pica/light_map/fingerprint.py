"""Digests of scenes: of their content, and of its placement."""

from dataclasses import fields, is_dataclass
from enum import Enum
from hashlib import blake2b
from typing import Any

import numpy as np

from pica.scene.model import Scene

_LENGTH = 16
"""Bytes."""


def content_of(scene: Scene) -> str:
    """A digest of all meshes, materials, lights and surroundings, in order; independent of their transforms."""
    digests: dict[int, bytes] = {}
    parts = [_digest(scene.environment, digests)]
    for node in scene.nodes():
        copies = 1 if node.instances is None else len(node.instances)
        parts.append(_digest([node.mesh, node.light, copies, node.casts_shadows, node.visible_to_reflections], digests))
    return _hash(*parts).hex()


def layout_of(scene: Scene) -> str:
    """A digest of all transforms."""
    places = [node.instance_transforms().astype(np.float32).tobytes() for node in scene.nodes()]
    return _hash(*places).hex()


def _digest(value: Any, digests: dict[int, bytes]) -> bytes:
    """The digest of a value; shared meshes, materials and pictures are hashed once."""
    if isinstance(value, np.ndarray):
        return _hash(str((value.dtype.str, value.shape)).encode(), np.ascontiguousarray(value).tobytes())
    if isinstance(value, Enum):
        return _hash(value.name.encode())
    if isinstance(value, list | tuple):
        return _hash(*(_digest(item, digests) for item in value))
    if isinstance(value, set | frozenset):
        return _hash(*sorted(_digest(item, digests) for item in value))
    if isinstance(value, dict):
        return _hash(*(_digest([name, value[name]], digests) for name in sorted(value)))
    if not is_dataclass(value):
        return _hash(repr(value).encode())
    if id(value) not in digests:
        named = ((field.name.encode(), _digest(getattr(value, field.name), digests)) for field in fields(value))
        digests[id(value)] = _hash(type(value).__name__.encode(), *(part for pair in named for part in pair))
    return digests[id(value)]


def _hash(*parts: bytes) -> bytes:
    state = blake2b(digest_size=_LENGTH)
    for part in parts:
        state.update(len(part).to_bytes(8, "little"))
        state.update(part)
    return state.digest()

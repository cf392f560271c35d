"""Animations (3.11)."""

import math
import re
from collections.abc import Set
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pica.errors import shown
from pica.scene.animation import Animation, Channel, Path
from pica.scene.construction import unchecked_constructor
from pica.scene.field_channel import FieldChannel
from pica.scene.gltf.accessors import read_floats
from pica.scene.gltf.container import Document
from pica.scene.gltf.curves import Curve
from pica.scene.gltf.element import Element
from pica.scene.gltf.field_animations import FieldTargets, field_channels
from pica.scene.gltf.materials import Materials
from pica.scene.gltf.pointers import pointer_of
from pica.scene.gltf.prefetch import SmallAccessors
from pica.scene.keyframes import Interpolation
from pica.scene.limits import OBJECT_BYTES
from pica.scene.model import Node
from pica.text import printable

_PATHS: dict[str, Path] = {
    "translation": "translation", "rotation": "rotation", "scale": "scale", "weights": "weights",
}  # fmt: skip
_TYPES: dict[Path, tuple[str, ...]] = {
    "translation": ("VEC3",), "rotation": ("VEC4",), "scale": ("VEC3",), "weights": ("SCALAR",),
}  # fmt: skip
_WIDTHS = {"translation": 3, "rotation": 4, "scale": 3}
_KEY_BYTES = 4 * 8
"""Bytes per number of a key: itself, and copies in the track of its animation and in that of all together."""
_NODE_POINTER = re.compile(r"/nodes/(0|[1-9]\d{0,8})/(translation|rotation|scale|weights)")
_LONGEST = 200
"""Characters of a pointer in a warning."""
_INDEX = re.compile(r"/\d+")
_INTERPOLATIONS: dict[str, Interpolation] = {"STEP": "STEP", "LINEAR": "LINEAR", "CUBICSPLINE": "CUBICSPLINE"}

_plain_channel = unchecked_constructor(Channel)


def read_animations(
    document: Document, nodes: dict[Element, Node], hidden: Set[Element], materials: Materials
) -> list[Animation]:
    """The file's animations of `nodes`, the scene's nodes by their indices in the file; `hidden`: those without meshes.

    Raises SceneError; warns once of channels with an unsupported target.
    """
    targets = FieldTargets(document, nodes, materials)
    return [_animation(document, entry, nodes, hidden, targets) for entry in document.entries("animations")]


class _Move(NamedTuple):
    """A channel, before its keys are read."""

    sampler: Element
    node: Node
    path: Path


def _animation(
    document: Document, entry: Element, nodes: dict[Element, Node], hidden: Set[Element], targets: FieldTargets
) -> Animation:
    samplers = entry.objects("samplers")
    moves: list[_Move] = []
    curves: dict[str, Curve] = {}
    for channel in entry.objects("channels"):
        pointer = _field_pointer(channel)
        if pointer:
            curve = _curve(document, channel.reference("sampler", samplers), pointer, targets)
            curves |= {} if curve is None else {pointer: curve}
            continue
        moved, path = _target(document, channel)
        if moved is None or path is None or moved not in nodes or (path == "weights" and moved in hidden):
            continue
        if path != "weights" and "matrix" in moved:
            fault = f"{moved.place()} has a matrix, which cannot be animated"
            raise channel.object("target").fault(fault, "node")
        moves.append(_Move(channel.reference("sampler", samplers), nodes[moved], path))
    least = entry.pica.number("duration", low=0, default=0.0)
    channels: list[Channel | FieldChannel] = [*_channels(document, entry, moves)]
    channels += field_channels(targets, document, entry, curves)
    return entry.apply(Animation, channels, entry.name, duration=least)


def _target(document: Document, channel: Element) -> tuple[Element | None, Path | None]:
    """The target of a channel; None, with a warning, if it is unsupported. Raises SceneError."""
    nodes, target = document.entries("nodes"), channel.values.get("target")
    if type(target) is dict:  # as it should be: no Element is needed
        path, row = target.get("path"), target.get("node")
        if path == "pointer" and (move := _NODE_POINTER.fullmatch(pointer_of(target))) and int(move[1]) < len(nodes):
            return nodes[int(move[1])], _PATHS[move[2]]
        if type(path) is str and path in _PATHS and type(row) is int and 0 <= row < len(nodes):
            return nodes[row], _PATHS[path]
    channel_target = channel.object("target", required=True)
    target_path = _PATHS.get(channel_target.text("path"))
    if "node" not in channel_target or target_path is None:
        document.warn("animates what is not a node's translation, rotation, scale or weights, which is left out")
        return None, None
    return channel_target.reference("node", nodes), target_path


def _field_pointer(channel: Element) -> str:
    """The pointer of a channel of KHR_animation_pointer; empty for others, and for what nodes' own channels set."""
    target = channel.values.get("target")
    if type(target) is not dict or target.get("path") != "pointer":
        return ""
    pointer = pointer_of(target)
    return "" if _NODE_POINTER.fullmatch(pointer) else pointer


def _curve(document: Document, sampler: Element, pointer: str, targets: FieldTargets) -> Curve | None:
    """The keys of a channel with a pointer; None, with a warning, if it points at nothing that animations can set."""
    found = targets.get(pointer)
    if found is None:
        document.warn(f"animates {printable(_INDEX.sub('/{}', pointer)[:_LONGEST])}, which is left out")
    if not found:
        return None
    count = targets.components(pointer)
    interpolation = sampler.choice("interpolation", _INTERPOLATIONS, default="LINEAR")
    times = _times(document, sampler)
    values = read_floats(document, sampler, "output", ("SCALAR" if count == 1 else f"VEC{count}",))
    shape = (len(times), 3, count) if interpolation == "CUBICSPLINE" else (len(times), count)
    if values.size != math.prod(shape):
        raise sampler.fault(f"{len(values)} elements do not fit {len(times)} keys of {shown(pointer)}", "output")
    return Curve(times, values.reshape(shape).astype(np.float64), interpolation)


def _times(document: Document, sampler: Element) -> NDArray[np.float64]:
    times = read_floats(document, sampler, "input", ("SCALAR",))[:, 0].astype(np.float64)
    if times[0] < 0 or (np.diff(times) < 0).any():
        raise sampler.fault("times must ascend from 0", "input")
    return times


def _channels(document: Document, entry: Element, moves: list[_Move]) -> list[Channel]:
    """The channels. Those with few keys, nearly all in a large file, are read together in a fifth of the time."""
    accessors = document.small_accessors
    accessors.prefetch(move.sampler.values.get(key) for move in moves for key in ("input", "output"))
    inputs = {index for move in moves if type(index := move.sampler.values.get("input")) is int}
    times = {index: _ascending(accessors.get(index)) for index in inputs}
    keys = [_few_keys(move, times, accessors) for move in moves]
    turns = [few.values for few, move in zip(keys, moves, strict=True) if few is not None and move.path == "rotation"]
    if turns and not np.concatenate(turns).any(axis=1).all():
        keys = [None] * len(keys)  # the reader of single channels finds the fault
    numbers = sum(few.times.size + few.values.size for few in keys if few is not None)
    document.take(entry, bytes=numbers * _KEY_BYTES + OBJECT_BYTES * (len(keys) - keys.count(None)))
    return [
        _channel(document, *move)
        if few is None
        else _plain_channel(
            node=move.node,
            path=move.path,
            times=few.times,
            values=few.values.astype(np.float64),
            interpolation=few.interpolation,
        )
        for few, move in zip(keys, moves, strict=True)
    ]


class _FewKeys(NamedTuple):
    """Of one channel, as far as they fit."""

    times: NDArray[np.float64]
    values: NDArray[np.float32]
    interpolation: Interpolation


def _few_keys(
    move: _Move, times: dict[int, NDArray[np.float64] | None], accessors: SmallAccessors
) -> _FewKeys | None:  # fmt: skip
    """The keys of a valid channel whose accessors are prefetched; None for others."""
    sampler = move.sampler.values
    source, interpolation = sampler.get("input"), sampler.get("interpolation", "LINEAR")
    values = accessors.get(sampler.get("output"))
    at = times[source] if type(source) is int else None
    if at is None or values is None or interpolation not in ("LINEAR", "STEP"):
        return None
    fits = values.dtype == np.float32 and values.shape == (len(at), _WIDTHS.get(move.path))
    return _FewKeys(at, values, interpolation) if fits else None


def _ascending(times: NDArray[Any] | None) -> NDArray[np.float64] | None:
    """(keys,) as a channel has them; None where they are not times."""
    if times is None or times.dtype != np.float32 or times.shape[1] != 1:
        return None
    ascending = times[:, 0].astype(np.float64)
    return None if ascending[0] < 0 or (np.diff(ascending) < 0).any() else ascending


def _channel(document: Document, sampler: Element, node: Node, path: Path) -> Channel:
    interpolation = sampler.choice("interpolation", _INTERPOLATIONS, default="LINEAR")
    times = _times(document, sampler)
    values = read_floats(document, sampler, "output", _TYPES[path])
    width = values.shape[1]
    if path == "weights":
        width = 0 if node.weights is None else len(node.weights)
        if not width:
            raise sampler.fault(f"animates the weights of node {node.name!r}, which has no morph targets")
    shape = (len(times), 3, width) if interpolation == "CUBICSPLINE" else (len(times), width)
    if values.size != math.prod(shape):
        raise sampler.fault(f"{len(values)} elements do not fit {len(times)} keys of {path}", "output")
    document.take(sampler, bytes=OBJECT_BYTES + (times.size + values.size) * _KEY_BYTES)
    shaped: NDArray[np.float64] = values.reshape(shape).astype(np.float64)
    keys = shaped[:, 1] if interpolation == "CUBICSPLINE" else shaped
    if path == "rotation" and not keys.any(axis=1).all():
        raise sampler.fault("a quaternion of zeros is no rotation", "output")
    return sampler.apply(Channel, node, path, times, shaped, interpolation)

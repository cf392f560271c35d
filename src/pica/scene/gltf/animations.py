"""Animations (3.11)."""

import math

import numpy as np
from numpy.typing import NDArray

from pica.scene.animation import Animation, Channel, Interpolation, Path
from pica.scene.gltf.accessors import read_floats
from pica.scene.gltf.container import Document
from pica.scene.gltf.element import Element
from pica.scene.limits import OBJECT_BYTES
from pica.scene.model import Node

_PATHS: dict[str, Path] = {
    "translation": "translation", "rotation": "rotation", "scale": "scale", "weights": "weights",
}  # fmt: skip
_TYPES: dict[Path, tuple[str, ...]] = {
    "translation": ("VEC3",), "rotation": ("VEC4",), "scale": ("VEC3",), "weights": ("SCALAR",),
}  # fmt: skip
_KEY_BYTES = 4 * 8
"""What a number of a key takes: it is kept, and once more in the track of its animation and in that of all together."""
_INTERPOLATIONS: dict[str, Interpolation] = {"STEP": "STEP", "LINEAR": "LINEAR", "CUBICSPLINE": "CUBICSPLINE"}


def read_animations(document: Document, nodes: dict[Element, Node]) -> list[Animation]:
    """The file's animations, as far as they concern `nodes`, those of the scene by what the file says of them.

    Raises SceneError; warns once of channels that move what cannot be moved.
    """
    return [_animation(document, entry, nodes) for entry in document.entries("animations")]


def _animation(document: Document, entry: Element, nodes: dict[Element, Node]) -> Animation:
    channels = []
    samplers = entry.objects("samplers")
    for channel in entry.objects("channels"):
        target = channel.object("target", required=True)
        path = _PATHS.get(target.text("path"))
        if "node" not in target or path is None:
            document.warn("animates what is not a node's translation, rotation, scale or weights, which is left out")
            continue
        moved = target.reference("node", document.entries("nodes"))
        if moved not in nodes:
            continue
        if path != "weights" and "matrix" in moved:
            raise target.fault(f"{moved.place()} has a matrix, which cannot be animated", "node")
        channels.append(_channel(document, channel.reference("sampler", samplers), nodes[moved], path))
    return entry.apply(Animation, channels, entry.name)


def _channel(document: Document, sampler: Element, node: Node, path: Path) -> Channel:
    interpolation = sampler.choice("interpolation", _INTERPOLATIONS, default="LINEAR")
    times = read_floats(document, sampler, "input", ("SCALAR",))[:, 0].astype(np.float64)
    if times[0] < 0 or (np.diff(times) < 0).any():
        raise sampler.fault("times must ascend from 0", "input")
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

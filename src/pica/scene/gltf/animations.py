"""Animations (3.11)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.errors import SceneError
from pica.scene.animation import Animation, Channel, Interpolation, Path
from pica.scene.gltf.accessors import read_floats
from pica.scene.gltf.checks import choice, listing, text
from pica.scene.gltf.container import Document
from pica.scene.model import Node

_TYPES: dict[Path, tuple[str, ...]] = {
    "translation": ("VEC3",), "rotation": ("VEC4",), "scale": ("VEC3",), "weights": ("SCALAR",),
}  # fmt: skip
_INTERPOLATIONS: dict[str, Interpolation] = {"STEP": "STEP", "LINEAR": "LINEAR", "CUBICSPLINE": "CUBICSPLINE"}


def read_animations(document: Document, nodes: dict[int, Node]) -> list[Animation]:
    """The file's animations, as far as they concern `nodes`, those of the scene by their number in the file.

    Raises SceneError; warns once of channels that move what cannot be moved.
    """
    return [
        _animation(document, entry, nodes, f"animations[{index}]")
        for index, entry in enumerate(listing(document.gltf.animations, "animations"))
    ]


def _animation(document: Document, entry: Any, nodes: dict[int, Node], where: str) -> Animation:
    channels = []
    samplers = listing(entry.samplers, f"{where}.samplers")
    for number, channel in enumerate(listing(entry.channels, f"{where}.channels")):
        place = f"{where}.channels[{number}]"
        if channel.target is None:
            raise SceneError(f"{place}.target: is missing")
        index, path = channel.target.node, channel.target.path
        if index is None or path not in _TYPES:
            document.warn("animates what is not a node's translation, rotation, scale or weights, which is left out")
            continue
        target = document.item("nodes", index, f"{place}.target.node")
        if index not in nodes:
            continue
        if path != "weights" and target.matrix is not None:
            raise SceneError(f"{place}: nodes[{index}] has a matrix, which cannot be animated")
        if not isinstance(channel.sampler, int) or not 0 <= channel.sampler < len(samplers):
            raise SceneError(f"{place}.sampler: {where}.samplers[{channel.sampler!r}] does not exist")
        sampler = samplers[channel.sampler]
        channels.append(_channel(document, sampler, nodes[index], path, f"{where}.samplers[{channel.sampler}]"))
    return Animation(channels, text(entry.name))


def _channel(document: Document, sampler: Any, node: Node, path: Path, where: str) -> Channel:
    interpolation = choice(sampler.interpolation or "LINEAR", f"{where}.interpolation", _INTERPOLATIONS)
    times = read_floats(document, sampler.input, f"{where}.input", ("SCALAR",))[:, 0].astype(np.float64)
    if times[0] < 0 or (np.diff(times) < 0).any():
        raise SceneError(f"{where}.input: times must ascend from 0")
    values = read_floats(document, sampler.output, f"{where}.output", _TYPES[path])
    width = values.shape[1]
    if path == "weights":
        width = 0 if node.weights is None else len(node.weights)
        if not width:
            raise SceneError(f"{where}: animates the weights of node {node.name!r}, which has no morph targets")
    shape = (len(times), 3, width) if interpolation == "CUBICSPLINE" else (len(times), width)
    if values.size != np.prod(shape):
        raise SceneError(f"{where}.output: {len(values)} elements do not fit {len(times)} keys of {path}")
    shaped: NDArray[np.float64] = values.reshape(shape).astype(np.float64)
    keys = shaped[:, 1] if interpolation == "CUBICSPLINE" else shaped
    if path == "rotation" and not keys.any(axis=1).all():
        raise SceneError(f"{where}.output: a quaternion of zeros is no rotation")
    return Channel(node, path, times, shaped, interpolation)

"""Sequences of frames that put one effect to the test: nothing moves, or the camera, the objects, the lights."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from pica.scene.camera import Camera
from pica.scene.model import Node, Scene
from pica.scene.orbit import orbited, pivot
from pica.scenes.placing import move, rotate

Sequence = Callable[[int], Camera]
"""Sets the scene to the state of a frame, counted from 0, and returns the camera of that frame."""

_DEGREES_PER_FRAME = 0.25
"""Degrees per frame of rotating cameras and suns: 15 degrees a second at 60 frames a second."""
_SWAY = 0.04
"""Of the scene's diagonal, by which objects and lamps swing to each side."""
_PERIOD = 120
"""Frames of a swing."""
_GROUND = 0.5
"""Of the scene's diagonal; larger objects do not move."""


def sequence(
    name: str, scene: Scene, camera: Camera, start: float = 0.0, animation: int | str | None = None
) -> Sequence:
    """One of SEQUENCES, from the current state of the scene. `start` seconds and `animation`: initial time and
    choice of animations for moving objects, as in Scene.animate."""
    if name == "objects" and scene.animations:
        return _animated(scene, camera, start, animation)
    return SEQUENCES[name](scene, camera)


def _still(scene: Scene, camera: Camera) -> Sequence:
    return lambda frame: camera


def _camera(scene: Scene, camera: Camera) -> Sequence:
    """Round the vertical axis through the camera's target."""
    center = pivot(scene, camera)
    return lambda frame: orbited(camera, center, math.radians(_DEGREES_PER_FRAME * frame))


def _animated(scene: Scene, camera: Camera, start: float, animation: int | str | None) -> Sequence:
    """The animation at 60 frames a second."""

    def play(frame: int) -> Camera:
        scene.animate(start + frame / 60, animation)
        return camera

    return play


def _objects(scene: Scene, camera: Camera) -> Sequence:
    """Small objects sway, with different phases."""
    diagonal = _diagonal(scene)
    swaying = [node for node in scene.nodes() if node.mesh is not None and _node_diagonal(node) < _GROUND * diagonal]
    return _swing(swaying, diagonal, camera)


def _light(scene: Scene, camera: Camera) -> Sequence:
    """Suns rotate about the vertical axis, lamps sway."""
    from pica.scene.light import DirectionalLight

    shining = [node for node in scene.nodes() if node.light is not None]
    suns = [(node, node.world) for node in shining if isinstance(node.light, DirectionalLight)]
    lamps = _swing([node for node in shining if not isinstance(node.light, DirectionalLight)], _diagonal(scene), camera)

    def play(frame: int) -> Camera:
        for node, world in suns:
            _place(node, rotate("y", _DEGREES_PER_FRAME * frame) @ world)
        return lamps(frame)

    return play


def _swing(nodes: list[Node], diagonal: float, camera: Camera) -> Sequence:
    places = [(node, node.world) for node in nodes]

    def play(frame: int) -> Camera:
        for index, (node, world) in enumerate(places):
            phase = 2 * math.pi * (frame / _PERIOD + index * 0.618)
            start = 2 * math.pi * index * 0.618
            across, along = math.sin(phase) - math.sin(start), math.cos(phase) - math.cos(start)
            _place(node, move(_SWAY * diagonal * across, 0, _SWAY * diagonal * along) @ world)
        return camera

    return play


def _place(node: Node, world: NDArray[np.float64]) -> None:
    above = np.eye(4) if node.parent is None else node.parent.world
    node.transform = np.linalg.inv(above) @ world


def _diagonal(scene: Scene) -> float:
    low, high = scene.bounds()
    return float(np.linalg.norm(high - low))


def _node_diagonal(node: Node) -> float:
    alone = Scene()
    shown = alone.add(Node(mesh=node.mesh))
    shown.instances = node.instances
    shown.transform = node.world
    return _diagonal(alone)


SEQUENCES: dict[str, Callable[[Scene, Camera], Sequence]] = {
    "still": _still,
    "camera": _camera,
    "objects": _objects,
    "light": _light,
}

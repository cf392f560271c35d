"""Sequences of frames that put renderers to the test: nothing moves, or the camera, the objects, the lights."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.errors import PicaError
from pica.scene.camera import Camera
from pica.scene.model import Node, Scene
from pica.scene.orbit import dollied, encloses, orbited, pivot, turned
from pica.scenes.placing import move, rotate

Sequence = Callable[[int], Camera]
"""Sets the scene to the state of a frame, counted from 0, and returns the camera of that frame."""

_DEGREES = 1.0
"""Degrees per frame of rotating cameras: 60 degrees a second at 60 frames a second."""
_SUN_DEGREES = 0.25
"""Degrees per frame of rotating suns."""
_STEP = 1 / 30
"""Seconds per frame of animations."""
_WALK, _NEAREST = 0.05, 0.01
"""Metres per frame of the dolly, 1.5 m/s at 30 frames a second; at most this fraction of the way to the pivot."""
_SWITCH, _DIMMED = 16, 0.2
"""Frames between steps of a light, and its dimmed fraction: not 0, where the reference could be black."""
_SWAY = 0.04
"""Of the scene's diagonal, by which objects and lamps swing to each side."""
_PERIOD = 4.0
"""Seconds of a swing."""
_GROUND = 0.5
"""Of the scene's diagonal; larger objects do not move."""


@dataclass(frozen=True)
class Motion:
    """One of SEQUENCES at a speed."""

    name: str
    """"turn" for an orbit in a closed room."""
    speed: float
    unit: str
    """Of the speed; "" if the sequence has none."""
    play: Sequence

    def __call__(self, frame: int) -> Camera:
        """Plays a frame."""
        return self.play(frame)

    def numbers(self) -> dict[str, Any]:
        """For JSON."""
        return {"sequence": self.name, **({"speed": self.speed, "speed_unit": self.unit} if self.unit else {})}


@dataclass(frozen=True)
class _Kind:
    """One of SEQUENCES."""

    make: Callable[[Scene, Camera, float], Sequence]
    """Takes the speed."""
    unit: str = ""
    """Of its speed; "" if it has none."""
    speed: Callable[[Scene, Camera], float] = lambda scene, camera: 0.0
    """The default."""
    fastest: float = 1000.0


def sequence(
    name: str,
    scene: Scene,
    camera: Camera,
    start: float = 0.0,
    animation: int | str | None = None,
    speed: float | None = None,
) -> Motion:
    """One of SEQUENCES, from the current state of the scene.

    `start` seconds and `animation`: initial time and choice of animations for moving objects, as in Scene.animate.
    `speed`: per frame, in the sequence's unit; None for the default. Raises PicaError for an unknown name, an invalid
    speed, or a scene in which the sequence changes nothing.
    """
    check_sequence(name, speed)
    if name == "orbit" and encloses(scene, camera):  # an orbit would go through walls
        name = "turn"
    kind = SEQUENCES[name]
    speed = kind.speed(scene, camera) if speed is None else speed
    if name == "objects" and scene.animations:
        return Motion(name, speed, kind.unit, _animated(scene, camera, start, animation, speed))
    return Motion(name, speed, kind.unit, kind.make(scene, camera, speed))


def check_sequence(name: str, speed: float | None = None) -> None:
    """Raises PicaError for an unknown name or an invalid speed."""
    if name not in SEQUENCES:
        raise PicaError(f"sequence {name!r} is not one of {', '.join(SEQUENCES)}")
    kind = SEQUENCES[name]
    if speed is None:
        return
    if not kind.unit:
        raise PicaError(f"the sequence {name} has no speed")
    if not 0 < speed <= kind.fastest:
        fault = f"must be above 0 and at most {kind.fastest:g} {kind.unit}"
        raise PicaError(f"speed {speed:g} of the sequence {name}: {fault}")


def _still(scene: Scene, camera: Camera, speed: float) -> Sequence:
    return lambda frame: camera


def _orbit(scene: Scene, camera: Camera, speed: float) -> Sequence:
    """About the vertical axis through the camera's target."""
    center = pivot(scene, camera)
    return lambda frame: orbited(camera, center, math.radians(speed * frame))


def _turn(scene: Scene, camera: Camera, speed: float) -> Sequence:
    """About the vertical axis through the camera."""
    return lambda frame: turned(camera, math.radians(speed * frame))


def _dolly(scene: Scene, camera: Camera, speed: float) -> Sequence:
    return lambda frame: dollied(camera, speed * frame)


def _walking_speed(scene: Scene, camera: Camera) -> float:
    """Slower in small scenes."""
    return min(_WALK, _NEAREST * math.dist(pivot(scene, camera), camera.transform[:3, 3]))


def _animated(scene: Scene, camera: Camera, start: float, animation: int | str | None, step: float) -> Sequence:
    def play(frame: int) -> Camera:
        scene.animate(start + frame * step, animation)
        return camera

    return play


def _objects(scene: Scene, camera: Camera, step: float) -> Sequence:
    """Small objects sway, with different phases."""
    diagonal = _diagonal(scene)
    swaying = [node for node in scene.nodes() if node.mesh is not None and _node_diagonal(node) < _GROUND * diagonal]
    if not swaying:
        raise PicaError("the sequence objects: the scene has neither animations nor objects smaller than half of it")
    return _swing(swaying, diagonal, camera, step)


def _light(scene: Scene, camera: Camera, speed: float) -> Sequence:
    """Every _SWITCH frames the first light switches between dimmed and full strength."""
    dim = _dimmer(scene)

    def play(frame: int) -> Camera:
        dim(_DIMMED if frame // _SWITCH % 2 else 1.0)
        return camera

    return play


def _dimmer(scene: Scene) -> Callable[[float], None]:
    """Scales the first light by a fraction; without lights the first emissive material, without these the environment.
    Raises PicaError in a scene without light."""
    nodes = list(scene.nodes())
    if lamp := next((node for node in nodes if node.light is not None), None):
        light: Any = lamp.light
        strength = next(name for name in ("illuminance", "intensity", "radiance") if hasattr(light, name))
        full = getattr(light, strength)
        return lambda fraction: setattr(lamp, "light", replace(light, **{strength: fraction * full}))
    materials = (section.material for node in nodes if node.mesh is not None for section in node.mesh.sections)
    if emitter := next((material for material in materials if any(material.emission)), None):
        red, green, blue = emitter.emission
        return lambda fraction: setattr(emitter, "emission", (fraction * red, fraction * green, fraction * blue))
    if environment := scene.environment:
        full = environment.strength
        return lambda fraction: setattr(scene, "environment", replace(environment, strength=fraction * full))
    raise PicaError("the sequence light: the scene has no light that could be dimmed")


def _moving_light(scene: Scene, camera: Camera, step: float) -> Sequence:
    """Suns rotate about the vertical axis, lamps sway."""
    from pica.scene.light import DirectionalLight

    shining = [node for node in scene.nodes() if node.light is not None]
    if not shining:
        raise PicaError("the sequence moving_light: the scene has no light that could move")
    suns = [(node, node.world) for node in shining if isinstance(node.light, DirectionalLight)]
    swaying = [node for node in shining if not isinstance(node.light, DirectionalLight)]
    lamps = _swing(swaying, _diagonal(scene), camera, _STEP)

    def play(frame: int) -> Camera:
        for node, world in suns:
            _place(node, rotate("y", _SUN_DEGREES * frame) @ world)
        return lamps(frame)

    return play


def _swing(nodes: list[Node], diagonal: float, camera: Camera, step: float) -> Sequence:
    places = [(node, node.world) for node in nodes]

    def play(frame: int) -> Camera:
        for index, (node, world) in enumerate(places):
            phase = 2 * math.pi * (frame * step / _PERIOD + index * 0.618)
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
    copy = alone.add(Node(mesh=node.mesh))
    copy.instances = node.instances
    copy.transform = node.world
    return _diagonal(alone)


def _always(speed: float) -> Callable[[Scene, Camera], float]:
    return lambda scene, camera: speed


SEQUENCES: dict[str, _Kind] = {
    "still": _Kind(_still),
    "orbit": _Kind(_orbit, "degrees a frame", _always(_DEGREES), 90.0),
    "turn": _Kind(_turn, "degrees a frame", _always(_DEGREES), 90.0),
    "dolly": _Kind(_dolly, "metres a frame", _walking_speed),
    "objects": _Kind(_objects, "seconds a frame", _always(_STEP)),
    "light": _Kind(_light),
    "moving_light": _Kind(_moving_light),
}

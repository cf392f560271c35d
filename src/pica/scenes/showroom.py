"""A car on a turntable in a dark hall, under one giant lamp and moving strips of light.

After what the film "The Speed of Light" (Porsche, NVIDIA and Epic Games, 2018) shows of ray traced area lights: paint
drawn by the reflections of large lamps. Hall and car are pica's own.
"""

import math

import numpy as np

from pica.scene.animation import Animation, Channel
from pica.scene.camera import Camera
from pica.scene.light import Color
from pica.scene.model import Node, Scene
from pica.scene.values import checked, whole
from pica.scenes.basic_meshes import cylinder, lathe
from pica.scenes.car import car, finish
from pica.scenes.lit_panel import lit_panel
from pica.scenes.motion import LOOP, follow, spin
from pica.scenes.palette import plastic
from pica.scenes.placing import aim, mesh, move, place, rotate
from pica.scenes.shots import shot
from pica.scenes.sky import gradient_sky

COOL: Color = (0.86, 0.93, 1.0)
WARM: Color = (1.0, 0.83, 0.66)
TABLE = 0.06
"""Height of the turntable in metres."""

SHOTS = (
    shot(0, 6, (3.9, 0.7, 4.6, 0.3, 0.5, 0.0, 30), (5.0, 1.1, 3.2, 0.2, 0.55, 0.0, 28)),
    shot(21, 3, (2.7, 0.75, 2.5, 1.0, 0.6, 0.5, 36), (1.2, 0.8, 2.7, 0.0, 0.6, 0.5, 36)),
    shot(6, 5, (-4.9, 1.0, 2.6, 0.0, 0.5, 0.0, 32), (-5.0, 1.5, 0.2, 0.0, 0.55, 0.0, 30)),
    shot(13, 6, (0.6, 3.3, 5.8, 0.0, 0.4, 0.0, 34), (3.4, 2.4, 5.0, 0.0, 0.5, 0.0, 32)),
)
"""Of its film."""


def showroom(seed: int = 1) -> Scene:
    """A car of flake paint, in motion: `scene.animate(time % 24)` plays a loop of 24 seconds.

    Rectangle lights and a dark environment light it. `seed`: of the paint's flakes. The animations are called turntable
    and lights. Raises SceneError for a seed below 0.
    """
    rng = np.random.default_rng(checked("showroom: seed", whole(0), seed))
    scene = Scene("showroom", gradient_sky((0.012, 0.015, 0.02), (0.005, 0.006, 0.007), (0.002, 0.002, 0.002)))
    hall = scene.add(Node("hall"))
    floor = lathe([(0, 0), (30, 0)], plastic("polished floor", "#131417", 0.12), segments=64)
    place(hall, "floor", mesh("floor", [floor]))
    table = place(
        hall,
        "turntable",
        mesh(
            "turntable",
            [
                cylinder(2.9, TABLE, plastic("turntable", "#1c1d21", 0.14), 0.01, 96),
            ],
        ),
        move(0, TABLE / 2, 0),
    )
    vehicle = car(finish(rng))
    vehicle.transform = move(0, TABLE / 2, 0)
    table.add(vehicle)
    lit_panel(hall, "ceiling light", (6.4, 3.0), COOL, 5.0, move(0, 4.2, 0) @ rotate("x", -90))
    scene.animations = [Animation(spin(table, (0, 1, 0), 1), "turntable"), Animation(_strips(hall), "lights")]
    camera = Camera.look_at((4.6, 1.5, 4.6), (0, 0.55, 0), vertical_fov=math.radians(28.0), name="three-quarter")
    place(hall, "camera", transform=camera.transform).camera = camera
    scene.animate(0.0)
    return scene


def _strips(hall: Node) -> list[Channel]:
    """Strips of light that sweep to and fro over the car and along its sides."""
    channels = []
    times = np.linspace(0, LOOP, 97)
    for name, size, color, radiance, where, sway, cycles, phase in (
        ("cross strip", (0.22, 3.4), COOL, 50.0, move(0, 2.7, 0) @ rotate("x", -90), (2.6, 0, 0), 3, 0.0),
        ("left strip", (4.4, 0.16), COOL, 45.0, aim((0, 1.5, -3.6), (0, 0.6, 0)), (1.2, 0.5, 0), 2, 0.3),
        ("right strip", (4.4, 0.16), WARM, 30.0, aim((0, 3.0, 3.2), (0, 0.6, 0)), (-1.2, 0.5, 0), 2, 0.6),
        ("far strip", (0.16, 2.2), WARM, 45.0, aim((-4.6, 1.4, 0), (0, 0.6, 0)), (0, 0, 1.8), 3, 0.4),
    ):
        node = lit_panel(hall, name, size, color, radiance, where)
        swing = np.sin(2 * np.pi * (cycles * times / LOOP + phase))[:, None]
        channels += follow(node, times, where[:3, 3] + swing * sway)
    return channels

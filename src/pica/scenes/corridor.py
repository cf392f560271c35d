"""A lift lobby at night: a glossy floor, lit panels, and figures whose curved armour mirrors all of it.

After what the film "Reflections" (Lucasfilm, ILMxLAB and Epic Games, 2018) shows of ray traced reflections: rectangles
of light in curved mirrors. Room and figures are pica's own.
"""

import numpy as np

from pica.scene.animation import Animation, Channel
from pica.scene.camera import Camera
from pica.scene.light import Color
from pica.scene.model import Node, Scene
from pica.scenes.basic_meshes import box, cylinder, pipe, plane, ring
from pica.scenes.figure_motion import stand, walk
from pica.scenes.figures import Armour, figure
from pica.scenes.lane import Lane
from pica.scenes.lit_panel import lit_panel
from pica.scenes.motion import LOOP, follow
from pica.scenes.palette import lamp, metal, plastic
from pica.scenes.placing import at, mesh, move, place, rotate
from pica.scenes.shots import shot

WIDTH, HEIGHT, DEPTH = 5.0, 3.0, 9.0
"""Metres inside, along X, Y and Z; the lift is at the end towards -Z."""
DOOR_WIDTH, DOOR_HEIGHT = 2.0, 2.3
WALL = 0.2
"""Metres from the end wall's face to the door's leaves."""
CABIN = 1.5
"""Metres from the leaves to the lift's back."""
LANE = Lane(center=(0.0, -0.7), straight=(0.25, 1.3), radius=0.75)
"""What the officer walks."""
OPENS, MOVES, STAYS = 4.0, 2.0, 7.0
"""Seconds: when the lift opens, how long its leaves move, how long they stay open."""
COOL: Color = (0.86, 0.94, 1.0)
WARM: Color = (1.0, 0.80, 0.58)

SHOTS = (
    shot(0, 6, (1.3, 1.55, 3.9, -0.1, 1.1, -1.2, 42), (0.7, 1.45, 2.6, -0.1, 1.1, -1.2, 42)),
    shot(4, 5, (-1.9, 1.4, 1.8, 0.0, 1.2, -4.5, 50), (-1.9, 1.5, 0.8, 0.0, 1.2, -4.5, 50)),
    shot(10, 4, (-0.3, 1.5, 2.2, -1.6, 1.25, -0.9, 30), (-0.7, 1.45, 1.9, -1.6, 1.3, -0.9, 30)),
    shot(14, 6, (2.0, 0.4, 3.0, -0.2, 0.9, -2.0, 50), (1.9, 0.6, 1.2, -0.2, 1.0, -2.0, 50)),
)
"""Of its film."""


def corridor() -> Scene:
    """A closed room of 5 x 3 x 9 metres in motion: `scene.animate(time % 24)` plays its loop of 24 seconds.

    Rectangle lights alone light it, but for a few small lamps. The camera sees them as plates; other rays do not meet
    the plates, as the lights shine already. The animations are called figures and lift.
    """
    scene = Scene("corridor")
    room = scene.add(Node("lobby"))
    _shell(room)
    _panels(room)
    _lights(room)
    leaves = _lift(room)
    figures = _figures(room)
    scene.animations = [Animation(figures, "figures"), Animation(_opening(leaves), "lift")]
    camera = Camera.look_at((1.0, 1.5, 3.2), (-0.1, 1.05, -1.2), vertical_fov=np.radians(42.0), name="lobby")
    place(room, "camera", transform=camera.transform).camera = camera
    scene.animate(0.0)
    return scene


def _shell(room: Node) -> None:
    """Floor, ceiling and walls; the end wall has an opening for the lift."""
    floor = plastic("polished floor", "#2b2e33", 0.25)
    wall, ceiling = plastic("wall", "#6b7076", 0.5), plastic("ceiling", "#8d9196", 0.6)
    end = -DEPTH / 2
    place(room, "floor", mesh("floor", [plane(WIDTH, DEPTH, floor)]))
    place(room, "ceiling", mesh("ceiling", [plane(WIDTH, DEPTH, ceiling)]), move(0, HEIGHT, 0) @ rotate("x", 180))
    for name, side in (("left wall", -1), ("right wall", 1)):
        place(
            room,
            name,
            mesh(name, [plane(HEIGHT, DEPTH, wall)]),
            move(side * WIDTH / 2, HEIGHT / 2, 0) @ rotate("z", side * 90),
        )
    place(
        room, "near wall", mesh("near wall", [plane(WIDTH, HEIGHT, wall)]), move(0, HEIGHT / 2, -end) @ rotate("x", -90)
    )
    pier = (WIDTH - DOOR_WIDTH) / 2
    parts = [
        at(box((pier, HEIGHT, WALL), wall), move(side * (WIDTH - pier) / 2, HEIGHT / 2, end - WALL / 2))
        for side in (-1, 1)
    ]
    parts.append(
        at(box((DOOR_WIDTH, HEIGHT - DOOR_HEIGHT, WALL), wall), move(0, (HEIGHT + DOOR_HEIGHT) / 2, end - WALL / 2))
    )
    place(room, "end wall", mesh("end wall", parts))


def _panels(room: Node) -> None:
    """Semi-gloss panels along the side walls with a rail before them, a skirting, and a frame round the lift."""
    light, dark = plastic("light panel", "#8f969c", 0.28), plastic("dark panel", "#43484f", 0.22)
    steel = metal("rail", "#c9ccd0", 0.16)
    tall = mesh("panel", [
        at(box((0.06, 1.55, 1.18), light, 0.025, 4), move(0, 1.95, 0)),
        at(box((0.08, 0.85, 1.18), dark, 0.025, 4), move(0, 0.68, 0)),
    ])  # fmt: skip
    for side in (-1, 1):
        for i, z in enumerate((-3.75, -2.25, -0.75, 0.75, 2.25, 3.75)):
            place(room, f"panel {side} {i}", tall, move(side * (WIDTH / 2 - 0.02), 0, z))
        x = side * (WIDTH / 2 - 0.12)
        rail = [pipe([(x, 1.0, -DEPTH / 2 + 0.4), (x, 1.0, DEPTH / 2 - 0.4)], 0.028, steel, 24)]
        stubs = [
            at(cylinder(0.014, 0.1, steel), move(x + side * 0.05, 1.0, z), rotate("z", 90))
            for z in (-3.6, -1.2, 1.2, 3.6)
        ]
        place(room, f"rail {side}", mesh("rail", [*rail, *stubs]))
        skirting = at(box((0.05, 0.16, DEPTH), dark, 0.015), move(side * (WIDTH / 2 - 0.025), 0.08, 0))
        place(room, f"skirting {side}", mesh("skirting", [skirting]))
    z = -DEPTH / 2 + 0.02
    half = DOOR_WIDTH / 2 + 0.06
    frame = [
        at(box((0.16, DOOR_HEIGHT + 0.14, 0.1), steel, 0.03, 4), move(x, (DOOR_HEIGHT + 0.14) / 2, z))
        for x in (-half, half)
    ]
    frame.append(at(box((2 * half + 0.16, 0.16, 0.1), steel, 0.03, 4), move(0, DOOR_HEIGHT + 0.08, z)))
    frame += [at(ring(0.035, 0.05, 0.02, steel, 0.006), move(1.3, 1.2, z), rotate("x", 90))]
    place(room, "door frame", mesh("door frame", frame))
    signals = [
        at(box((0.5, 0.05, 0.03), lamp("floor sign", "#ff5a36", 9.0), 0.012), move(0, DOOR_HEIGHT + 0.3, z)),
        at(cylinder(0.032, 0.02, lamp("call button", "#6fe3ff", 6.0), 0.008), move(1.3, 1.2, z), rotate("x", 90)),
    ]
    place(room, "signals", mesh("signals", signals))


def _lights(room: Node) -> None:
    for i, z in enumerate((-3.0, 0.0, 3.0)):
        down = move(0, HEIGHT - 0.05, z) @ rotate("x", -90)
        lit_panel(room, f"ceiling light {i}", (1.7, 0.6), COOL, 7.0, down)
    for name, side in (("left", -1), ("right", 1)):
        for i, z in enumerate((-1.5, 1.5)):
            inwards = move(side * (WIDTH / 2 - 0.05), 1.6, z) @ rotate("y", side * 90)
            lit_panel(room, f"{name} light {i}", (0.22, 2.0), COOL, 6.0, inwards)
    for side in (-1, 1):
        back = move(side * 1.5, 1.6, DEPTH / 2 - 0.05)
        lit_panel(room, f"near light {side}", (0.5, 1.9), WARM, 4.0, back)
    lit_panel(
        room,
        "lift light",
        (1.2, 0.9),
        WARM,
        9.0,
        move(0, DOOR_HEIGHT + 0.05, -DEPTH / 2 - WALL - 0.85) @ rotate("x", -90),
    )


def _lift(room: Node) -> list[Node]:
    """The lift behind the end wall; its door's two leaves."""
    lining, floor = plastic("lift lining", "#8c7a66", 0.3), plastic("lift floor", "#3a3632", 0.3)
    door = metal("door leaf", "#a9adb3", 0.2)
    near = -DEPTH / 2 - WALL
    middle, far, top = near - CABIN / 2, near - CABIN, DOOR_HEIGHT + 0.1
    width = 2 * DOOR_WIDTH + 0.2  # the leaves go aside within it
    parts = [
        at(plane(width, CABIN + WALL, floor), move(0, 0.0005, middle + WALL / 2)),
        at(plane(width, CABIN, lining), move(0, top, middle), rotate("x", 180)),
        at(plane(width, top, lining), move(0, top / 2, far), rotate("x", 90)),
        *[
            at(plane(top, CABIN, lining), move(side * width / 2, top / 2, middle), rotate("z", side * 90))
            for side in (-1, 1)
        ],
        *[
            at(box((0.06, top, CABIN - 0.2), lining, 0.02), move(side * 1.15, top / 2, middle - 0.1))
            for side in (-1, 1)
        ],
        at(cylinder(0.022, 2.2, metal("lift rail", "#d8b98a", 0.12)), move(0, 1.0, far + 0.08), rotate("z", 90)),
    ]
    place(room, "lift", mesh("lift", parts))
    height = DOOR_HEIGHT + 0.04
    leaf = mesh("door leaf", [
        at(box((DOOR_WIDTH / 2 - 0.004, height, 0.05), door, 0.012), move(0, height / 2 + 0.006, 0)),
        at(box((0.5, 1.1, 0.02), plastic("door inset", "#2a2d31", 0.15), 0.008), move(0, 1.35, 0.025)),
    ])  # fmt: skip
    return [
        place(room, f"{name} leaf", leaf, move(side * DOOR_WIDTH / 4, 0, near - 0.03))
        for name, side in (("left", -1), ("right", 1))
    ]


def _opening(leaves: list[Node]) -> list[Channel]:
    share = np.linspace(0, 1, 13)
    smooth = share * share * (3 - 2 * share)
    shuts = OPENS + MOVES + STAYS
    times = np.concatenate([[0], OPENS + MOVES * share, shuts + MOVES * share, [LOOP]])
    gone = np.concatenate([[0], smooth, 1 - smooth, [0]])[:, None] * 0.96 * DOOR_WIDTH / 2
    channels = []
    for leaf in leaves:
        place_shut = leaf.transform[:3, 3]
        channels += follow(leaf, times, place_shut + gone * (np.sign(place_shut[0]), 0, 0))
    return channels


def _figures(room: Node) -> list[Channel]:
    """An officer in mirrors who walks, two guards who stand."""
    suit, visor = plastic("suit", "#17181b", 0.45), plastic("visor", "#0b0d10", 0.05)
    white, steel = plastic("white armour", "#eceae4", 0.12), metal("steel trim", "#c9ccd0", 0.15)
    bronze = metal("bronze armour", "#d9a36b", 0.08)
    glow = lamp("badge", "#6fe3ff", 6.0)
    officer = figure("officer", Armour(metal("mirror armour", "#e9ebee", 0.02), steel, suit, visor, glow), crest=True)
    room.add(officer)
    channels = walk(officer, LANE)
    for name, armour, where, phase in (
        ("white guard", Armour(white, steel, suit, visor, glow), move(-1.7, 0, -0.9) @ rotate("y", 42), 0.0),
        ("bronze guard", Armour(bronze, white, suit, visor, glow), move(1.65, 0, -2.1) @ rotate("y", -24), 0.4),
    ):
        guard = figure(name, armour)
        guard.transform = where
        room.add(guard)
        channels += stand(guard, phase)
    return channels

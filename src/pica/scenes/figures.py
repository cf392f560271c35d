"""Human figures in curved armour, as mirrors. Each stands on y = 0, looks along +Z and is 1.87 metres tall.

Moving parts are nodes with their pivots: torso, head, arms and forearms, thighs and shins; the
boots are children of the figure itself, because they stay level.
"""

from dataclasses import dataclass

from pica.scene.material import Material
from pica.scene.model import Node, Section
from pica.scenes.basic_meshes import box, cylinder, frustum, lathe, sphere, torus
from pica.scenes.placing import at, mesh, move, place, rotate, stretch

HIP, HIP_APART = 0.93, 0.1
"""Metres: height of the thighs' pivots, and their distance from the middle."""
THIGH, SHIN = 0.42, 0.41
"""Metres from hip to knee and from knee to ankle."""
ANKLE = 0.1
"""Metres from the sole to the ankle."""
SIDES = (("left", 1), ("right", -1))
"""A figure's sides and which way along X they are."""


@dataclass(frozen=True)
class Armour:
    """Materials of a figure."""

    shell: Material
    trim: Material
    suit: Material
    """Visible between the shells."""
    visor: Material
    glow: Material


def figure(name: str, armour: Armour, crest: bool = False) -> Node:
    """A figure with all joints straight; a `crest` along the helmet marks an officer."""
    body = Node(name)
    hips = [
        at(sphere(0.17, armour.suit), stretch(1.0, 0.8, 0.75)),
        at(torus(0.165, 0.032, armour.trim, 48), move(0, 0.09, 0), stretch(1, 1, 0.78)),
        at(box((0.09, 0.07, 0.03), armour.trim, 0.014), move(0, 0.09, 0.145)),
        at(sphere(0.1, armour.shell), move(0, -0.02, 0.075), stretch(1, 1.1, 0.6)),
    ]
    place(body, "hips", mesh(f"{name} hips", hips), move(0, HIP + 0.05, 0))
    torso = place(body, "torso", mesh(f"{name} torso", _torso(armour)), move(0, HIP + 0.14, 0))
    place(torso, "head", mesh(f"{name} head", _head(armour, crest)), move(0, 0.51, 0.005))
    for side, x in SIDES:
        upper = [
            at(sphere(0.112, armour.shell), move(x * 0.02, -0.02, 0), stretch(1, 0.9, 1)),
            at(torus(0.085, 0.014, armour.trim), move(x * 0.02, -0.085, 0)),
            at(frustum(0.05, 0.068, 0.25, armour.shell, 0.02), move(x * 0.02, -0.17, 0)),
            at(sphere(0.055, armour.suit, 24), move(x * 0.02, -0.3, 0)),
        ]
        arm = place(torso, f"{side} arm", mesh(f"{name} {side} arm", upper), move(x * 0.235, 0.37, 0))
        lower = [
            at(frustum(0.045, 0.066, 0.22, armour.shell, 0.025), move(0, -0.15, 0)),
            at(torus(0.045, 0.012, armour.trim, 24), move(0, -0.255, 0)),
            at(sphere(0.052, armour.suit, 24), move(0, -0.315, 0.008), stretch(0.8, 1.35, 1.05)),
        ]
        forearm = move(x * 0.02, -0.3, 0) @ rotate("x", -18)
        place(arm, f"{side} forearm", mesh(f"{name} {side} forearm", lower), forearm)
        _leg(body, name, armour, side, x)
    return body


def _torso(armour: Armour) -> list[Section]:
    chest = lathe(
        [(0, 0.46), (0.13, 0.46), (0.205, 0.33), (0.185, 0.16), (0.13, 0.06), (0, 0.06)], armour.shell, 0.09, 64
    )
    return [
        at(chest, stretch(1, 1, 0.72)),
        at(cylinder(0.128, 0.2, armour.suit, 0.03), move(0, 0.02, 0), stretch(1, 1, 0.76)),
        at(torus(0.09, 0.028, armour.trim, 48), move(0, 0.455, 0)),
        at(cylinder(0.06, 0.12, armour.suit, 0.01, 24), move(0, 0.48, 0)),
        at(box((0.27, 0.28, 0.12), armour.shell, 0.05, 6), move(0, 0.28, -0.15)),
        at(cylinder(0.026, 0.02, armour.glow, 0.008, 24), move(0.075, 0.335, 0.138), rotate("x", 76)),
    ]


def _head(armour: Armour, crest: bool) -> list[Section]:
    """A smooth egg of a helmet with one wide dark pane."""
    egg = lathe([(0, 0.29), (0.125, 0.29), (0.14, 0.13), (0.1, -0.01), (0, -0.01)], armour.shell, 0.12, 64)
    parts = [
        at(egg, stretch(0.9, 1, 1.05)),
        at(sphere(0.118, armour.visor, 48), move(0, 0.135, 0.05), stretch(0.93, 0.5, 0.93)),
        at(torus(0.098, 0.013, armour.trim, 48), stretch(0.9, 1, 1.05)),
    ]
    parts += [
        at(cylinder(0.042, 0.03, armour.trim, 0.012), move(x * 0.122, 0.12, -0.01), rotate("z", 90)) for _, x in SIDES
    ]
    if crest:
        parts.append(at(cylinder(0.15, 0.022, armour.trim, 0.01, 48), move(0, 0.15, -0.02), rotate("z", 90)))
    return parts


def _leg(body: Node, name: str, armour: Armour, side: str, x: int) -> None:
    upper = [
        sphere(0.085, armour.suit, 24),
        at(frustum(0.064, 0.092, 0.33, armour.shell, 0.03), move(0, -0.2, 0)),
        at(sphere(0.062, armour.suit, 24), move(0, -THIGH, 0)),
    ]
    thigh = place(body, f"{side} thigh", mesh(f"{name} {side} thigh", upper), move(x * HIP_APART, HIP, 0))
    lower = [
        at(sphere(0.066, armour.shell), move(0, -0.005, 0.022), stretch(0.95, 1.1, 0.85)),
        at(frustum(0.05, 0.075, 0.32, armour.shell, 0.03), move(0, -0.2, 0)),
        at(torus(0.05, 0.014, armour.trim, 32), move(0, -0.355, 0)),
        at(sphere(0.052, armour.suit, 24), move(0, -SHIN, 0)),
    ]
    place(thigh, f"{side} shin", mesh(f"{name} {side} shin", lower), move(0, -THIGH, 0))
    boot = [
        at(box((0.105, 0.085, 0.27), armour.shell, 0.04, 6), move(0, 0.0525 - ANKLE, 0.045)),
        at(box((0.112, 0.02, 0.28), armour.suit, 0.009), move(0, 0.011 - ANKLE, 0.045)),
    ]
    place(body, f"{side} boot", mesh(f"{name} {side} boot", boot), move(x * HIP_APART, ANKLE, 0))

"""Spheres from mirror to matt, evenly in squared roughness, under coloured boards that a reflection shows well."""

import numpy as np

from pica.scene.camera import Camera
from pica.scene.material import Material
from pica.scene.model import Mesh, Node, Scene
from pica.scenes.basic_meshes import box, sphere
from pica.scenes.palette import clay, lamp, metal, plastic
from pica.scenes.placing import at, mesh, move, place, rotate
from pica.scenes.sky import gradient_sky

STEPS = 9
"""Spheres in a row."""


def sphere_sweep() -> Scene:
    """GGX's alpha, roughness squared, grows from 0 on the left to 1 on the right in 9 steps.

    The back row is of metal, the front row of a dark dielectric. The spheres have a radius of 0.4 metres and stand 1
    metre apart; boards of four colours shine from three sides.
    """
    dim = (0.10, 0.11, 0.13)
    scene = Scene("sphere_sweep", gradient_sky(zenith=dim, horizon=(0.16, 0.16, 0.16), nadir=(0.05, 0.05, 0.05)))
    root = scene.add(Node("sphere sweep"))
    floor = [at(box((14, 0.2, 8), clay("floor", "#8a8d91"), 0.05), move(0, -0.1, 0))]
    tile = clay("tile", "#c8c2b4")
    floor += [at(box((0.96, 0.02, 0.9), tile, 0.008), move(x, 0.0, z)) for x in range(-6, 7) for z in (-1.55, 1.55)]
    place(root, "floor", mesh("floor", floor))
    for row, (kind, z) in enumerate((("metal", -0.55), ("dielectric", 0.55))):
        for column, alpha in enumerate(np.linspace(0, 1, STEPS)):
            ball = sphere(0.4, _material(kind, float(alpha)), segments=64)
            place(
                root, f"sphere {row},{column}", Mesh([ball], ball.material.name), move(column - (STEPS - 1) / 2, 0.4, z)
            )
    _boards(root)
    camera = Camera.look_at((0, 4.2, 8.2), (0, 0.4, 0), vertical_fov=np.radians(35.0), name="front")
    place(root, "camera", transform=camera.transform).camera = camera
    return scene


def _material(kind: str, alpha: float) -> Material:
    name = f"{kind}, alpha {alpha:.3f}"
    make, code = (metal, "#f2c9a0") if kind == "metal" else (plastic, "#1c2a3c")
    return make(name, code, alpha**0.5)


def _boards(root: Node) -> None:
    for name, code, radiance, size, where in (
        ("white board", "#ffffff", 6.0, (3.0, 1.2, 0.05), move(0, 4.6, 3.2) @ rotate("x", 55)),
        ("red board", "#ff4a30", 7.0, (1.2, 2.2, 0.05), move(-6.2, 1.6, 0.8) @ rotate("y", 75)),
        ("blue board", "#3f78ff", 9.0, (1.2, 2.2, 0.05), move(6.2, 1.6, 0.8) @ rotate("y", -75)),
        ("green board", "#4dff7a", 3.0, (0.5, 1.4, 0.05), move(-2.6, 0.9, -2.8)),
        ("yellow board", "#ffc44d", 4.0, (2.4, 0.4, 0.05), move(2.2, 1.2, -2.8)),
    ):
        place(root, name, mesh(name, [box(size, lamp(name, code, radiance), 0.02)]), where)

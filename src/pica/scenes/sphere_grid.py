"""Spheres over roughness and metalness, to see what a material model does."""

import numpy as np

from pica.scene.camera import Camera
from pica.scene.light import RectangleLight
from pica.scene.material import Material
from pica.scene.model import Mesh, Node, Scene
from pica.scene.values import checked, whole
from pica.scenes.basic_meshes import plane, sphere
from pica.scenes.placing import aim, mesh, move, place
from pica.scenes.sky import Window, gradient_sky

_MOST = 100


def sphere_grid(columns: int = 7, rows: int = 3) -> Scene:
    """Roughness grows from 0.05 on the left to 1 on the right, metalness from 0 in front to 1 at the back.

    The spheres have a radius of 0.4 metres and stand about 1 metre apart on a matt floor in a studio. Raises SceneError
    for what is no number of columns and rows from 1 to 100.
    """
    columns = checked("sphere_grid: columns", whole(1, _MOST), columns)
    rows = checked("sphere_grid: rows", whole(1, _MOST), rows)
    studio = gradient_sky(
        zenith=(0.55, 0.58, 0.62),
        horizon=(0.42, 0.41, 0.40),
        nadir=(0.12, 0.11, 0.10),
        windows=[Window(azimuth=150, elevation=45, width=70, height=40, radiance=(7.0, 6.6, 6.0))],
        name="studio",
    )
    scene = Scene("sphere_grid", studio)
    root = scene.add(Node("sphere grid"))
    floor = Material("floor", base_color=(0.30, 0.32, 0.36, 1.0), metallic=0.0, roughness=0.9)
    place(root, "floor", mesh("floor", [plane(30, 30, floor)]))

    for row, metallic in enumerate(np.linspace(0, 1, rows)):
        for column, roughness in enumerate(np.linspace(0.05, 1, columns)):
            material = Material(
                f"roughness {roughness:.2f}, metallic {metallic:.2f}",
                base_color=(0.86, 0.30, 0.16, 1.0),
                metallic=float(metallic),
                roughness=float(roughness),
            )
            ball = sphere(0.4, material, segments=64)
            place(
                root,
                f"sphere {row},{column}",
                Mesh([ball], material.name),
                move(column - (columns - 1) / 2, 0.4, 1.15 * ((rows - 1) / 2 - row)),
            )

    soft_light = RectangleLight(color=(1.0, 0.94, 0.86), radiance=16.0, width=2.0, height=2.0, name="soft light")
    place(root, "soft light", soft_light, aim((3.0, 5.0, 3.5), (0.0, 0.4, 0.0)))
    distance = max(columns, 1.8 * rows)
    camera = Camera.look_at(
        (0, 0.76 * distance, 0.9 * distance), (0, 0.3, 0), vertical_fov=np.radians(34.0), name="front"
    )
    place(root, "camera", transform=camera.transform).camera = camera
    return scene

"""Lamps of the halls: rectangle lights that can be seen."""

from pica.scene.light import Color, RectangleLight
from pica.scene.material import Material
from pica.scene.model import Node
from pica.scenes.basic_meshes import box, plane
from pica.scenes.palette import plastic
from pica.scenes.placing import Matrix, mesh, move, place, rotate


def lit_panel(
    parent: Node, name: str, size: tuple[float, float], color: Color, radiance: float, transform: Matrix
) -> Node:
    """A rectangle light in a dark frame, with a plate that shows the camera where it is."""
    width, height = size
    light = RectangleLight(color=color, radiance=radiance, width=width, height=height, name=name)
    node = place(parent, name, light, transform)
    shine = Material(f"{name} plate", base_color=(0.0, 0.0, 0.0, 1.0), metallic=0.0, roughness=1.0, specular=0.0)
    shine.emission = (color[0] * radiance, color[1] * radiance, color[2] * radiance)
    plate = place(
        node, f"{name} plate", mesh("plate", [plane(width, height, shine)]), move(0, 0, 0.001) @ rotate("x", -90)
    )
    plate.visible_to_reflections = plate.casts_shadows = False
    frame = box((width + 0.08, height + 0.08, 0.04), plastic("lamp frame", "#26292e", 0.35), 0.015)
    place(node, f"{name} frame", mesh("lamp frame", [frame]), move(0, 0, 0.023))
    return node

"""Primitives that are not triangles, their signed distances in NumPy, and the same shapes as fine triangle meshes."""

import numpy as np

from pica.scene.light import DirectionalLight
from pica.scene.material import Material
from pica.scene.model import Mesh, Node, Scene
from pica.scene.primitives import Primitives, capsules, rounded_boxes, spheres, tori
from pica.scenes.basic_meshes import box, cylinder, plane, sphere, torus
from pica.scenes.placing import aim, move
from tests.building import lambert, placed, scene_of, shining, sky

BALL, RADIUS = np.array([-0.9, 0.5, 0.1]), 0.5
STICK, LENGTH, THICK = np.array([0.25, 0.55, 0.5]), 0.5, 0.22
RING, WIDE, TUBE = np.array([1.2, 0.3, -0.3]), 0.5, 0.2
CASE, SIZE, BEVEL = np.array([-0.05, 0.4, -0.8]), np.array([0.9, 0.7, 0.5]), 0.12


def all_four(material=lambda *color: lambert(*color)) -> list[Primitives]:
    half = [0, LENGTH / 2, 0]
    return [
        spheres([BALL], RADIUS, material(0.8, 0.3, 0.2)),
        capsules([STICK - half], [STICK + half], THICK, material(0.2, 0.7, 0.2)),
        tori([RING], WIDE, TUBE, material(0.2, 0.3, 0.8)),
        rounded_boxes([CASE], [SIZE], BEVEL, material(0.7, 0.6, 0.1)),
    ]


def meshes(material=lambda *color: lambert(*color), segments: int = 256) -> list[Node]:
    return [
        placed(sphere(RADIUS, material(0.8, 0.3, 0.2), segments), move(*BALL)),
        placed(cylinder(THICK, LENGTH + 2 * THICK, material(0.2, 0.7, 0.2), THICK, segments), move(*STICK)),
        placed(torus(WIDE, TUBE, material(0.2, 0.3, 0.8), segments), move(*RING)),
        placed(box(SIZE, material(0.7, 0.6, 0.1), BEVEL, 32), move(*CASE)),
    ]


def distance_to_all(points: np.ndarray) -> np.ndarray:
    """(n,) metres from (n, 3) points to the nearest of the four, negative inside."""
    ball = np.linalg.norm(points - BALL, axis=-1) - RADIUS
    local = points - STICK
    local = np.stack([local[:, 0], local[:, 1] - np.clip(local[:, 1], -LENGTH / 2, LENGTH / 2), local[:, 2]], -1)
    stick = np.linalg.norm(local, axis=-1) - THICK
    local = points - RING
    ring = np.hypot(np.hypot(local[:, 0], local[:, 2]) - WIDE, local[:, 1]) - TUBE
    beyond = np.abs(points - CASE) - (SIZE / 2 - BEVEL)
    case = np.linalg.norm(np.maximum(beyond, 0), axis=-1) + np.minimum(beyond.max(-1), 0) - BEVEL
    return np.min([ball, stick, ring, case], axis=0)


def first_crossings(origins: np.ndarray, directions: np.ndarray, farthest: float = 9.0) -> np.ndarray:
    """(n,) distances at which rays first pass through a surface, from float64 sphere tracing; infinite: they do not."""
    origins, directions = np.float64(origins), np.float64(directions)
    along = np.zeros(len(origins))
    side = np.sign(distance_to_all(origins))
    for _ in range(400):
        along += side * distance_to_all(origins + along[:, None] * directions)
    near = np.abs(distance_to_all(origins + along[:, None] * directions)) < 1e-6
    return np.where(near & (along < farthest), along, np.inf)


def primitives_node(primitives: list[Primitives] | None = None, transform=None, name: str = "primitives") -> Node:
    node = Node(name, mesh=Mesh(primitives=all_four() if primitives is None else primitives))
    node.transform = np.eye(4) if transform is None else transform
    return node


def lit(*nodes: Node) -> Scene:
    sun = shining(DirectionalLight(illuminance=2.0, angular_diameter=0.1), aim((1, 2, 1.5), (0, 0, 0)))
    return scene_of(placed(plane(6, 6, lambert(0.6)), name="floor"), *nodes, sun, environment=sky())


def textured(texture, normal_texture=None):
    def make(*color: float) -> Material:
        return lambert(*color, base_color_texture=texture, normal_texture=normal_texture)

    return make

"""What the golden pictures show, beside the scenes that come with pica: all made in code, the same in every run."""

import math

import numpy as np

import pica
from pica.scene.camera import Camera
from pica.scene.light import DirectionalLight, PointLight, RectangleLight, SphereLight
from pica.scene.material import Material
from pica.scene.model import Mesh, Node, Scene
from pica.scene.skin import Skin
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import aim, move, rotate
from tests.building import lambert, placed, scene_of, shining, uniform

VIEW = Camera.look_at((0.4, 1.7, 3.6), (0.1, 0.4, 0), vertical_fov=math.radians(40))


def opaque_world() -> Scene:
    """The world of machines without what lets light through."""
    return pica.scenes.machine_world(glass=False)


def things(*more: Node, environment: pica.Environment | None = None) -> Scene:
    """A ball of metal, a plastic box and a matte column before a wall, and `more`."""
    metal = Material("metal", base_color=(0.9, 0.6, 0.3, 1), metallic=1.0, roughness=0.35)
    plastic = Material("plastic", base_color=(0.2, 0.4, 0.8, 1), metallic=0.0, roughness=0.5)
    return scene_of(
        placed(plane(6, 6, lambert(0.6, 0.55, 0.5)), name="floor"),
        placed(plane(6, 3, lambert(0.5, 0.55, 0.6)), move(0, 1.5, -1.5) @ rotate("x", 90), "wall"),
        placed(sphere(0.45, metal), move(-0.8, 0.45, 0.1), "ball"),
        placed(box(0.6, plastic), move(0.8, 0.3, 0.2) @ rotate("y", 30), "box"),
        placed(box((0.15, 1.2, 0.15), lambert(0.7, 0.3, 0.25)), move(0.1, 0.6, -0.5), "column"),
        *more,
        environment=environment,
    )


def sun(diameter: float = 0.05) -> Node:
    return shining(DirectionalLight(illuminance=2.5, angular_diameter=diameter), aim((1.2, 2, 1), (0, 0, 0)))


def lamps() -> list[Node]:
    """A rectangle and a sphere."""
    window = RectangleLight(color=(1.0, 0.9, 0.8), radiance=12.0, width=1.0, height=0.6)
    bulb = SphereLight(color=(0.6, 0.8, 1.0), radiance=15.0, radius=0.25)
    return [shining(window, aim((1.6, 2.2, 1.3), (0, 0.3, 0))), shining(bulb, move(-1.7, 1.8, 0.5))]


def under_lamps() -> Scene:
    return things(*lamps())


def under_a_sky() -> Scene:
    """A sun, and surroundings that have no shadows of their own once they are prefiltered."""
    return things(sun(), environment=uniform(0.5, 0.6, 0.8))


def coloured_glass() -> Scene:
    """Two panes and a solid ball of glass that colour the light of a sun and of a lamp."""

    def glass(*color: float, **more: bool) -> Material:
        return Material(base_color=(*color, 1.0), metallic=0.0, roughness=0.0, transmission=1.0, **more)

    return things(
        placed(plane(0.8, 0.8, glass(0.9, 0.3, 0.2)), move(-0.2, 0.9, 0.5) @ rotate("z", 20)),
        placed(plane(0.8, 0.8, glass(0.2, 0.8, 0.4)), move(0.4, 1.1, 0.3) @ rotate("x", -25)),
        placed(sphere(0.25, glass(0.9, 0.8, 0.3, thin_walled=False)), move(0.2, 0.25, 0.9)),
        sun(),
        lamps()[1],
    )


def crowded_light() -> Scene:
    """Two dozen points of light and a glowing quad: more than have shadow rays of their own."""
    random = np.random.default_rng(3)
    places = random.uniform((-1.5, 1.3, -1.2), (1.5, 2.2, 1.5), (24, 3))
    colors = random.uniform(0.3, 1, (24, 3))
    points = [
        shining(PointLight(tuple(map(float, color)), 0.35), move(*place))
        for color, place in zip(colors, places, strict=True)
    ]
    glow = lambert(0.5, emission=(12.0, 9.0, 6.0))
    return things(*points, placed(plane(0.5, 0.3, glow), move(0.2, 1.6, 0.3) @ rotate("x", 170)))


def bent(time: float = 0.4) -> Scene:
    """A skinned bar, a mesh of two shapes and a ball, as they are after `time` seconds of `swing`."""
    shaft = box((0.3, 1.6, 0.3), lambert(0.3, 0.6, 0.3), 0.03, 8)
    upper = np.clip(shaft.positions[:, 1] / 1.6 + 0.5, 0, 1).astype(np.float32)
    shaft.joints = np.broadcast_to(np.uint16([0, 1]), (len(upper), 2)).copy()
    shaft.weights = np.stack([1 - upper, upper], 1)
    root = Node("root")
    root.transform = move(-0.1, 0.8, 0.7)
    low, high = root.add(Node("low")), Node("high")
    low.add(high)
    bar = root.add(Node("bar", mesh=Mesh([shaft])))
    bar.skin = Skin([low, high], np.stack([np.eye(4)] * 2))

    pear = sphere(0.3, lambert(0.8, 0.7, 0.2))
    pear.morph_positions = (pear.positions * (0.6, 0.9, 0.6) * (pear.positions[:, 1:2] > 0))[None].astype(np.float32)
    scene = things(root, placed(pear, move(0.2, 0.3, 1.1), "pear"), sun(), lamps()[1])
    scene.add(Node("camera", camera=VIEW))
    swing(scene, time)
    return scene


def swing(scene: Scene, time: float) -> None:
    """Put all that moves in `bent`, its camera too, where it is at `time` seconds."""
    nodes = {node.name: node for node in scene.nodes()}
    wave = math.sin(2 * time)
    nodes["high"].transform = move(0.35 * wave, 0, 0) @ rotate("z", -25 * wave)
    nodes["pear"].weights = [0.5 - 0.5 * math.cos(3 * time)]
    nodes["ball"].transform = move(-0.8 + 0.3 * wave, 0.45, 0.1)
    nodes["camera"].transform = move(0.1 * wave, 0, 0) @ VIEW.transform


def landscape() -> Scene:
    """The hills of `pica landscape`, with sprites and streamers in the air, seen towards the dragon and the fire."""
    scene = pica.scenes.landscape(plants=300)
    scene.animate(1.5)
    return scene

"""A toy diorama after the PICA PICA experiment: belts, little machines and robots on a slab in a soft studio."""

import math

import numpy as np

from pica.errors import SceneError
from pica.scene.animation import Animation
from pica.scene.camera import Camera
from pica.scene.environment import Environment
from pica.scene.light import DirectionalLight, RectangleLight
from pica.scene.model import Node, Scene
from pica.scene.values import checked, flag, whole
from pica.scenes.basic_meshes import lathe, plate
from pica.scenes.factory import LANE, MACHINES, PLOT, ROBOTS, Factory, Kit
from pica.scenes.palette import Palette
from pica.scenes.placing import aim, at, mesh, move, place
from pica.scenes.shots import shot
from pica.scenes.sky import Window, gradient_sky

MOST_MACHINES, MOST_ROBOTS = 28, 42

SHOTS = (
    shot(0, 6, (-7.0, 3.0, 8.0, 0.0, 0.2, 0.2, 34), (-3.4, 4.4, 9.2, 0.0, 0.3, 0.0, 34)),
    shot(6, 5, (-3.6, 2.1, 1.3, -2.4, 0.7, -0.8, 40), (0.3, 1.9, 1.2, 1.0, 0.6, -0.8, 40)),
    shot(12, 5, (5.2, 1.0, 3.9, 1.6, 0.5, 0.8, 36), (3.9, 1.5, 4.6, 0.6, 0.5, 0.6, 36)),
    shot(17, 6, (5.4, 3.4, 5.2, 0.2, 0.7, 0.2, 34), (2.4, 4.2, 7.6, 0.0, 0.5, 0.2, 34)),
)
"""Of its film."""


def machine_world(seed: int = 1, machines: int = 4, robots: int = 5, glass: bool = True) -> Scene:
    """Factories for fruit, in motion: `scene.animate(time % 24)` plays their loop of 24 seconds.

    The same seed gives the same world. `machines`, 0 to 28, is how many stand free; `robots`, 0 to 42, how many go
    round. One factory has room for 5 and 8; for more the slab grows by whole factories, up to about a million
    triangles. `glass`: robots wear helmets of glass, and fruit is translucent. The animations are called belts,
    machines, robots and particles. Raises SceneError for a number out of range.
    """
    checked("machine_world: seed", whole(0), seed)
    for name, count, most in (("machines", machines, MOST_MACHINES), ("robots", robots, MOST_ROBOTS)):
        if not 0 <= checked(f"machine_world: {name}", whole(), count) <= most:
            raise SceneError(f"machine_world: {name}={count} is out of range; ask for 0 to {most}")
    rng = np.random.default_rng(seed)
    kit = Kit(rng, checked("machine_world: glass", flag, glass))
    scene = Scene(f"machine_world {seed}", _sky())
    world = scene.add(Node("world"))
    count = max(math.ceil(machines / MACHINES), math.ceil(robots / ROBOTS), 1)
    columns = math.ceil(math.sqrt(count))
    rows = math.ceil(count / columns)
    _ground(world, kit.palette, columns, rows)
    track = mesh("track", [lathe([(0.55, 0), (0.75, 0)], kit.palette.accents[4], 0, 64, stretch=LANE.straight)])
    channels = []
    for i in range(count):
        share = (machines + i) // count, (robots + i) // count
        factory = Factory(kit, rng, f"factory {i}", *share)
        x, z = (i % columns - (columns - 1) / 2) * PLOT[0], ((rows - 1) / 2 - i // columns) * PLOT[1]
        factory.node.transform = move(x, 0, z)
        place(world, f"track {i}", track, move(x + LANE.center[0], 0.0005, z + LANE.center[1]))
        world.add(factory.node)
        channels.append(factory.channels)
    names = list(channels[0])
    scene.animations = [Animation([c for by_name in channels for c in by_name[name]], name) for name in names]
    _lights(world, max(columns, rows))
    far = np.array((-5.2, 5.7, 10.1)) * max(columns, rows)
    camera = Camera.look_at(far, (0.05, -0.05, 0.1), vertical_fov=math.radians(32.5), name="three-quarter")
    place(world, "camera", transform=camera.transform).camera = camera
    scene.animate(0.0)
    return scene


def _sky() -> Environment:
    return gradient_sky(
        zenith=(0.24, 0.33, 0.50),
        horizon=(0.52, 0.47, 0.43),
        nadir=(0.20, 0.16, 0.13),
        windows=[Window(azimuth=120, elevation=48, width=80, height=36, radiance=(2.0, 1.95, 1.9))],
        name="soft sky",
    )


def _ground(world: Node, palette: Palette, columns: int, rows: int) -> None:
    width, depth = columns * PLOT[0], rows * PLOT[1]
    ground = lathe([(0, 0), (60 * max(columns, rows), 0)], palette.ground, segments=64)
    place(world, "ground", mesh("ground", [ground]), move(0, -0.42, 0))
    slab = plate((width, 0.42, depth), 1.1, palette.floor, 0.09, 64)
    rim = plate((width + 0.16, 0.16, depth + 0.16), 1.18, palette.wood, 0.05, 64)
    place(world, "slab", mesh("slab", [at(slab, move(0, -0.21, 0)), at(rim, move(0, -0.34, 0))]))


def _lights(world: Node, size: int) -> None:
    """`size`: how many factories stand side by side."""
    sun = DirectionalLight(color=(1.0, 0.93, 0.82), illuminance=3.2, angular_diameter=math.radians(4.0), name="sun")
    place(world, "sun", sun, aim((6.0, 8.0, 3.2), (0, 0, 0)))
    soft_box = RectangleLight(
        color=(0.82, 0.90, 1.0), radiance=5.0, width=3.0 * size, height=2.0 * size, name="soft box"
    )
    place(world, "soft box", soft_box, aim(np.array((-5.5, 5.0, -5.0)) * size, (0, 0.4, 0)))

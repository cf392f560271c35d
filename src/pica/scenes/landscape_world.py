"""Hills with grass and shrubs, a paper dragon in the wind, a camp fire: all whose geometry changes as it goes."""

import math

import numpy as np

from pica.errors import SceneError
from pica.scene.animation import Animation
from pica.scene.camera import Camera
from pica.scene.deformer import Floats
from pica.scene.emitter import Emitter
from pica.scene.landscape import Landscape
from pica.scene.light import DirectionalLight, PointLight
from pica.scene.material import AlphaMode, Image, Material, Sampler, Texture, Wrap
from pica.scene.model import Mesh, Node, Scene
from pica.scene.particles import Ribbons, Sprites
from pica.scene.spline import Spline, bend
from pica.scene.values import checked, whole
from pica.scenes.basic_meshes import box, cylinder, frustum, sphere
from pica.scenes.foliage import grass, leaf_material, scatter, shrub
from pica.scenes.palette import clay, lamp, linear, plastic
from pica.scenes.placing import aim, at, mesh, move, place, rotate
from pica.scenes.sky import Window, gradient_sky
from pica.scenes.terrain import fractal_heights

_SAMPLES, _SPACING = 257, 0.5
_MOST_PLANTS = 20_000
_POLE, _FIRE = (1.5, -5.0), (-2.2, -2.0)
"""x and z, metres."""
_DRAGON = 10
"""Control points of the dragon."""


def landscape(seed: int = 1, plants: int = 1500) -> Scene:
    """Hills of 128 metres; `scene.animate(time)` drives the animations dragon, fire and meteor.

    The same seed gives the same scene. `plants`, 0 to 20,000, stand within 30 metres. Raises SceneError for a number
    out of range.
    """
    checked("landscape: seed", whole(0), seed)
    if not 0 <= checked("landscape: plants", whole(), plants) <= _MOST_PLANTS:
        raise SceneError(f"landscape: plants={plants} is out of range; ask for 0 to {_MOST_PLANTS}")
    sky = gradient_sky(
        zenith=(0.20, 0.34, 0.62),
        horizon=(0.75, 0.68, 0.60),
        nadir=(0.18, 0.17, 0.13),
        windows=[Window(azimuth=60, elevation=35, width=70, height=30, radiance=(1.6, 1.5, 1.4))],
        name="evening sky",
    )
    scene = Scene(f"landscape {seed}", sky)
    world = scene.add(Node("world"))
    ground = Landscape(_heights(seed), _SPACING, clay("meadow", "#7d8a4c"), full_detail=12.0)
    world.add(ground.node)
    if plants:
        _plant(world, ground, plants, seed)
    scene.animations = [_dragon(world, ground), _fire(world, ground, seed), _meteor(world, seed)]
    sun = DirectionalLight(color=(1.0, 0.86, 0.68), illuminance=4.0, angular_diameter=math.radians(1.5), name="sun")
    place(world, "sun", sun, aim((5.0, 4.5, 3.0), (0, 0, 0)))
    eye = float(ground.height_at(0.0, 5.0)) + 1.9
    camera = Camera.look_at((0, eye, 5), (0, eye - 0.1, 4), vertical_fov=math.radians(48.0), name="meadow")
    place(world, "camera", transform=camera.transform).camera = camera
    scene.animate(0.0)
    return scene


def _heights(seed: int) -> Floats:
    """Hills that grow towards the border, round a meadow in the middle."""
    middle = (np.arange(_SAMPLES) - (_SAMPLES - 1) / 2) * _SPACING
    x, z = np.meshgrid(middle, middle)
    rise = np.clip((np.hypot(x, z) - 8) / 40, 0, 1)
    hills = fractal_heights(_SAMPLES, hill=80, height=9.0, seed=seed)
    bumps = fractal_heights(_SAMPLES, hill=16, height=0.35, seed=seed + 1, octaves=3)
    return hills * rise + bumps + 6 * rise**2


def _plant(world: Node, ground: Landscape, plants: int, seed: int) -> None:
    meadow = ground.surface()
    centers = meadow.positions[meadow.indices].mean(1)
    meadow.indices = meadow.indices[np.hypot(centers[:, 0], centers[:, 2]) < 30]
    leaf, bark = leaf_material(), clay("bark", "#6b4f3a")
    blade = clay("blade", "#8fae4a")
    blade.double_sided = True
    kinds = [
        ("shrubs", shrub(leaf, bark, seed=seed), plants // 6, (0.4, 1.1), 0.9),
        ("tall shrubs", shrub(leaf, bark, leaves=110, height=1.6, seed=seed + 1), plants // 12, (0.6, 1.2), 0.9),
        ("grass", grass(blade, seed=seed), plants - plants // 6 - plants // 12, (0.6, 1.5), 0.5),
    ]
    for number, (name, what, count, sizes, upright) in enumerate(kinds):
        if not count:
            continue
        places = scatter(meadow, 3 * count, seed * 7 + number, sizes, upright=upright)
        clear = np.min([np.hypot(places[:, 0, 3] - x, places[:, 2, 3] - z) for x, z in (_POLE, _FIRE, (0, 5))], 0)
        world.add(Node(name, mesh=what, instances=places[clear > 1.2][:count]))


def _dragon(world: Node, ground: Landscape) -> Animation:
    """A paper dragon on a pole, whose body is bent along a spline, with streamers at its tail."""
    x, z = _POLE
    base = float(ground.height_at(x, z))
    top = base + 3.4
    place(world, "pole", mesh("pole", [at(cylinder(0.04, 3.5, clay("pole", "#7a5b40")), move(x, base + 1.7, z))]))
    red, gold = plastic("dragon red", "#d9483b", 0.4), plastic("dragon gold", "#f5c95c", 0.3)
    rib = [at(sphere(0.2, red, 20), move(0, 0, 0.15)), at(frustum(0.07, 0.0, 0.2, gold, 0.01, 12), move(0, 0.24, 0.15))]
    rib.append(at(cylinder(0.12, 0.16, gold, 0.02, 20), move(0, 0, 0.34), rotate("x", 90)))
    spline = Spline(_dragon_points(0.0, x, top, z), scales=_DRAGON_SCALES)
    world.add(bend(mesh("dragon", rib), spline, copies=12, name="dragon"))
    cloth = clay("streamer", "#f48d75")
    cloth.double_sided = True
    streamers = Ribbons(3, 16, cloth, "streamers")
    assert streamers.node is not None
    world.add(streamers.node)

    def drive(time: float) -> None:
        points = _dragon_points(time, x, top, z)
        spline.set(points, rolls=0.5 * np.sin(2.2 * time - np.arange(_DRAGON)), scales=_DRAGON_SCALES)
        along = np.linspace(0, 1.6, 16)
        strands = []
        for strand in range(3):
            sway = 0.12 * along * np.sin(5.0 * time - 5 * along + 2 * strand)
            drop = -0.10 * along**2 + 0.08 * (strand - 1)
            strands.append(points[-1] + np.stack([0.98 * along, drop + 0.4 * sway, sway + 0.1 * (strand - 1)], -1))
        streamers.set(strands, 0.07 * np.linspace(1, 0.3, 16))

    return Animation([], "dragon", [drive], duration=20.0)


_DRAGON_SCALES = np.linspace(1.25, 0.35, _DRAGON)


def _dragon_points(time: float, x: float, top: float, z: float) -> Floats:
    share = np.linspace(0, 1, _DRAGON)
    wave = 3.0 * time - 7 * share
    offset = np.stack([3.0 * share, 0.3 * share * np.sin(wave), 0.55 * share * np.sin(0.8 * wave + 1)], -1)
    return np.array((x - 0.2, top, z)) + offset


def _fire(world: Node, ground: Landscape, seed: int) -> Animation:
    """Logs, a light, smoke of sprites, and sparks, which are copies of a mesh."""
    x, z = _FIRE
    y = float(ground.height_at(x, z))
    wood, coal = clay("log", "#5a4030"), lamp("embers", "#ff8a3a", 10.0)
    logs = [
        at(cylinder(0.07, 0.9, wood, 0.02, 12), rotate("y", 60 * i), rotate("z", 62), move(0, 0.1, 0)) for i in range(6)
    ]
    place(world, "logs", mesh("logs", [*logs, at(sphere(0.16, coal, 16), move(0, 0.05, 0))]), move(x, y + 0.1, z))
    place(world, "fire", PointLight(color=(1.0, 0.55, 0.22), intensity=6.0, radius=0.15), move(x, y + 0.6, z))
    smoke = Sprites(90, _puff(seed), "smoke")
    assert smoke.node is not None
    world.add(smoke.node).transform = move(x, y + 0.35, z)
    rising = Emitter(
        90, 4.5, origin_radius=0.1, velocity=(0.1, 0.7, 0.0), spread=0.12, acceleration=(0.12, 0.06, 0.0),
        size=(0.22, 1.3), color=((0.55, 0.5, 0.46), (0.75, 0.75, 0.78)), alpha=(0.55, 0.0), spin=0.7, seed=seed,
    )  # fmt: skip
    spark = world.add(Node("sparks", mesh=Mesh([box(1.0, lamp("spark", "#ffb050", 25.0))], "spark")))
    spark.transform = move(x, y + 0.4, z)
    flying = Emitter(
        40, 1.6, origin_radius=0.1, velocity=(0.0, 2.2, 0.0), spread=0.7, acceleration=(0.3, -1.2, 0.0),
        size=(0.022, 0.004), spin=9.0, seed=seed + 5,
    )  # fmt: skip

    def drive(time: float) -> None:
        smoke.particles = rising.at(time)
        flying.at(time).place(spark)

    drive(0.0)
    return Animation([], "fire", [drive], duration=20.0)


def _meteor(world: Node, seed: int) -> Animation:
    """A light that flies in circles and loses glowing dust: an emitter that moves, sprites and ribbons together."""
    glow = lamp("dust", "#9fd0ff", 3.0)
    glow.alpha_mode, glow.double_sided, glow.base_color_texture = AlphaMode.BLEND, True, _round_texture(32)
    dust = Sprites(160, glow, "dust")
    assert dust.node is not None
    world.add(dust.node)

    def path(time: Floats) -> Floats:
        angle = 0.9 * time
        return np.stack([2.4 * np.cos(angle) + 0.2, 3.4 + 0.5 * np.sin(2.3 * angle), 1.6 * np.sin(angle) - 3.2], -1)

    trail = Emitter(
        160, 2.0, origin=path, origin_radius=0.03, velocity=(0.0, -0.05, 0.0), spread=0.12,
        size=(0.07, 0.02), alpha=(0.9, 0.0), seed=seed + 9,
    )  # fmt: skip
    ball = place(world, "meteor", mesh("meteor", [sphere(0.07, lamp("meteor", "#cfe6ff", 12.0), 20)]))

    def drive(time: float) -> None:
        dust.particles = trail.at(time)
        ball.transform = move(*path(np.array([time]))[0])

    drive(0.0)
    return Animation([], "meteor", [drive], duration=20.0)


def _puff(seed: int) -> Material:
    """A soft ragged cloud, as its alpha."""
    size = 64
    ragged = 0.5 + 0.5 * fractal_heights(size, 20, 1.0, seed, 4)
    return Material(
        "smoke",
        base_color=(*linear("#c9c6c4"), 1.0),
        metallic=0.0,
        specular=0.0,
        base_color_texture=_round_texture(size, ragged),
        alpha_mode=AlphaMode.BLEND,
        double_sided=True,
    )


def _round_texture(size: int, ragged: Floats | float = 1.0) -> Texture:
    v, u = np.meshgrid(*[(np.arange(size) + 0.5) / size * 2 - 1] * 2, indexing="ij")
    pixels = np.full((size, size, 4), 255.0)
    pixels[..., 3] = 255 * np.clip(1 - np.hypot(u, v), 0, 1) ** 1.2 * np.clip(ragged, 0, 1)
    image = Image(np.rint(pixels).astype(np.uint8), "round")
    return Texture(image, Sampler(Wrap.CLAMP_TO_EDGE, Wrap.CLAMP_TO_EDGE))

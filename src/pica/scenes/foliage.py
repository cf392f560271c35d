"""Plants in code: leaves cut out of quads by their alpha, and where plants stand on a surface."""

import math

import numpy as np
from numpy.typing import NDArray

from pica.errors import SceneError
from pica.scene.material import AlphaMode, Image, Material, Sampler, Texture, Wrap
from pica.scene.model import Mesh, Section
from pica.scenes.basic_meshes import merged, pipe, plane
from pica.scenes.placing import at, move, rotate

Floats = NDArray[np.float64]


def leaf_image(size: int = 64) -> Image:
    """A leaf, its tip up, (size, size, 4): green between its veins, clear round about it."""
    v, u = np.meshgrid(*[(np.arange(size) + 0.5) / size] * 2, indexing="ij")
    along = 1 - v  # from the stalk to the tip
    half = 0.46 * np.sin(np.pi * along**0.8) ** 0.9
    across = np.abs(u - 0.5)
    notches = 0.02 * np.abs(np.sin(14 * np.pi * along))
    blade = across < half - notches
    stalk = (across < 0.02) & (along < 0.1)
    vein = (across < 0.012) | (np.abs((along - 0.9 * across) * 9 % 1 - 0.5) < 0.05)
    shade = np.where(vein, 1.25, 0.85 + 0.3 * across)[..., None]
    pixels = np.zeros((size, size, 4))
    pixels[..., :3] = np.clip(np.array([92, 142, 52]) * shade, 0, 255)
    pixels[..., 3] = np.where(blade | stalk, 255, 0)
    return Image(np.rint(pixels).astype(np.uint8), "leaf")


def leaf_material(texture: Texture | None = None) -> Material:
    """What leaves are made of: their shape is the alpha of `texture`, or of leaf_image."""
    clamped = Sampler(Wrap.CLAMP_TO_EDGE, Wrap.CLAMP_TO_EDGE)
    return Material(
        "leaf",
        metallic=0.0,
        roughness=0.6,
        specular=0.5,
        base_color_texture=texture or Texture(leaf_image(), clamped),
        alpha_mode=AlphaMode.MASK,
        double_sided=True,
    )


def shrub(leaf: Material, bark: Material, leaves: int = 60, height: float = 1.0, seed: int = 0) -> Mesh:
    """A small bush that grows along +Y from the origin: a few bent twigs with quads for leaves."""
    rng = np.random.default_rng(seed)
    twigs, blades = [], []
    count = max(leaves // 10, 3)
    for twig in range(count):
        angle = 2 * math.pi * (twig + rng.uniform(-0.3, 0.3)) / count
        lean = rng.uniform(0.15, 0.5)
        share = np.linspace(0, 1, 6)[:, None]
        outward = np.array([math.cos(angle), 0, math.sin(angle)])
        path = height * rng.uniform(0.7, 1.0) * (share * (0, 1, 0) + lean * share**2 * outward)
        twigs.append(pipe(path, 0.008 * height, bark, 5))
        for along in rng.uniform(0.25, 1.0, math.ceil(leaves / count)):
            where = np.array([np.interp(along, share[:, 0], column) for column in path.T])
            size = height * rng.uniform(0.16, 0.26)
            quad = at(plane(0.8 * size, size, leaf), move(0, 0, -size / 2))  # its stalk at the origin, its tip at -Z
            blades.append(at(quad, move(*where), rotate("y", rng.uniform(0, 360)), rotate("x", rng.uniform(10, 60))))
    return Mesh([merged(twigs), merged(blades)], "shrub")


def grass(blade: Material, blades: int = 40, height: float = 0.3, seed: int = 0) -> Mesh:
    """A tuft of blades along +Y from the origin, each a narrow strip that bends over; one section."""
    rng = np.random.default_rng(seed)
    strips = []
    for _ in range(blades):
        strip = plane(0.012 * height / 0.3, 1.0, blade, cells=3)
        share = (0.5 - strip.positions[:, 2]).astype(np.float64)
        tall, over = height * rng.uniform(0.6, 1.0), height * rng.uniform(0.1, 0.6)
        narrow = 1 - 0.9 * share**2
        bent = np.stack([strip.positions[:, 0] * narrow, tall * share, -over * share**2], -1)
        normals = np.stack([0 * share, 2 * over * share, tall + 0 * share], -1)
        strip.positions = bent.astype(np.float32)
        strip.normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32)
        spread = rng.uniform(-0.12, 0.12, 2) * height / 0.3
        strips.append(at(strip, move(spread[0], 0, spread[1]), rotate("y", rng.uniform(0, 360))))
    return Mesh([merged(strips)], "grass")


def scatter(
    surface: Section,
    count: int,
    seed: int = 0,
    sizes: tuple[float, float] = (0.7, 1.3),
    steepest: float = math.radians(40.0),
    upright: float = 0.7,
) -> Floats:
    """(count, 4, 4) places on a surface, evenly over its area, for Node.instances.

    `sizes`: least and largest scale. `steepest`: radians from level beyond which nothing grows. `upright`: 1 stands
    along +Y, 0 along the surface's normal. The same seed gives the same places. Raises SceneError where all is too
    steep.
    """
    corners = surface.positions[surface.indices].astype(np.float64)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(across, axis=1)
    normals = across / np.maximum(area, 1e-30)[:, None]
    area = np.where(normals[:, 1] >= math.cos(steepest), area, 0)
    if not area.any():
        raise SceneError(f"scatter: nowhere is the surface less steep than {steepest:g} radians")
    rng = np.random.default_rng(seed)
    chosen = np.searchsorted(np.cumsum(area) / area.sum(), rng.random(count), side="right").clip(0, len(area) - 1)
    # Osada, Funkhouser, Chazelle and Dobkin 2002, "Shape Distributions", section 4.2
    root, second = np.sqrt(rng.random(count))[:, None], rng.random(count)[:, None]
    a, b, c = corners[chosen].transpose(1, 0, 2)
    up = normals[chosen] * (1 - upright) + np.array([0, upright, 0])
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    angle = rng.uniform(0, 2 * math.pi, count)
    side = np.stack([np.cos(angle), 0 * angle, np.sin(angle)], -1)
    side -= up * np.sum(side * up, axis=1, keepdims=True)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    scale = rng.uniform(*sizes, count)[:, None]
    places = np.zeros((count, 4, 4))
    places[:, :3, 0], places[:, :3, 1], places[:, :3, 2] = side * scale, up * scale, np.cross(side, up) * scale
    places[:, :3, 3] = a * (1 - root) + b * root * (1 - second) + c * root * second
    places[:, 3, 3] = 1
    return places

"""Small scenes and pictures for the tests that render."""

from collections.abc import Callable, Iterable

import numpy as np
import slangpy as spy

import pica
from pica.graph.offers import Offer
from pica.graph.plan import newest
from pica.graph.resources import Buffer, Lifetime
from pica.graph.resources import Texture as Texture2D
from pica.rhi.device import Device
from pica.scene.camera import Camera
from pica.scene.environment import Environment
from pica.scene.light import DirectionalLight, Light
from pica.scene.material import AlphaMode, Image, Material, Sampler, Texture
from pica.scene.model import Mesh, Node, Scene, Section
from pica.scenes.basic_meshes import box, lathe, plane, sphere
from pica.scenes.placing import aim, move, rotate

SIZE = (96, 64)
RASTER = {"visibility.primary": "raster"}
RAYS = {"visibility.primary": "rays", "rays.scheduler": "pipeline"}
BUFFERS = {**RAYS, "rays.scheduler": "buffers", "rays.tracer": "device"}
EMBREE = {**BUFFERS, "rays.tracer": "embree"}


def settings(values: dict[str, str] | None = None) -> pica.Settings:
    """Settings for tests of anything but antialiasing and light of other surfaces: what changed shows in the next
    frame, whole, and is direct light alone."""
    alone = {"antialiasing.mode": "accumulate", "reflections.mode": "off", "global_illumination.mode": "off"}
    return pica.Settings().with_values({**alone, **(values or {})})


def lambert(red: float = 0.5, green: float | None = None, blue: float | None = None, **more) -> Material:
    color = (red, red if green is None else green, red if blue is None else blue, 1.0)
    return Material(**{"base_color": color, "metallic": 0.0, "roughness": 1.0, "specular": 0.0, **more})


def placed(section: Section | Iterable[Section], transform=None, name: str = "") -> Node:
    sections = [section] if isinstance(section, Section) else list(section)
    node = Node(name, mesh=Mesh(sections, name))
    node.transform = np.eye(4) if transform is None else transform
    return node


def shining(light: Light, transform=None) -> Node:
    node = Node("light", light=light)
    node.transform = np.eye(4) if transform is None else transform
    return node


def scene_of(*nodes: Node, environment: Environment | None = None) -> Scene:
    scene = Scene("test", environment)
    for node in nodes:
        scene.add(node)
    return scene


def uniform(*radiance: float) -> Environment:
    return Environment(np.broadcast_to(np.float32(radiance), (4, 8, 3)).copy())


def sky(seed: int = 0) -> Environment:
    """A dim sky of different colours with a small bright sun."""
    radiance = np.random.default_rng(seed).uniform(0.1, 0.5, (16, 32, 3)).astype(np.float32)
    radiance[4, 20:22] = 40.0
    return Environment(radiance)


def checkered(alpha_low: int = 0, cells: int = 4) -> Image:
    """A board of `cells` x `cells` fields, half of them clear; eight texels a field."""
    board = np.kron(np.indices((cells, cells)).sum(0) % 2, np.ones((8, 8), int))
    pixels = np.full((*board.shape, 4), 255, np.uint8)
    pixels[..., 0] = np.where(board, 230, 120)
    pixels[..., 3] = np.where(board, 255, alpha_low)
    return Image(pixels, "board")


def ramp() -> Texture:
    """Grey that brightens from left to right."""
    pixels = np.full((16, 16, 4), 255, np.uint8)
    pixels[..., :3] = (np.arange(16) * 17)[:, None, None]
    return Texture(Image(pixels, "ramp"))


def wall(**values) -> Node:
    """Two metres of a material, upright."""
    return placed(plane(2, 2, Material(**values)), rotate("x", 90))


def shown(materials, *more: Node, light: Light | None = None, environment: Environment | None = None) -> Scene:
    """Two balls and a box of three materials on a grey floor, below a light."""
    nodes = [
        placed(sphere(0.35, materials[0]), move(-0.8, 0.35, 0)),
        placed(sphere(0.35, materials[1]), move(0, 0.35, 0)),
        placed(box(0.6, materials[2]), move(0.8, 0.3, 0) @ rotate("y", 30)),
        placed(plane(5, 5, lambert(0.5))),
        *more,
    ]
    if light is not None:
        nodes.append(shining(light, aim((0.5, 2.2, 1.6), (0, 0.3, 0))))
    return scene_of(*nodes, environment=environment)


def leaves(mode: AlphaMode = AlphaMode.MASK, **more) -> Material:
    """A material with holes: fields of a board, sharp at their edges."""
    return lambert(
        0.8,
        alpha_mode=mode,
        base_color_texture=Texture(checkered(40), Sampler(linear=False)),
        double_sided=True,
        **more,
    )


def bumps(size: int = 32) -> Texture:
    """A normal map of waves along both axes."""
    u, v = np.meshgrid(np.arange(size) / size, np.arange(size) / size)
    normals = np.stack([0.5 * np.sin(4 * np.pi * u), 0.3 * np.sin(6 * np.pi * v + 1), np.ones_like(u)], -1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    pixels = np.concatenate([normals * 127.5 + 127.5, np.full((size, size, 1), 255.0)], -1)
    return Texture(Image(np.rint(pixels).astype(np.uint8), "bumps"))


def open_cone(material: Material) -> Section:
    """A cone without its bottom: single-sided it can be looked into."""
    return lathe([(0.1, 0.5), (0.6, -0.5)], material)


def still_life() -> Scene:
    """Floor, a glossy ball, a bumpy box, a board with holes, a half-transparent one, a cone to look into; a sun, a
    lamp, an emissive quad and a sky."""
    floor = placed(plane(4, 4, lambert(0.6, 0.5, 0.4)), name="floor")
    glossy = Material("glossy", base_color=(0.9, 0.6, 0.3, 1), metallic=1.0, roughness=0.35)
    plastic = Material("plastic", base_color=(0.2, 0.4, 0.8, 1), metallic=0.0, roughness=0.5, normal_texture=bumps())
    glow = lambert(0.5, name="glow", emission=(4.0, 3.0, 2.0))
    return scene_of(
        floor,
        placed(sphere(0.5, glossy), move(-0.9, 0.5, 0), "ball"),
        placed(box(0.7, plastic), move(0.2, 0.36, -0.6) @ rotate("y", 30), "box"),
        placed(plane(0.8, 0.8, leaves()), move(0.9, 0.5, 0.4) @ rotate("x", 70) @ rotate("y", 20), "mask"),
        placed(plane(0.6, 0.6, leaves(AlphaMode.BLEND)), move(0.1, 0.4, 0.7) @ rotate("x", 80), "blend"),
        placed(open_cone(lambert(0.3, 0.7, 0.3)), move(1.3, 0.45, -0.7) @ rotate("x", 150), "cone"),
        placed(plane(0.5, 0.5, glow), move(-0.3, 1.6, -0.9) @ rotate("x", 110), "glow"),
        shining(DirectionalLight(illuminance=2.0, angular_diameter=0.1), aim((1, 2, 1.5), (0, 0, 0))),
        environment=sky(),
    )


CAMERA = Camera.look_at((0.4, 1.5, 3.4), (0.1, 0.4, 0), vertical_fov=np.radians(42))


def render(device: Device, scene: Scene, frames: int = 1, camera: Camera | None = None, size=SIZE, values=None):
    return pica.Renderer(scene, size=size, settings=settings(values), device=device).render(frames, camera=camera)


def trace(device: Device, scene: Scene, samples: int = 1, camera=None, size=SIZE, max_depth=None, values=None):
    tracer = pica.PathTracer(scene, size=size, max_depth=max_depth, settings=settings(values), device=device)
    return tracer.render(samples, camera=camera)


def converged(device: Device, scene: Scene, samples: int, camera=None, size=SIZE, max_depth=None, values=None):
    """(height, width, 3) the path traced picture of `samples` paths a pixel, a multiple of 16: it is made as one of 16
    times the pixels, as each sample of a small picture takes as long as one of a large picture."""
    width, height = size
    picture = trace(device, scene, samples // 16, camera, (4 * width, 4 * height), max_depth, values).color
    return picture.reshape(height, 4, width, 4, 3).mean((1, 3))


def resource_of(renderer: pica.Renderer, scope: str, name: str) -> Texture2D | Buffer:
    """What an effect declares by this name to the graph of the newest frame."""
    return next(each for each in renderer._frame_plan._plan.resources if each.key == (scope, name))


def held(renderer: pica.Renderer, scope: str, name: str) -> spy.Texture | spy.Buffer:
    """The newest of a history, or what is kept: with the content that the newest frame left in it."""
    resource = resource_of(renderer, scope, name)
    assert resource.lifetime is not Lifetime.FRAME, "others may have its memory by now"
    return newest(resource)


def left_in(renderer: pica.Renderer, scope: str, name: str) -> Callable[[], tuple[str]]:
    """As `capture` of Renderer.advance: what the frame's passes leave in a texture, by the name "test.NAME"."""

    def offer() -> tuple[str]:
        found = resource_of(renderer, scope, name)
        plan, offered = renderer._frame_plan._plan, f"test.{name}"
        last = max(node.index for node in plan.nodes if found in node.writes)
        plan.offers[offered] = Offer(offered, scope, (found,), lambda values: values, None, last, on_request=True)
        return (offered,)

    return offer


def orthographic(eye, target, height: float, near: float = 0.1, far: float = 20.0) -> Camera:
    from dataclasses import replace

    return replace(Camera.look_at(eye, target), orthographic_height=height, near=near, far=far)


def projected(camera: Camera, points, size) -> np.ndarray:
    """(n, 2) pixels right and down from the upper left corner at which world points (n, 3) are seen."""
    width, height = size
    local = np.einsum("ni,ij->nj", np.asarray(points) - camera.transform[:3, 3], camera.transform[:3, :3])
    half = np.tan(camera.vertical_fov / 2) if camera.orthographic_height is None else camera.orthographic_height / 2
    scale = half * (-local[:, 2:] if camera.orthographic_height is None else 1)
    ndc = local[:, :2] / scale * (height / width, 1)
    return (ndc * (0.5, -0.5) + 0.5) * (width, height)


def edges(ids: np.ndarray) -> np.ndarray:
    """(height, width) True where a pixel or one of its eight neighbours has another id, and along the border."""
    found = np.ones(ids.shape, bool)
    middle = ids[1:-1, 1:-1]
    found[1:-1, 1:-1] = False
    for y in range(3):
        for x in range(3):
            found[1:-1, 1:-1] |= ids[y : ids.shape[0] - 2 + y, x : ids.shape[1] - 2 + x] != middle
    return found


def assert_schedulers_agree(device, make):
    """Bit for bit, in every buffer of the hybrid picture and in the path traced one, of the scene that `make` gives."""
    pipeline, buffers = (render(device, make(), 2, CAMERA, values=values) for values in (RAYS, BUFFERS))
    for name in pipeline.aov_names:
        np.testing.assert_array_equal(pipeline.aov(name), buffers.aov(name), err_msg=name)
    np.testing.assert_array_equal(pipeline.color, buffers.color)
    traced = [trace(device, make(), 2, CAMERA, values=values).color for values in (RAYS, BUFFERS)]
    np.testing.assert_array_equal(*traced)
    assert traced[0].mean() > 0.1

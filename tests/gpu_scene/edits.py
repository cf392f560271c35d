"""A scene that has something of every kind, and another value for each field that can be written."""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

import pica
from pica.scene.animation import Pose
from pica.scene.anisotropy import Anisotropy
from pica.scene.camera import Camera
from pica.scene.coat import Coat
from pica.scene.iridescence import Iridescence
from pica.scene.light import DirectionalLight, PointLight, SphereLight
from pica.scene.material import AlphaMode, Image, Material, Sampler, Texture
from pica.scene.model import Mesh, Node, Scene, Section
from pica.scene.primitives import Primitives, spheres
from pica.scene.sheen import Sheen
from pica.scene.skin import Skin
from pica.scene.spline import Spline
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import aim, move, rotate
from tests.building import RAYS, lambert, placed, scene_of, settings, shining, sky, uniform

SIZE = (48, 32)
CAMERA = Camera.look_at((0, 1.6, 3.4), (0, 0.3, 0))
LIT = settings({**RAYS, "shadows.mode": "hard", "shadows.max_lights": "4", "lighting.environment": "prefiltered"})
"""What moves light about is off: the picture is the scene's alone, to the bit."""
SETTINGS = LIT.with_values({"transparency.mode": "off"})
"""For the stage, which has no glass: paths through it take long to compile with coats and lobes."""


THROUGH = {"transmission", "transmission_texture", "thin_walled", "absorption", "dispersion"}
"""Fields of what lets light through."""
DIFFUSE = {
    "diffuse_transmission",
    "diffuse_transmission_texture",
    "diffuse_transmission_color",
    "diffuse_transmission_color_texture",
    "scattering",
    "scatter_anisotropy",
}
"""Fields of what lets it through diffusely; test_translucency.py edits them."""


def texture(seed: int, size: int = 8) -> Texture:
    pixels = np.random.default_rng(seed).integers(60, 250, (size, size, 4)).astype(np.uint8)
    return Texture(Image(pixels, f"noise {seed}"), Sampler(linear=False))


def glass() -> Material:
    """Shows the fields of what lets light through."""
    return Material(
        base_color=(0.9, 0.8, 0.7, 1.0),
        metallic=0.0,
        roughness=0.1,
        transmission=0.9,
        transmission_texture=texture(50),
        thin_walled=False,
    )


def everything() -> Material:
    """A material that has all there is but transmission, so that each of its fields shows."""
    slots = [
        field.name
        for field in fields(Material)
        if field.name.endswith("_texture") and field.name not in THROUGH | DIFFUSE
    ]
    return Material(
        base_color=(0.8, 0.6, 0.5, 0.9),
        metallic=0.5,
        roughness=0.6,
        emission=(0.1, 0.1, 0.05),
        coats=(Coat(strength=0.5, roughness=0.3),),
        iridescence=Iridescence(strength=0.5),
        anisotropy=Anisotropy(strength=0.5),
        sheen=Sheen(color=(0.3, 0.3, 0.3)),
        alpha_mode=AlphaMode.MASK,
        alpha_cutoff=0.3,
        **{slot: texture(number) for number, slot in enumerate(slots)},
    )


def stage() -> Scene:
    """A ball, a box, balls that are no triangles, a cloth and a skinned triangle under a sun, a lamp and a sky."""
    ball = placed(sphere(0.4, everything(), segments=16), move(-0.6, 0.4, 0), "ball")
    cube = placed([box(0.5, lambert(0.7, 0.4, 0.2))], move(0.6, 0.25, 0), "box")
    beads = Node("beads", mesh=Mesh(primitives=[spheres([[0, 0.15, 0.9]], 0.15, lambert(0.3, 0.5, 0.8))]))
    morphed = box(0.3, lambert(0.5, 0.8, 0.3))
    offsets = np.zeros((1, len(morphed.positions), 3), np.float32)
    offsets[:, :, 1] = 0.3
    shape = placed(replace(morphed, morph_positions=offsets), move(0, 0.9, 0), "shape")
    floor = placed(plane(6, 6, lambert(0.5)), name="floor")
    channels = frozenset(range(5))
    sun = shining(DirectionalLight(illuminance=2.0, lighting_channels=channels), aim((1, 2, 1), (0, 0, 0)))
    lamp = shining(PointLight(intensity=2.0), move(-1, 1.5, 1))
    return scene_of(ball, cube, beads, shape, floor, sun, lamp, environment=sky())


def stage_with_window() -> Scene:
    """With a block of glass, and without the ball of coats and lobes."""
    scene = stage()
    scene.remove(named(scene, "ball"))
    scene.add(placed(box((0.5, 0.2, 0.5), glass()), move(-0.1, 0.4, 0.7) @ rotate("x", 75), "window"))
    return scene


def named(scene: Scene, name: str) -> Node:
    return next(node for node in scene.nodes() if node.name == name)


def material(scene: Scene) -> Material:
    return named(scene, "ball").mesh.sections[0].material


def glass_material(scene: Scene) -> Material:
    return named(scene, "window").mesh.sections[0].material


def section(scene: Scene) -> Section:
    return named(scene, "box").mesh.sections[0]


def limb(scene: Scene) -> Skin:
    """Has a joint of its own for the box."""
    bone = scene.add(Node("bone"))
    bone.transform = move(0.9, 0.6, 0)
    cube = section(scene)
    count = len(cube.positions)
    cube.joints, cube.weights = np.zeros((count, 1), np.uint16), np.ones((count, 1), np.float32)
    return Skin([bone], np.eye(4)[None])


@dataclass
class Case:
    holder: Callable[[Scene], Any]
    value: Callable[[Any, Scene], Any]
    """Takes the value before."""
    shows: bool = True


def moved(before: np.ndarray, scene: Scene) -> np.ndarray:
    return before * np.float32(1.4)


def other_texture(before: Texture | None, scene: Scene) -> Texture:
    return texture(77, 4)


MATERIAL: dict[str, Any] = {
    "name": "other",
    "base_color": (0.2, 0.9, 0.4, 0.9),
    "metallic": 0.9,
    "roughness": 0.2,
    "emission": (0.0, 2.0, 0.0),
    "normal_scale": -1.0,
    "occlusion_strength": 0.2,
    "alpha_mode": AlphaMode.OPAQUE,
    "alpha_cutoff": 0.6,
    "double_sided": True,
    "unlit": True,
    "ior": 2.4,
    "specular": 0.1,
    "specular_color": (0.2, 1.0, 0.2),
    "transmission": 0.4,
    "thin_walled": True,
    "absorption": (3.0, 1.0, 8.0),
    "dispersion": 5.0,
    "coats": (Coat(strength=1.0, absorption=(0.1, 0.5, 0.9), thickness=1.0),),
    "coat_normal_scale": -1.0,
    "iridescence": Iridescence(strength=1.0, ior=1.8),
    "anisotropy": Anisotropy(strength=0.9, rotation=1.0),
    "sheen": Sheen(color=(0.9, 0.1, 0.1)),
    "type": "standard",
    "parameters": {},
    "extras": {"a": 1},
}
QUIET = {"name", "type", "parameters", "extras"}
CASES: dict[tuple[type, str], Case] = {
    **{
        (Material, field.name): Case(
            material,
            other_texture if field.name.endswith("_texture") else lambda before, scene, name=field.name: MATERIAL[name],
            field.name not in QUIET,
        )
        for field in fields(Material)
        if field.name not in THROUGH | DIFFUSE
    },
    (Image, "pixels"): Case(
        lambda scene: material(scene).base_color_texture.image, lambda before, scene: 255 - before[:4, :4]
    ),
    (Image, "encoding"): Case(lambda scene: material(scene).base_color_texture.image, lambda *_: "linear"),
    (Image, "name"): Case(lambda scene: material(scene).base_color_texture.image, lambda *_: "other", False),
    (Section, "positions"): Case(section, moved),
    (Section, "normals"): Case(section, lambda before, scene: np.roll(before, 3, axis=0)),
    (Section, "tangents"): Case(section, lambda before, scene: -before, False),
    (Section, "uv0"): Case(lambda scene: named(scene, "ball").mesh.sections[0], moved),
    (Section, "uv1"): Case(section, lambda before, scene: before + 1, False),
    (Section, "colors"): Case(section, lambda before, scene: before * np.float32(0.5)),
    (Section, "indices"): Case(section, lambda before, scene: before[: len(before) // 2]),
    (Section, "material"): Case(section, lambda before, scene: material(scene)),
    (Section, "flat"): Case(section, lambda *_: True, False),
    (Section, "joints"): Case(section, lambda before, scene: None, False),
    (Section, "weights"): Case(section, lambda before, scene: None, False),
    (Section, "morph_positions"): Case(lambda scene: named(scene, "shape").mesh.sections[0], lambda b, s: 2 * b, False),
    (Section, "morph_normals"): Case(section, lambda before, scene: None, False),
    (Section, "morph_tangents"): Case(section, lambda before, scene: None, False),
    (Section, "rows"): Case(section, lambda before, scene: None, False),
    (Mesh, "sections"): Case(
        lambda scene: named(scene, "box").mesh, lambda before, scene: [*before, box(0.8, lambert(0.9))]
    ),
    (Mesh, "primitives"): Case(
        lambda scene: named(scene, "box").mesh, lambda before, scene: named(scene, "beads").mesh.primitives
    ),
    (Mesh, "name"): Case(lambda scene: named(scene, "box").mesh, lambda *_: "other", False),
    (Primitives, "shape"): Case(
        lambda scene: named(scene, "beads").mesh.primitives[0], lambda before, scene: before, False
    ),
    (Primitives, "parameters"): Case(
        lambda scene: named(scene, "beads").mesh.primitives[0],
        lambda before, scene: {**before, "radius": before["radius"] * 0.6},
    ),
    (Primitives, "bounds"): Case(lambda scene: named(scene, "beads").mesh.primitives[0], lambda b, s: b * 1.1, False),
    (Primitives, "material"): Case(
        lambda scene: named(scene, "beads").mesh.primitives[0], lambda *_: lambert(0.9, 0.1, 0.1)
    ),
    (Node, "name"): Case(lambda scene: named(scene, "box"), lambda *_: "cube", False),
    (Node, "mesh"): Case(lambda scene: named(scene, "box"), lambda before, scene: named(scene, "ball").mesh),
    (Node, "light"): Case(lambda scene: scene.roots[-1], lambda *_: SphereLight(radiance=20.0, radius=0.3)),
    (Node, "camera"): Case(lambda scene: named(scene, "box"), lambda *_: CAMERA, False),
    (Node, "instances"): Case(
        lambda scene: named(scene, "box"), lambda *_: np.stack([np.eye(4), move(0, 0.7, 0), move(0, 0, 0.7)])
    ),
    (Node, "identities"): Case(lambda scene: named(scene, "box"), lambda *_: [7], False),
    (Node, "extras"): Case(lambda scene: named(scene, "box"), lambda *_: {"class": "box"}, False),
    (Node, "visible_to_camera"): Case(lambda scene: named(scene, "box"), lambda *_: False),
    (Node, "visible_to_reflections"): Case(lambda scene: named(scene, "box"), lambda *_: False),
    (Node, "casts_shadows"): Case(lambda scene: named(scene, "box"), lambda *_: False),
    (Node, "lighting_channels"): Case(lambda scene: named(scene, "box"), lambda *_: frozenset({5})),
    (Node, "pose"): Case(lambda scene: named(scene, "box"), lambda *_: Pose((0.5, 0.4, 0.3), (0, 0.6, 0, 0.8))),
    (Node, "detail"): Case(lambda scene: named(scene, "box"), lambda *_: None, False),
    (Node, "transform"): Case(lambda scene: named(scene, "box"), lambda b, s: b @ rotate("y", 40)),
    (Node, "weights"): Case(lambda scene: named(scene, "shape"), lambda *_: [1.0]),
    (Node, "skin"): Case(lambda scene: named(scene, "box"), lambda before, scene: limb(scene)),
    (Node, "deformer"): Case(
        lambda scene: named(scene, "box"), lambda *_: Spline([[0, 0, 0], [0, 0.4, 0.3], [0, 0.9, 0.3]])
    ),
    (Scene, "name"): Case(lambda scene: scene, lambda *_: "other", False),
    (Scene, "environment"): Case(lambda scene: scene, lambda *_: uniform(1, 0.2, 0.2)),
}
ONCE = {"skin", "deformer", "weights", "pose"}
"""Fields that cannot be set back to what they were."""


def first_frame(renderer: Any) -> pica.Frame:
    """A picture that nothing came before."""
    if isinstance(renderer, pica.Renderer):
        renderer.reset()
    return renderer.render(1, camera=CAMERA)


def buffers(frame: pica.Frame) -> dict[str, np.ndarray]:
    return {name: frame.aov(name) for name in ("depth", "normal", "albedo", "emission")} | {"color": frame.color}


def picture(renderer: Any) -> dict[str, np.ndarray]:
    return buffers(first_frame(renderer))


def differing(some: dict[str, np.ndarray], others: dict[str, np.ndarray]) -> list[str]:
    """Names of the buffers that differ by more than the rounding of what the chance of each light is weighed with."""
    alike = {"rtol": 1e-4, "atol": 1e-5, "equal_nan": True}
    return [name for name, values in some.items() if not np.allclose(values, others[name], **alike)]

"""What is immutable in a scene is replaced as a whole: each field of each such class is in the next picture."""

import inspect
from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np
import pytest

import pica
from pica.scene.dynamic_vertices import DynamicVertices
from pica.scene.material import Sampler, Wrap
from pica.scene.model import Node, Scene
from pica.scenes.basic_meshes import box, plane
from pica.scenes.placing import aim, move
from tests.building import lambert, placed
from tests.gpu_scene.edits import CASES, SETTINGS, SIZE, buffers, differing, named, stage, texture
from tests.gpu_scene.rebuilt import rebuilt

CAMERA = pica.Camera.look_at((0, 1.6, 3.4), (0, 0.3, 0))
RED = (1.0, 0.1, 0.1)
NAMED = {"name": "other"}
COMMON: dict[str, Any] = {"color": RED, "shadow_denoiser": "off", **NAMED, "lighting_channels": frozenset({5})}
LENS: dict[str, Any] = {
    "vertical_fov": 0.5, "near": 2.9, "principal_point": (0.4, 0.6), "pixel_aspect": 1.5, **NAMED,
    "orthographic_height": 2.0, "far": 3.8,
}  # fmt: skip
"""Only an orthographic camera's view ends at `far`."""
APERTURE: dict[str, Any] = {"focus_distance": 1.2, "f_number": 0.1, "sensor_height": 0.05, "aperture_blades": 3}
"""Of a perspective camera."""
QUIET = {"name", "identities", "axes", "ages"}
"""Fields that sprites without textures do not show."""

VALUES: dict[type, dict[str, Any]] = {
    pica.DirectionalLight: {"illuminance": 3.0, "angular_diameter": 0.4, **COMMON},
    pica.PointLight: {"intensity": 3.0, "radius": 0.2, "range": 2.0, **COMMON},
    pica.SpotLight: {
        "intensity": 9.0, "radius": 0.2, "range": 2.0, "inner_cone_angle": 0.4, "outer_cone_angle": 0.5, **COMMON
    },
    pica.RectangleLight: {"radiance": 3.0, "width": 0.4, "height": 0.4, **COMMON},
    pica.DiskLight: {"radiance": 3.0, "radius": 0.2, **COMMON},
    pica.SphereLight: {"radiance": 3.0, "radius": 0.3, **COMMON},
    pica.TubeLight: {"radiance": 3.0, "length": 0.4, "radius": 0.1, **COMMON},
    pica.Environment: {"radiance": np.full((2, 4, 3), (0.9, 0.2, 0.1)), "strength": 2.0, "rotation": 1.0, **NAMED},
    pica.Texture: {"image": texture(5).image, "sampler": Sampler(linear=True), "uv_set": 1,
                   "transform": (2.0, 0.0, 0.3, 0.0, 3.0, 0.0)},
    pica.Sampler: {"wrap_u": Wrap.CLAMP_TO_EDGE, "wrap_v": Wrap.MIRRORED_REPEAT, "linear": True},
    pica.Coat: {"strength": 0.9, "roughness": 0.7, "ior": 1.9, "absorption": (0.1, 0.9, 0.9), "thickness": 2.0,
                "air_below": True},
    pica.Sheen: {"color": RED, "roughness": 0.9},
    pica.Iridescence: {"strength": 1.0, "ior": 1.9, "thickness_minimum": 300.0, "thickness_maximum": 800.0},
    pica.Anisotropy: {"strength": 0.9, "rotation": 1.0},
    pica.Camera: {"transform": pica.Camera.look_at((0.4, 1.5, 3.3), (0, 0.3, 0)).transform, **LENS, **APERTURE},
    pica.Particles: {
        "sizes": np.array([0.4, 0.2]), "colors": np.array([[1, 0, 0, 1], [0, 0, 1, 1]]), "rotations": np.array([0.5]),
        "positions": np.array([[0.2, 0.6, 1.0], [-0.3, 0.3, 1.2]]), "ages": np.array([0.7]),
        "identities": np.array([4, 5]), "axes": np.array([[1.0, 0, 0]]),
    },
    pica.Pose: {"translation": np.array([0.3, 0.6, 0.2]), "rotation": np.array([0, 0.6, 0, 0.8]),
                "scale": np.array([1, 2, 1])},
}  # fmt: skip
"""Another value for each field."""
METHODS: dict[type, set[str]] = {
    pica.Spline: {"points", "rolls", "scales"},
    pica.Ribbons: {"positions", "widths", "colors", "identities"},
    pica.DynamicVertices: {"positions", "normals"},
    pica.Sprites: {"particles"},
}
"""What methods and setters take; each argument has its test below."""
MADE_AT_ONCE = {pica.Landscape, pica.Skin, pica.Animation, pica.Channel, pica.FieldChannel}
"""Assigned, added or played as a whole: tests below; field channels in test_animated_fields_render.py."""
NOT_SHOWN = {pica.Limits, pica.Emitter, pica.SceneViews}
"""Limits of loading; what gives Particles; copies of scenes."""
ASSIGNED = {kind for kind, _ in CASES}


def test_every_class_of_a_scene_is_tested():
    public = {
        value
        for name in pica.__all__
        if inspect.isclass(value := getattr(pica, name)) and value.__module__.startswith("pica.scene.")
    }
    enumerations = {pica.AlphaMode, pica.Wrap}
    assert public == {*VALUES, *METHODS} | MADE_AT_ONCE | NOT_SHOWN | ASSIGNED | enumerations
    for kind, values in VALUES.items():
        assert is_dataclass(kind) and {field.name for field in fields(kind) if field.init} == set(values), kind
    for kind, arguments in METHODS.items():
        taken = inspect.signature(kind.set).parameters if hasattr(kind, "set") else {"self", "particles"}
        assert set(taken) - {"self"} == arguments


class Stage:
    """A scene with a renderer that follows it."""

    def __init__(self, device: pica.rhi.device.Device, scene: Scene, values: pica.Settings = SETTINGS) -> None:
        self.device, self.scene, self.settings = device, scene, values
        self.camera: pica.Camera | None = CAMERA
        self.renderer = pica.Renderer(scene, size=SIZE, settings=values, device=device)

    def picture(self, renderer: pica.Renderer | None = None) -> dict[str, np.ndarray]:
        return buffers((renderer or self.renderer).render(1, camera=self.camera, cut=True))

    def check(self, replaced: Callable[[str, Any], None], values: dict[str, Any]) -> None:
        """Replace one field after the other: what shows does so at once, and all together as in a scene made so."""
        before = self.picture()
        for name, value in values.items():
            replaced(name, value)
            after = self.picture()
            assert bool(differing(before, after)) == (name not in QUIET), name
            before = after
        with pica.Renderer(rebuilt(self.scene), size=SIZE, settings=self.settings, device=self.device) as fresh:
            assert differing(before, self.picture(fresh)) == []
        self.renderer.close()


LIGHTS = [kind for kind in VALUES if kind.__name__.endswith("Light")]


@pytest.mark.parametrize("kind", LIGHTS, ids=lambda kind: kind.__name__)
def test_lights(device, kind):
    shown = Stage(device, stage(), SETTINGS.with_values({"shadows.mode": "soft"}))
    node = shown.scene.roots[-1]
    node.light = kind() if kind is not pica.SpotLight else kind(intensity=5.0)
    node.transform = aim((0.5, 1.2, 1.5), (0, 0, 0))
    named(shown.scene, "floor").lighting_channels = frozenset({0})
    for other in shown.scene.nodes():
        if isinstance(other.light, pica.DirectionalLight) and other is not node:
            other.light = None

    def replaced(name, value):
        node.light = replace(node.light, **{name: value})

    shown.check(replaced, VALUES[kind])


def test_environments(device):
    shown = Stage(device, stage())

    def replaced(name, value):
        shown.scene.environment = replace(shown.scene.environment, **{name: value})

    shown.check(replaced, {"rotation": VALUES[pica.Environment]["rotation"], **VALUES[pica.Environment]})


def test_cameras(device):
    shown = Stage(device, stage())

    def replaced(name, value):
        shown.camera = replace(shown.camera, **{name: value})

    shown.check(replaced, {name: value for name, value in VALUES[pica.Camera].items() if name not in APERTURE})
    shown = Stage(device, stage())
    shown.camera = replace(CAMERA, f_number=0.2, focus_distance=2.5)
    shown.check(replaced, APERTURE)


def test_the_camera_of_a_node(device):
    shown = Stage(device, stage())
    node = shown.scene.add(Node("eye", camera=CAMERA))
    node.transform = CAMERA.transform
    shown.camera = None

    def replaced(name, value):
        node.camera = replace(node.camera, **{name: value})

    shown.check(replaced, LENS)


def test_textures_and_samplers(device):
    scene = stage()
    shown = Stage(device, scene)
    material = named(scene, "box").mesh.sections[0].material
    part = named(scene, "box").mesh.sections[0]
    part.uv1 = part.uv0[:, ::-1] * 0.5
    material.base_color_texture = replace(texture(1), transform=(3.0, 0.0, 0.0, 0.0, 3.0, 0.0))

    def replaced(name, value):
        old = material.base_color_texture
        if name in VALUES[pica.Sampler]:
            material.base_color_texture = replace(old, sampler=replace(old.sampler, **{name: value}))
        else:
            material.base_color_texture = replace(old, **{name: value})

    shown.check(replaced, {**VALUES[pica.Sampler], **VALUES[pica.Texture], "sampler": Sampler(linear=False)})


PARTS = {
    pica.Coat: lambda old, **values: (replace(old[0], **values),),
    **dict.fromkeys((pica.Sheen, pica.Iridescence, pica.Anisotropy), replace),
}


@pytest.mark.parametrize("kind", PARTS, ids=lambda kind: kind.__name__)
def test_layers_of_materials(device, kind):
    scene = stage()
    shown = Stage(device, scene)
    material = named(scene, "ball").mesh.sections[0].material
    field = "coats" if kind is pica.Coat else kind.__name__.lower()
    material.coats = (pica.Coat(strength=0.5, roughness=0.3, absorption=(0.2, 0.2, 0.2), thickness=1.0),)

    def replaced(name, value):
        setattr(material, field, PARTS[kind](getattr(material, field), **{name: value}))

    shown.check(replaced, VALUES[kind])


def test_particles(device):
    scene = stage()
    sprites = pica.Sprites(4, lambert(0.9, double_sided=True))
    scene.add(sprites.node)
    sprites.particles = pica.Particles(np.array([[0, 0.5, 1.0], [0.4, 0.5, 1.0]]), sizes=np.array([0.3]))
    shown = Stage(device, scene)

    def replaced(name, value):
        kept = vars(sprites.particles) | {name: value}
        sprites.particles = pica.Particles(**kept)

    shown.check(replaced, VALUES[pica.Particles])


def test_poses(device):
    scene = stage()
    shown = Stage(device, scene)
    node = named(scene, "box")
    node.pose = pica.Pose()

    def replaced(name, value):
        node.pose = replace(node.pose, **{name: value})

    shown.check(replaced, VALUES[pica.Pose])


def test_what_methods_set(device):
    scene = stage()
    bent = scene.add(placed(box((0.1, 0.2, 1), lambert(0.8, 0.3, 0.8), 0.02), move(0, 0, 0.2), "bent"))
    points = np.array([(-0.9, 0.2, 0.6), (-0.4, 0.4, 0.8), (0.2, 0.2, 0.5), (0.6, 0.3, 0.9)])
    bent.deformer = pica.Spline(points, extent=(-0.5, 0.5))
    cloth = DynamicVertices(scene.add(placed(plane(1, 1, lambert(0.5, double_sided=True), 4), move(0, 0.6, 0))))
    ribbons = pica.Ribbons(1, 4, lambert(0.9, double_sided=True))
    ribbons.set(points[None], 0.1)
    scene.add(ribbons.node)
    given: dict[str, dict[str, Any]] = {
        "spline": {"points": points}, "cloth": {"positions": cloth.positions},
        "ribbon": {"positions": points[None], "widths": 0.1},
    }  # fmt: skip
    setters = {"spline": bent.deformer.set, "cloth": cloth.set, "ribbon": ribbons.set}
    shown = Stage(device, scene)

    def replaced(name, value):
        of, _, argument = name.partition(" ")
        given[of][argument] = value
        setters[of](**given[of])

    shown.check(
        replaced,
        {
            "spline points": points * 1.3, "spline rolls": 1.0, "spline scales": 1.8,
            "cloth positions": cloth.positions * np.float32(1.4),
            "cloth normals": np.tile(np.float32((1.0, 1.0, 0.5)), (cloth.count, 1)),
            "ribbon positions": points[None] * 1.2, "ribbon widths": 0.2, "ribbon colors": (*RED, 1.0),
        },
    )  # fmt: skip


def test_joints_channels_and_landscapes(device):
    """What is made at once is followed as it is moved, played, and replaced by another one."""
    scene = stage()
    joint = scene.add(Node("joint", pose=pica.Pose(translation=(-1.0, 0.7, 0.4))))
    section = box((0.2, 0.5, 0.2), lambert(0.3, 0.6, 0.9))
    count = len(section.positions)
    section = replace(section, joints=np.zeros((count, 1), np.uint16), weights=np.ones((count, 1), np.float32))
    limb = scene.add(placed(section, name="limb"))
    limb.skin = pica.Skin([joint], np.eye(4)[None])
    shown = Stage(device, scene)
    hills: list[pica.Landscape] = []

    def land(heights):
        if hills:
            scene.remove(hills.pop().node)
        hills.append(pica.Landscape(heights, 0.25, lambert(0.4, 0.6, 0.3), patch=8, levels=1))
        scene.add(hills[0].node)

    def play(seconds):
        scene.animations = [
            pica.Animation([pica.Channel(joint, "rotation", [0.0, 1.0], [[0, 0, 0, 1], [0, 0, 0.6, 0.8]])])
        ]
        scene.animate(seconds)

    def paint(color):
        hills[0].material.base_color = color

    acts = {"joint": lambda matrix: setattr(joint, "pose", pica.Pose(matrix)), "play": play, "land": land,
            "land anew": land, "land's material": paint}  # fmt: skip
    low = np.linspace(0.0, 0.3, 81).reshape(9, 9)
    shown.check(
        lambda name, value: acts[name](value),
        {"joint": (-0.6, 0.9, 0.4), "play": 1.0, "land": low, "land anew": low[::-1], "land's material": (*RED, 1.0)},
    )

"""A hybrid real-time ray tracing renderer: a glTF file goes in, a picture close to offline path tracing comes out.

    import pica

    scene = pica.load("model.glb", environment="sky.hdr")
    frame = pica.Renderer(scene, size=(1280, 720)).render(frames=16)
    frame.save("model.png")

The names below are imported when they are first used, so that `import pica` costs next to nothing.
"""

from importlib import import_module

TYPE_CHECKING = False  # as in `typing`, which takes longer to import than all of this
if TYPE_CHECKING:  # for type checkers and editors; a test compares it with _HOME
    from typing import Any

    from pica import color as color
    from pica import errors as errors
    from pica import graph as graph
    from pica import scenes as scenes
    from pica.baking.bake import bake as bake
    from pica.distributed.dataset import dataset as dataset
    from pica.distributed.streaming import torch_dataset as torch_dataset
    from pica.errors import BindingError as BindingError
    from pica.errors import DeviceError as DeviceError
    from pica.errors import GraphError as GraphError
    from pica.errors import MaterialTypeError as MaterialTypeError
    from pica.errors import PicaError as PicaError
    from pica.errors import SceneError as SceneError
    from pica.errors import SettingsError as SettingsError
    from pica.errors import ShaderError as ShaderError
    from pica.errors import ShapeError as ShapeError
    from pica.images.frame_batch import FrameBatch as FrameBatch
    from pica.images.lut import Lut as Lut
    from pica.images.output import Frame as Frame
    from pica.images.pictures import write_labels as write_labels
    from pica.light_map.light_map import LightMap as LightMap
    from pica.path_tracer.path_tracer import PathTracer as PathTracer
    from pica.renderer import Insertion as Insertion
    from pica.renderer import Picked as Picked
    from pica.renderer import Renderer as Renderer
    from pica.renderer import Signals as Signals
    from pica.renderer import compute_pass as compute_pass
    from pica.renderer import ray_pass as ray_pass
    from pica.scene.animation import Animation as Animation
    from pica.scene.animation import Channel as Channel
    from pica.scene.animation import Pose as Pose
    from pica.scene.anisotropy import Anisotropy as Anisotropy
    from pica.scene.camera import Camera as Camera
    from pica.scene.coat import Coat as Coat
    from pica.scene.dynamic_vertices import DynamicVertices as DynamicVertices
    from pica.scene.emitter import Emitter as Emitter
    from pica.scene.environment import Environment as Environment
    from pica.scene.field_channel import FieldChannel as FieldChannel
    from pica.scene.iridescence import Iridescence as Iridescence
    from pica.scene.landscape import Landscape as Landscape
    from pica.scene.light import DirectionalLight as DirectionalLight
    from pica.scene.light import DiskLight as DiskLight
    from pica.scene.light import Light as Light
    from pica.scene.light import PointLight as PointLight
    from pica.scene.light import RectangleLight as RectangleLight
    from pica.scene.light import SphereLight as SphereLight
    from pica.scene.light import SpotLight as SpotLight
    from pica.scene.light import TubeLight as TubeLight
    from pica.scene.limits import Limits as Limits
    from pica.scene.loading import load as load
    from pica.scene.loading import read_exr as read_exr
    from pica.scene.material import AlphaMode as AlphaMode
    from pica.scene.material import Image as Image
    from pica.scene.material import Material as Material
    from pica.scene.material import Sampler as Sampler
    from pica.scene.material import Texture as Texture
    from pica.scene.material import Wrap as Wrap
    from pica.scene.material_registry import register_material as register_material
    from pica.scene.mesh import Mesh as Mesh
    from pica.scene.mesh import Section as Section
    from pica.scene.model import Scene as Scene
    from pica.scene.node import Node as Node
    from pica.scene.particles import Particles as Particles
    from pica.scene.particles import Ribbons as Ribbons
    from pica.scene.particles import Sprites as Sprites
    from pica.scene.primitives import Primitives as Primitives
    from pica.scene.primitives import capsules as capsules
    from pica.scene.primitives import rounded_boxes as rounded_boxes
    from pica.scene.primitives import spheres as spheres
    from pica.scene.primitives import tori as tori
    from pica.scene.scene_views import SceneViews as SceneViews
    from pica.scene.shape_registry import register_shape as register_shape
    from pica.scene.sheen import Sheen as Sheen
    from pica.scene.skin import Skin as Skin
    from pica.scene.spline import Spline as Spline
    from pica.scene.spline import bend as bend
    from pica.scene.sun import sky as sky
    from pica.scene.sun import sun_position as sun_position
    from pica.settings import AmbientOcclusionSettings as AmbientOcclusionSettings
    from pica.settings import AntialiasingSettings as AntialiasingSettings
    from pica.settings import DebugSettings as DebugSettings
    from pica.settings import GlobalIlluminationSettings as GlobalIlluminationSettings
    from pica.settings import LightingSettings as LightingSettings
    from pica.settings import PostSettings as PostSettings
    from pica.settings import RaysSettings as RaysSettings
    from pica.settings import ReflectionsSettings as ReflectionsSettings
    from pica.settings import Settings as Settings
    from pica.settings import ShadowMapsSettings as ShadowMapsSettings
    from pica.settings import ShadowsSettings as ShadowsSettings
    from pica.settings import TranslucencySettings as TranslucencySettings
    from pica.settings import TransparencySettings as TransparencySettings
    from pica.settings import VisibilitySettings as VisibilitySettings
    from pica.viewer.live import view as view

__version__ = "0.1.0"

_MODULES = ("color", "errors", "graph", "scenes")
_PUBLIC = {
    "pica.baking.bake": ("bake",),
    "pica.distributed.dataset": ("dataset",),
    "pica.distributed.streaming": ("torch_dataset",),
    "pica.errors": (
        "BindingError",
        "DeviceError",
        "GraphError",
        "MaterialTypeError",
        "PicaError",
        "SceneError",
        "SettingsError",
        "ShaderError",
        "ShapeError",
    ),
    "pica.light_map.light_map": ("LightMap",),
    "pica.images.frame_batch": ("FrameBatch",),
    "pica.images.lut": ("Lut",),
    "pica.images.output": ("Frame",),
    "pica.path_tracer.path_tracer": ("PathTracer",),
    "pica.images.pictures": ("write_labels",),
    "pica.renderer": ("Insertion", "Picked", "Renderer", "Signals", "compute_pass", "ray_pass"),
    "pica.scene.animation": ("Animation", "Channel", "Pose"),
    "pica.scene.anisotropy": ("Anisotropy",),
    "pica.scene.camera": ("Camera",),
    "pica.scene.coat": ("Coat",),
    "pica.scene.dynamic_vertices": ("DynamicVertices",),
    "pica.scene.emitter": ("Emitter",),
    "pica.scene.environment": ("Environment",),
    "pica.scene.field_channel": ("FieldChannel",),
    "pica.scene.iridescence": ("Iridescence",),
    "pica.scene.landscape": ("Landscape",),
    "pica.scene.light": (
        "DirectionalLight",
        "DiskLight",
        "Light",
        "PointLight",
        "RectangleLight",
        "SphereLight",
        "SpotLight",
        "TubeLight",
    ),
    "pica.scene.limits": ("Limits",),
    "pica.scene.loading": ("load", "read_exr"),
    "pica.scene.material": ("AlphaMode", "Image", "Material", "Sampler", "Texture", "Wrap"),
    "pica.scene.material_registry": ("register_material",),
    "pica.scene.mesh": ("Mesh", "Section"),
    "pica.scene.model": ("Scene",),
    "pica.scene.node": ("Node",),
    "pica.scene.particles": ("Particles", "Ribbons", "Sprites"),
    "pica.scene.primitives": ("Primitives", "capsules", "rounded_boxes", "spheres", "tori"),
    "pica.scene.scene_views": ("SceneViews",),
    "pica.scene.shape_registry": ("register_shape",),
    "pica.scene.sheen": ("Sheen",),
    "pica.scene.skin": ("Skin",),
    "pica.scene.spline": ("Spline", "bend"),
    "pica.scene.sun": ("sky", "sun_position"),
    "pica.settings": (
        "AmbientOcclusionSettings",
        "AntialiasingSettings",
        "DebugSettings",
        "GlobalIlluminationSettings",
        "LightingSettings",
        "PostSettings",
        "RaysSettings",
        "ReflectionsSettings",
        "Settings",
        "ShadowMapsSettings",
        "ShadowsSettings",
        "TranslucencySettings",
        "TransparencySettings",
        "VisibilitySettings",
    ),
    "pica.viewer.live": ("view",),
}
_HOME = {name: module for module, names in _PUBLIC.items() for name in names}
__all__ = sorted([*_HOME, *_MODULES, "__version__"])

if not TYPE_CHECKING:  # type checkers must see no other names

    def __getattr__(name: str) -> "Any":
        """The public name, from its module. Raises AttributeError for any other."""
        if name in _MODULES:
            value = import_module(f"pica.{name}")
        elif name in _HOME:
            value = getattr(import_module(_HOME[name]), name)
        else:
            raise AttributeError(f"module 'pica' has no attribute {name!r}")
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    return __all__

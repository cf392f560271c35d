"""A hybrid real-time ray tracing renderer: a glTF file goes in, a picture close to offline path tracing comes out.

    import pica

    scene = pica.load("model.glb", environment="sky.hdr")
    frame = pica.Renderer(scene, size=(1280, 720)).render(frames=16)
    frame.save("model.png")

The names below are imported when they are first used, so that `import pica` costs next to nothing.
"""

from importlib import import_module

TYPE_CHECKING = False  # as in `typing`, which takes longer to import than all of this
if TYPE_CHECKING:
    from typing import Any

    from pica import errors, scenes
    from pica.baking.bake import bake
    from pica.errors import (
        BindingError,
        DeviceError,
        MaterialTypeError,
        PicaError,
        SceneError,
        SettingsError,
        ShapeError,
    )
    from pica.light_map.light_map import LightMap
    from pica.output import Frame
    from pica.path_tracer.path_tracer import PathTracer
    from pica.pictures import write_labels
    from pica.renderer import Renderer
    from pica.scene.camera import Camera
    from pica.scene.dynamic_vertices import DynamicVertices
    from pica.scene.environment import Environment
    from pica.scene.limits import Limits
    from pica.scene.loading import load, read_exr
    from pica.scene.material import Material
    from pica.scene.material_registry import register_material
    from pica.scene.model import Scene
    from pica.scene.primitives import Primitives
    from pica.scene.shape_registry import register_shape
    from pica.settings import Settings

__all__ = [
    "BindingError",
    "Camera",
    "DeviceError",
    "DynamicVertices",
    "Environment",
    "Frame",
    "LightMap",
    "Limits",
    "Material",
    "MaterialTypeError",
    "PathTracer",
    "PicaError",
    "Primitives",
    "Renderer",
    "Scene",
    "SceneError",
    "Settings",
    "SettingsError",
    "ShapeError",
    "bake",
    "errors",
    "load",
    "read_exr",
    "register_material",
    "register_shape",
    "scenes",
    "write_labels",
]

_HOME = {
    "BindingError": "pica.errors",
    "Camera": "pica.scene.camera",
    "DeviceError": "pica.errors",
    "DynamicVertices": "pica.scene.dynamic_vertices",
    "Environment": "pica.scene.environment",
    "Frame": "pica.output",
    "LightMap": "pica.light_map.light_map",
    "Limits": "pica.scene.limits",
    "Material": "pica.scene.material",
    "MaterialTypeError": "pica.errors",
    "PathTracer": "pica.path_tracer.path_tracer",
    "PicaError": "pica.errors",
    "Primitives": "pica.scene.primitives",
    "Renderer": "pica.renderer",
    "Scene": "pica.scene.model",
    "SceneError": "pica.errors",
    "Settings": "pica.settings",
    "SettingsError": "pica.errors",
    "ShapeError": "pica.errors",
    "bake": "pica.baking.bake",
    "load": "pica.scene.loading",
    "read_exr": "pica.scene.loading",
    "register_material": "pica.scene.material_registry",
    "register_shape": "pica.scene.shape_registry",
    "write_labels": "pica.pictures",
}
_MODULES = ("errors", "scenes")


def __getattr__(name: str) -> "Any":
    if name in _MODULES:
        value: Any = import_module(f"pica.{name}")
    elif name in _HOME:
        value = getattr(import_module(_HOME[name]), name)
    else:
        raise AttributeError(f"module 'pica' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__

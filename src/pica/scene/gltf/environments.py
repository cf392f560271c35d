"""Environment and background in the extras of a scene, as glTF has neither (docs/guide/gltf.md)."""

from pica.scene.environment import Environment
from pica.scene.gltf.accessors import read_floats
from pica.scene.gltf.container import Document
from pica.scene.gltf.element import Element
from pica.scene.light import Color
from pica.scene.values import BRIGHTEST


def read_environment(document: Document, scene: Element | None) -> Environment | None:
    """The environment of a scene of the file; None if it has none. Raises SceneError."""
    if scene is None or "environment" not in scene.pica:
        return None
    return _environment(document, scene.pica.object("environment"))


def _environment(document: Document, entry: Element) -> Environment:
    radiance = read_floats(document, entry, "radiance", ("VEC3",))
    width = entry.integer("width", low=1)
    if len(radiance) % width:
        raise entry.fault(f"{len(radiance)} pixels are no rows of {width}", "width")
    document.take(entry, pixels=len(radiance))
    return entry.apply(
        Environment,
        radiance.reshape(-1, width, 3),
        strength=entry.number("strength", low=0, default=1.0),
        rotation=entry.number("rotation", default=0.0),
        name=entry.name,
    )


def read_background(document: Document, scene: Element | None) -> Color | Environment | None:
    """Scene.background of a scene of the file; None if it has none. Raises SceneError."""
    if scene is None or "background" not in scene.pica:
        return None
    if type(scene.pica.values["background"]) is dict:
        return _environment(document, scene.pica.object("background"))
    red, green, blue = scene.pica.numbers("background", 3, 0, BRIGHTEST)
    return red, green, blue

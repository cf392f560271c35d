"""What a scene holds, counted."""

from collections import Counter
from typing import Any

from pica.scene.material import Image, Material, Texture
from pica.scene.model import Mesh, Scene


def contents(scene: Scene) -> dict[str, Any]:
    """Counts and names of the scene's content, as JSON has them; sizes in metres, times in seconds.

    "triangles" and "vertices" count each mesh once, "triangles_shown" each of its instances.
    """
    nodes = list(scene.nodes())
    low, high = scene.bounds()
    shown = [(node.mesh, 1 if node.instances is None else len(node.instances)) for node in nodes if node.mesh]
    meshes = list(dict.fromkeys(mesh for mesh, _ in shown))
    sections = [section for mesh in meshes for section in mesh.sections]
    lights = Counter(type(node.light).__name__.removesuffix("Light").lower() for node in nodes if node.light)
    return {
        "size": [float(length) for length in high - low],
        "nodes": len(nodes),
        "meshes": len(meshes),
        "instances": sum(count for _, count in shown),
        "vertices": sum(len(section.positions) for section in sections),
        "triangles": sum(len(section.indices) for section in sections),
        "triangles_shown": scene.triangle_count(),
        "primitives": sum(len(primitives) for mesh in meshes for primitives in mesh.primitives),
        "materials": len(materials_of(meshes)),
        "textures": [_texture(image) for image in images_of(meshes)],
        "lights": dict(lights),
        "environment": None if scene.environment is None else _environment(scene),
        "cameras": [camera.name for camera in scene.cameras()],
        "skins": len({node.skin for node in nodes if node.skin is not None}),
        "morph_targets": sum(mesh.target_count for mesh in meshes),
        "animations": [{"name": each.name, "seconds": float(each.duration)} for each in scene.animations],
        "variants": list(scene.variants),
    }


def materials_of(meshes: list[Mesh]) -> list[Material]:
    """The materials of meshes, each once."""
    return list(dict.fromkeys(part.material for mesh in meshes for part in mesh.parts))


def textures_of(material: Material) -> dict[str, Texture]:
    """The textures of a material by the names of its fields."""
    return {name: value for name, value in vars(material).items() if isinstance(value, Texture)}


def images_of(meshes: list[Mesh]) -> list[Image]:
    """The images of meshes' textures, each once."""
    textures = (texture for material in materials_of(meshes) for texture in textures_of(material).values())
    return list(dict.fromkeys(texture.image for texture in textures))


def _texture(image: Image) -> dict[str, Any]:
    width, height = image.size
    return {
        "name": image.name,
        "width": width,
        "height": height,
        "file_format": image.file_format,
        "device_format": "RGBA8" if image.blocks is None else image.blocks.form,
    }


def _environment(scene: Scene) -> dict[str, Any]:
    assert scene.environment is not None
    height, width, _ = scene.environment.radiance.shape
    return {"name": scene.environment.name, "width": width, "height": height}

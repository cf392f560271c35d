"""The device memory that a scene will take, estimated without a device."""

from pica.gpu_scene.geometry_store import VERTEX
from pica.gpu_scene.materials import is_srgb
from pica.gpu_scene.primitive_buffers import BOX
from pica.gpu_scene.table_rows import INSTANCE
from pica.scene.contents import materials_of, textures_of
from pica.scene.material import Image
from pica.scene.model import Mesh, Scene

_POSITION = _TRIANGLE = 12
_STRUCTURE_TRIANGLE, _STRUCTURE_INSTANCE = 104, 240
"""Bytes of acceleration structures, as measured with lavapipe; graphics cards differ, and compact theirs."""


def estimated_memory(scene: Scene) -> dict[str, int]:
    """Bytes of device memory by kind; without the pictures of views, which depend on their size and settings.

    Textures count as on devices that sample BC7.
    """
    placed = [(node.mesh, node, 1 if node.instances is None else len(node.instances)) for node in scene.nodes()]
    shown = [(mesh, node, count) for mesh, node, count in placed if mesh is not None]
    rigid = list(dict.fromkeys(mesh for mesh, node, _ in shown if not node.deforms))
    deforming = [mesh for mesh, node, _ in shown if node.deforms]
    meshes = [*rigid, *deforming]
    instances = sum(count * max(len(mesh.parts), 1) for mesh, _, count in shown)
    vertex = _POSITION + VERTEX.itemsize
    # Deforming meshes have vertices for each node, those before deformation, and previous positions.
    vertices = _vertices(rigid) * vertex + _vertices(deforming) * (2 * vertex + _POSITION)
    elements = sum(_elements(mesh) for mesh in meshes)
    return {
        "geometry": vertices + _TRIANGLE * _triangles(meshes) + BOX.itemsize * (elements - _triangles(meshes)),
        "acceleration_structures": _STRUCTURE_TRIANGLE * elements + _STRUCTURE_INSTANCE * instances,
        "instances": INSTANCE.itemsize * instances,
        "textures": _textures(list(dict.fromkeys(meshes))),
        "environment": _environment(scene),
    }


def _vertices(meshes: list[Mesh]) -> int:
    return sum(len(section.positions) for mesh in meshes for section in mesh.sections)


def _triangles(meshes: list[Mesh]) -> int:
    return sum(len(section.indices) for mesh in meshes for section in mesh.sections)


def _elements(mesh: Mesh) -> int:
    """Triangles, and boxes of other primitives."""
    return _triangles([mesh]) + sum(len(primitives) for primitives in mesh.primitives)


def _textures(meshes: list[Mesh]) -> int:
    """An image that is read as sRGB and as linear is uploaded twice."""
    used = {
        (texture.image, is_srgb(texture.image, name.removesuffix("_texture")))
        for material in materials_of(meshes)
        for name, texture in textures_of(material).items()
    }
    return sum(_image_bytes(image) for image, _ in used)


def _image_bytes(image: Image) -> int:
    if image.blocks is not None:
        return sum(level.nbytes for level in image.blocks.levels)
    width, height = image.size
    levels = range(max(width, height).bit_length())
    return sum(4 * max(width >> level, 1) * max(height >> level, 1) for level in levels)


def _environment(scene: Scene) -> int:
    """Texels of four 32-bit floats, and a table of as many numbers to sample it by."""
    if scene.environment is None:
        return 0
    height, width, _ = scene.environment.radiance.shape
    return (16 + 4) * height * width

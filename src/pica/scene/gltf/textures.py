"""Images, samplers and textures, and how materials refer to them (3.8)."""

import math
from pathlib import Path
from typing import Any

import pygltflib

from pica import pictures
from pica.errors import SceneError
from pica.scene.gltf.checks import choice, extension, number, numbers, shown, text, whole
from pica.scene.gltf.container import Document, read_file
from pica.scene.material import Image, Sampler, Texture, Wrap

_WRAPS = {33071: Wrap.CLAMP_TO_EDGE, 33648: Wrap.MIRRORED_REPEAT, 10497: Wrap.REPEAT}
_MAG_FILTERS = {9728: False, 9729: True}
_UNREADABLE_SUFFIXES = {"image/ktx2": ".ktx2", "image/vnd-ms.dds": ".dds", "image/avif": ".avif"}
"""Picture formats that extensions bring in and that are left out with a warning."""

UV_SETS = 2


class Textures:
    """The textures of a file; each image is decoded once, when first used."""

    def __init__(self, document: Document) -> None:
        self._document = document
        self._images: dict[int, Image | None] = {}

    def get(self, info: Any, where: str) -> Texture | None:
        """The texture that a texture info refers to; None, with a warning, where its format cannot be read."""
        if info is None:
            return None
        texture = self._document.item("textures", info.index, where)
        name = f"textures[{info.index}]"
        image = self._image(texture, name)
        transform = extension(info, "KHR_texture_transform", where) or {}
        uv_set = transform.get("texCoord", info.texCoord)
        uv_set = whole(uv_set, f"{where}.texCoord", default=0)
        if uv_set >= UV_SETS:
            self._document.warn(f"{where}: left out, it uses TEXCOORD_{uv_set}; only 0 and 1 are read")
            return None
        if image is None:
            return None
        return Texture(image, self._sampler(texture.sampler, name), uv_set, _matrix(transform, where))

    def from_json(self, info: object, where: str) -> Texture | None:
        """The same for a texture info inside an extension."""
        if info is None:
            return None
        if not isinstance(info, dict):
            raise SceneError(f"{where}: {shown(info)} is not an object")
        return self.get(pygltflib.TextureInfo.from_dict(info, infer_missing=True), where)

    def _sampler(self, index: object, where: str) -> Sampler:
        if index is None:
            return Sampler()
        sampler = self._document.item("samplers", index, where)
        name = f"samplers[{index}]"
        return Sampler(
            wrap_u=choice(sampler.wrapS, f"{name}.wrapS", _WRAPS),
            wrap_v=choice(sampler.wrapT, f"{name}.wrapT", _WRAPS),
            linear=sampler.magFilter is None or choice(sampler.magFilter, f"{name}.magFilter", _MAG_FILTERS),
        )

    def _image(self, texture: Any, where: str) -> Image | None:
        webp = extension(texture, "EXT_texture_webp", where)
        source = texture.source if webp is None else webp.get("source")
        if source is None:
            self._document.warn(f"{where}: left out, it has no picture of a format that can be read")
            return None
        entry = self._document.item("images", source, where)
        if source not in self._images:
            self._images[source] = self._decoded(entry, f"images[{source}]")
        return self._images[source]

    def _decoded(self, entry: Any, where: str) -> Image | None:
        suffix = Path(entry.uri).suffix.lower() if isinstance(entry.uri, str) and len(entry.uri) < 4096 else ""
        if entry.mimeType in _UNREADABLE_SUFFIXES or suffix in _UNREADABLE_SUFFIXES.values():
            self._document.warn(f"{where}: left out, {entry.mimeType or suffix} cannot be read")
            return None
        name = text(entry.name)
        if entry.bufferView is not None:
            return Image(pictures.read_image(bytes(self._document.view(entry.bufferView, where)[0]), where), name)
        if entry.uri is None:
            raise SceneError(f"{where}: has neither a uri nor a buffer view")
        source = self._document.resolve(entry.uri, where)
        if isinstance(source, bytes):
            return Image(pictures.read_image(source, where), name)
        label = f"{where}.uri: {shown(entry.uri)}"
        return Image(pictures.read_image(read_file(source, label), label), name or source.stem)


def _matrix(transform: dict[str, Any], where: str) -> tuple[float, float, float, float, float, float]:
    """Rows of the matrix that moves texture coordinates."""
    # KHR_texture_transform: translation * rotation * scale. The rotation is counter-clockwise as seen with v
    # down, which is what the extension's example and Khronos' TextureTransformTest show.
    where = f"{where}.extensions.KHR_texture_transform"
    shift_u, shift_v = numbers(transform.get("offset"), 2, f"{where}.offset", default=(0.0, 0.0))
    scale_u, scale_v = numbers(transform.get("scale"), 2, f"{where}.scale", default=(1.0, 1.0))
    angle = number(transform.get("rotation"), f"{where}.rotation", default=0.0)
    cosine, sine = math.cos(angle), math.sin(angle)
    return (cosine * scale_u, sine * scale_v, shift_u, -sine * scale_u, cosine * scale_v, shift_v)

"""Images, samplers and textures, and how materials refer to them (3.8)."""

import math
from collections.abc import Iterable, Iterator
from typing import Any

from pica.images.blocks import BlockPicture
from pica.images.ktx2 import UnsupportedPictureError
from pica.scene.construction import unchecked_constructor
from pica.scene.gltf.container import Document
from pica.scene.gltf.element import Element
from pica.scene.gltf.pictures import EncodedPicture, Pictures, file_of
from pica.scene.gltf.texture_places import SPECULAR_GLOSSINESS, SPECULAR_GLOSSINESS_TEXTURES, TEXTURES
from pica.scene.material import Encoding, Image, Sampler, Texture, Wrap

_WRAPS = {33071: Wrap.CLAMP_TO_EDGE, 33648: Wrap.MIRRORED_REPEAT, 10497: Wrap.REPEAT}
_MAG_FILTERS = {9728: False, 9729: True}
_EXTENSIONS = ("KHR_texture_basisu", "EXT_texture_avif", "EXT_texture_webp")
"""Other formats, in this order and before the texture's own picture."""
_DDS = "MSFT_texture_dds"
"""After it: block compressed colours, made of it, have no advantage once they are pixels."""

UV_SETS = 0, 1
"""Texture coordinates of most materials: what `uv0` and `uv1` of sections hold."""
_PLACES = tuple(tuple(place.split("/")) for place in [*TEXTURES, *SPECULAR_GLOSSINESS_TEXTURES])
_PLACING = {"texCoord", "extensions", "extras"}
"""Keys of texture infos for texture coordinates."""
_DEFAULT_SAMPLER = Sampler()
_ENCODINGS: dict[str, Encoding] = {"srgb": "srgb", "linear": "linear"}
_LARGE = 1 << 16
"""Bytes of a picture that is worth a thread."""
_plain_texture = unchecked_constructor(Texture)


class Textures:
    """The textures of a file; each picture is decoded once, at first use, even under several names."""

    def __init__(self, document: Document) -> None:
        self._document = document
        self._images: dict[Element, Image | None] = {}
        self._samplers: dict[Element, Sampler] = {}
        self._by_content: dict[tuple[EncodedPicture, Encoding | None], Image] = {}
        self._pictures = Pictures(document)
        self.uv_sets = UV_SETS
        """Those of the material whose textures are read."""

    def get(self, owner: Element, key: str) -> Texture | None:
        """The texture of the texture info under `key`; None, with a warning, where its format cannot be read."""
        if key not in owner:
            return None
        info = owner.object(key)
        entry = info.reference("index", self._document.entries("textures"))
        image = self._image(entry)
        if image is not None and not info.values.keys() & _PLACING:  # as nearly all
            return _plain_texture(image=image, sampler=self._sampler(entry))
        transform = info.extension("KHR_texture_transform")
        uv_set = transform.integer("texCoord", default=info.integer("texCoord", default=0))
        if uv_set not in self.uv_sets:
            read = " and ".join(map(str, self.uv_sets))
            self._document.warn(f"{info.place()}: left out, it uses TEXCOORD_{uv_set}; of its material {read} are read")
            return None
        if image is None:
            return None
        matrix = info.pica.numbers("transform", 6) if "transform" in info.pica else _matrix(transform)
        return info.apply(Texture, image, self._sampler(entry), self.uv_sets.index(uv_set), matrix)

    def _sampler(self, texture: Element) -> Sampler:
        if "sampler" not in texture:
            return _DEFAULT_SAMPLER
        entry = texture.reference("sampler", self._document.entries("samplers"))
        if entry not in self._samplers:
            self._samplers[entry] = Sampler(
                wrap_u=entry.choice("wrapS", _WRAPS, default=Wrap.REPEAT),
                wrap_v=entry.choice("wrapT", _WRAPS, default=Wrap.REPEAT),
                linear=entry.choice("magFilter", _MAG_FILTERS, default=True),
            )
        return self._samplers[entry]

    def expect(self, materials: Iterable[Element]) -> None:
        """Begin to decode large pictures of materials, in as many threads as there are cores."""
        textures = self._document.entries("textures")
        used = dict.fromkeys(row for material in materials for row in _texture_rows(material))
        sources = (self._sources(textures[row]) for row in used if 0 <= row < len(textures))
        large = [entry for entry in dict.fromkeys(each[0] for each in sources if each) if self._is_large(entry)]
        if len(large) > 1:
            self._pictures.begin(large)

    def _is_large(self, entry: Element) -> bool:
        view, views = entry.values.get("bufferView"), self._document.entries("bufferViews")
        if type(view) is not int or not 0 <= view < len(views):
            return "uri" in entry
        length = views[view].values.get("byteLength")
        return type(length) is int and length >= _LARGE

    def _sources(self, texture: Element) -> list[Element]:
        """The texture's pictures, the preferred one first."""
        holders = [texture.extension(name) for name in _EXTENSIONS if texture.has_extension(name)]
        holders += [texture, texture.extension(_DDS)]
        images = self._document.entries("images")
        return [holder.reference("source", images) for holder in holders if "source" in holder]

    def _image(self, texture: Element) -> Image | None:
        """The first of the texture's pictures that can be read."""
        entries = self._sources(texture)
        for entry in entries:
            if entry not in self._images:
                self._images[entry] = self._decoded(entry)
            if self._images[entry] is not None:
                return self._images[entry]
        if not entries:
            self._document.warn(f"{texture.place()}: left out, it has no picture of a format that can be read")
        return None

    def _decoded(self, entry: Element) -> Image | None:
        encoding = entry.pica.choice("encoding", _ENCODINGS) if "encoding" in entry.pica else None
        encoded, decode = self._pictures.get(entry)
        key = encoded, encoding
        if key not in self._by_content:
            try:
                picture = decode()
            except UnsupportedPictureError as error:
                self._document.warn(f"{error}; left out")
                return None
            name = entry.name or file_of(entry).stem
            if isinstance(picture, BlockPicture):
                image = Image.of_blocks(picture, name, "linear" if picture.is_float else encoding)
            else:
                image = entry.apply(Image, picture, name, encoding)
            image._file_format = encoded.file_format
            self._by_content[key] = image
        return self._by_content[key]


def uv_sets_of(material: Element) -> tuple[int, int]:
    """The two sets of texture coordinates that a material's first textures use; 0 and 1 if no other is used."""
    used: dict[int, None] = {}
    for _, info in _texture_infos(material):
        if info.keys() & _PLACING:
            extensions = info.get("extensions")
            moved = extensions.get("KHR_texture_transform") if type(extensions) is dict else None
            number = (moved if type(moved) is dict and "texCoord" in moved else info).get("texCoord", 0)
        else:
            number = 0
        if type(number) is int and number >= 0:
            used[number] = None
    if all(number in UV_SETS for number in used):
        return UV_SETS
    first, second = sorted([*used, *(number for number in UV_SETS if number not in used)][:2])
    return first, second


def _texture_rows(material: Element) -> Iterator[int]:
    """The indices of textures in a material; faults are left to their readers."""
    converts = material.has_extension(SPECULAR_GLOSSINESS)
    for place, info in _texture_infos(material):
        row = info.get("index")
        if type(row) is int and not (converts and place[0] == "pbrMetallicRoughness"):
            yield row


def _texture_infos(material: Element) -> Iterator[tuple[tuple[str, ...], dict[str, Any]]]:
    """Places and contents of a material's texture infos, unchecked."""
    for place in _PLACES:
        value: Any = material.values
        for key in place:
            value = value.get(key) if type(value) is dict else None
        if type(value) is dict:
            yield place, value


def _matrix(transform: Element) -> tuple[float, float, float, float, float, float]:
    """Rows of the matrix that moves texture coordinates, of a KHR_texture_transform."""
    shift_u, shift_v = transform.numbers("offset", 2, default=(0.0, 0.0))
    scale_u, scale_v = transform.numbers("scale", 2, default=(1.0, 1.0))
    return transform_matrix(shift_u, shift_v, transform.number("rotation", default=0.0), scale_u, scale_v)


def transform_matrix(
    shift_u: float, shift_v: float, angle: float, scale_u: float, scale_v: float
) -> tuple[float, float, float, float, float, float]:
    """Rows of the matrix of a KHR_texture_transform."""
    # KHR_texture_transform: translation * rotation * scale. The rotation is counter-clockwise as seen with v
    # down, which is what the extension's example and Khronos' TextureTransformTest show.
    cosine, sine = math.cos(angle), math.sin(angle)
    return (cosine * scale_u, sine * scale_v, shift_u, -sine * scale_u, cosine * scale_v, shift_v)

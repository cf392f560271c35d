"""Images, samplers and textures, and how materials refer to them (3.8)."""

import math
from hashlib import sha256
from typing import Any

from pica.images.pictures import encoded_png
from pica.scene.gltf.textures import transform_matrix
from pica.scene.gltf_export.container import Asset, differing
from pica.scene.material import Image, Sampler, Texture, Wrap

_WRAPS = {Wrap.CLAMP_TO_EDGE: 33071, Wrap.MIRRORED_REPEAT: 33648, Wrap.REPEAT: 10497}
_NEAREST = 9728
_IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)


class Textures:
    """The textures of a file; pictures of the same pixels are written once."""

    def __init__(self, asset: Asset) -> None:
        self._asset = asset
        self._images: dict[Any, int] = {}
        self._by_object: dict[Image, int] = {}

    def info(self, texture: Texture | None, **more: Any) -> dict[str, Any] | None:
        """A texture info, with more keys; None without a texture."""
        if texture is None:
            return None
        entry = {"source": self._image(texture.image), "sampler": self._sampler(texture.sampler)}
        info: dict[str, Any] = {"index": self._asset.add_once("textures", entry)} | more
        info |= differing(texCoord=(texture.uv_set, 0))
        if texture.transform != _IDENTITY:
            placed, exact = _transform(texture.transform)
            info["extensions"] = self._asset.extensions(KHR_texture_transform=placed)
            if not exact:
                info["extras"] = {"pica": {"transform": texture.transform}}
        return info

    def _sampler(self, sampler: Sampler) -> int | None:
        if sampler == Sampler():
            return None
        entry = {"wrapS": _WRAPS[sampler.wrap_u], "wrapT": _WRAPS[sampler.wrap_v]}
        if not sampler.linear:
            entry |= {"magFilter": _NEAREST, "minFilter": _NEAREST}
        return self._asset.add_once("samplers", entry)

    def _image(self, image: Image) -> int:
        if image in self._by_object:
            return self._by_object[image]
        pixels = image.pixels
        key = sha256(pixels.tobytes()).digest(), pixels.shape, image.encoding
        if key not in self._images:
            opaque = bool((pixels[..., 3] == 255).all())
            place, name = self._asset.picture(encoded_png(pixels[..., :3] if opaque else pixels))
            extras = self._asset.extras({}, {"encoding": image.encoding})
            self._images[key] = self._asset.add("images", {"name": image.name or name, **place, "extras": extras})
        self._by_object[image] = self._images[key]
        return self._by_object[image]


def _transform(matrix: tuple[float, ...]) -> tuple[dict[str, Any], bool]:
    """A KHR_texture_transform, and whether it is the whole matrix, to the last digit."""
    a, b, shift_u, c, d, shift_v = matrix
    if b == c == 0:
        angle, scale_u, scale_v = 0.0, a, d
    else:
        angle = math.atan2(-c, a)
        scale_u, scale_v = math.hypot(a, c), d * math.cos(angle) + b * math.sin(angle)
    placed = differing(
        offset=((shift_u, shift_v), (0.0, 0.0)), rotation=(angle, 0.0), scale=((scale_u, scale_v), (1.0, 1.0))
    )
    return placed, transform_matrix(shift_u, shift_v, angle, scale_u, scale_v) == matrix

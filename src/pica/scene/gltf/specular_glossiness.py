"""KHR_materials_pbrSpecularGlossiness, converted to metallic-roughness as Khronos' example does it.

That is extensions/2.0/Archived/KHR_materials_pbrSpecularGlossiness/examples/convert-between-workflows-bjs of
https://github.com/KhronosGroup/glTF: metallic is solved from the brightness of the diffuse and the specular colour, and
0.04 is the reflectance of what is not metallic.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.color import srgb_decode, srgb_encode
from pica.scene.gltf.container import Document
from pica.scene.gltf.element import Element
from pica.scene.gltf.texture_places import SPECULAR_GLOSSINESS
from pica.scene.gltf.textures import Textures
from pica.scene.light import WHITE
from pica.scene.material import Image, Texture

Colors = NDArray[np.float32]

_DIELECTRIC = np.float32(0.04)
_EPSILON = np.float32(1e-6)
_BRIGHTNESS = np.array([0.299, 0.587, 0.114], np.float32)
"""Weights of squared channels in perceived brightness."""
_STRIP = 1 << 16
"""Pixels that are converted at once."""
_LINEAR = srgb_decode(np.arange(256) / 255)
"""Of the values of a texel."""


def metallic_roughness(document: Document, textures: Textures, entry: Element) -> dict[str, Any]:
    """Base colour, metallic and roughness as Material has them, of a material with the extension. Raises SceneError."""
    extension = entry.extension(SPECULAR_GLOSSINESS)
    factors = np.array(extension.numbers("diffuseFactor", 4, 0, 1, (1.0, 1.0, 1.0, 1.0)), np.float32)
    specular = np.array(extension.numbers("specularFactor", 3, 0, 1, WHITE), np.float32)
    glossiness = np.float32(extension.number("glossinessFactor", 0, 1, 1.0))
    first, second = textures.get(extension, "diffuseTexture"), textures.get(extension, "specularGlossinessTexture")
    placed = first or second
    if placed is None:
        color, metallic = converted(factors[:3], specular)
        red, green, blue = color.tolist()
        values = {"base_color": (red, green, blue, float(factors[3])), "metallic": float(metallic)}
        return values | {"roughness": float(1 - glossiness)}
    if first is not None and second is not None and _placing(first) != _placing(second):
        document.warn(f"{extension.place('specularGlossinessTexture')}: placed as the diffuse texture is")
    sources = [None if texture is None else texture.image.pixels for texture in (first, second)]
    shapes = [pixels.shape for pixels in sources if pixels is not None]
    height, width = max(shape[0] for shape in shapes), max(shape[1] for shape in shapes)
    document.take(extension, pixels=2 * height * width, bytes=8 * height * width)
    base, packed = (np.empty((height, width, 4), np.uint8) for _ in range(2))
    rows = max(_STRIP // width, 1)
    for top in range(0, height, rows):
        strip = slice(top, min(top + rows, height))
        diffuse, specular_glossiness = (_resampled(pixels, strip, height, width) for pixels in sources)
        color, metallic = converted(
            _LINEAR[diffuse[..., :3]] * factors[:3], _LINEAR[specular_glossiness[..., :3]] * specular
        )
        base[strip, :, :3], base[strip, :, 3] = _eight_bits(srgb_encode(color)), diffuse[..., 3]
        packed[strip] = 255
        packed[strip, :, 1] = _eight_bits(1 - glossiness * specular_glossiness[..., 3].astype(np.float32) / 255)
        packed[strip, :, 2] = _eight_bits(metallic)
    made = (Texture(Image(pixels, placed.image.name), *_placing(placed)) for pixels in (base, packed))
    return {
        "base_color": (1.0, 1.0, 1.0, float(factors[3])),
        "metallic": 1.0,
        "roughness": 1.0,
        **dict(zip(("base_color_texture", "metallic_roughness_texture"), made, strict=True)),
    }


def converted(diffuse: Colors, specular: Colors) -> tuple[Colors, Colors]:
    """(..., 3) base colours and (...) metallic, of linear diffuse and specular colours."""
    rest = 1 - specular.max(axis=-1)
    metallic = _metallic(_brightness(diffuse), _brightness(specular), rest)
    shares = metallic[..., None]
    of_diffuse = diffuse * (rest[..., None] / (1 - _DIELECTRIC) / np.maximum(1 - shares, _EPSILON))
    of_specular = (specular - _DIELECTRIC * (1 - shares)) / np.maximum(shares, _EPSILON)
    return np.clip(of_diffuse + (of_specular - of_diffuse) * shares**2, 0, 1), metallic


def _metallic(diffuse: Colors, specular: Colors, rest: Colors) -> Colors:
    b = diffuse * rest / (1 - _DIELECTRIC) + specular - 2 * _DIELECTRIC
    discriminant = np.maximum(b * b - 4 * _DIELECTRIC * (_DIELECTRIC - specular), 0)
    solved = np.clip((np.sqrt(discriminant) - b) / (2 * _DIELECTRIC), 0, 1)
    return np.where(specular < _DIELECTRIC, np.float32(0), solved)


def _brightness(colors: Colors) -> Colors:
    return np.sqrt(colors * colors @ _BRIGHTNESS)


def _placing(texture: Texture) -> tuple[Any, ...]:
    return texture.sampler, texture.uv_set, texture.transform


def _resampled(pixels: NDArray[np.uint8] | None, strip: slice, height: int, width: int) -> NDArray[np.uint8]:
    """(rows, width, 4) of a picture as one of another size; white if there is none."""
    if pixels is None:
        return np.full((1, 1, 4), 255, np.uint8)
    rows = np.arange(strip.start, strip.stop) * pixels.shape[0] // height
    return pixels[rows[:, None], np.arange(width) * pixels.shape[1] // width]


def _eight_bits(values: NDArray[np.floating[Any]]) -> NDArray[np.uint8]:
    return np.rint(values * 255).astype(np.uint8)

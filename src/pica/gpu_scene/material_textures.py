"""Textures of materials on the GPU, with mip levels; compressed ones stay so."""

import math
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any
from weakref import WeakValueDictionary, finalize

import numpy as np
import slangpy as spy

from pica.rhi.device import Device
from pica.rhi.passes import ComputePass
from pica.scene.material import Image, Sampler, Wrap

_PIXELS = {False: spy.Format.rgba8_unorm, True: spy.Format.rgba8_unorm_srgb}
_WEIGHTED = _PIXELS[False]
"""Of textures whose levels may be weighted by a base colour; devices write to no sRGB format."""
_BC7 = {False: spy.Format.bc7_unorm, True: spy.Format.bc7_unorm_srgb}
"""By whether red, green and blue are encoded as sRGB."""
_FLOATS = {"BC6H": spy.Format.bc6h_ufloat, "BC6HS": spy.Format.bc6h_sfloat}
_WRAP = {
    Wrap.REPEAT: spy.TextureAddressingMode.wrap,
    Wrap.MIRRORED_REPEAT: spy.TextureAddressingMode.mirror_repeat,
    Wrap.CLAMP_TO_EDGE: spy.TextureAddressingMode.clamp_to_edge,
}


@dataclass(eq=False)
class ImageOnGpu:
    """A texture, and the image that it was made of; freed with its last user."""

    image: Image
    form: spy.Format
    content: object
    """The image's pixels or blocks at that time."""
    texture: spy.Texture
    view: spy.TextureView
    base_color: "ImageOnGpu | None" = None
    """What its coarser levels are weighted by."""

    @property
    def has_made_levels(self) -> bool:
        """Whether its coarser levels are means of the finest, and not of a file."""
        return self.form in _PIXELS.values()


class MaterialTextures:
    """A device's textures in use: an image that materials use twice, of one scene or of several, is uploaded once."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._textures: WeakValueDictionary[tuple[int, int, spy.Format, int], ImageOnGpu] = WeakValueDictionary()
        """By the identities of image, content and base colour, which they keep alive, and the format."""
        self._samplers: dict[Sampler, spy.Sampler] = {}

    def of(self, image: Image, srgb: bool, radiance: bool = False, base_color: ImageOnGpu | None = None) -> ImageOnGpu:
        """The texture of an image; uploaded if there is none. `radiance`: its values may be above 1. `base_color`: of a
        texture of roughness and metalness that is read at the same coordinates, see weighted_level.slang."""
        content, form = _content(image), self._form(image, srgb, radiance)
        if form != _WEIGHTED:
            base_color = None
        key = id(image), id(content), form, id(base_color)
        texture = self._textures.get(key)
        if texture is None:
            texture = self._textures[key] = self._upload(image, form, content)
            if base_color is not None:
                self._weigh(texture, base_color)
        return texture

    def outdate(self, texture: ImageOnGpu) -> None:
        """Its image has changed, perhaps by writes into the same pixels: the next user uploads them."""
        key = id(texture.image), id(texture.content), texture.form, id(texture.base_color)
        if self._textures.get(key) is texture:
            del self._textures[key]

    def _form(self, image: Image, srgb: bool, radiance: bool) -> spy.Format:
        """Compressed as the image is, if the device samples such textures and the use is for such values."""
        blocks = image.blocks
        if blocks is not None and (radiance or not blocks.is_float):
            form = _FLOATS[blocks.form] if blocks.is_float else _BC7[srgb]
            if self._samples(form):
                return form
        return _PIXELS[srgb]

    def _upload(self, image: Image, form: spy.Format, content: object) -> ImageOnGpu:
        blocks = None if form in _PIXELS.values() else image.blocks
        if blocks is not None:
            levels, usage = blocks.levels, spy.TextureUsage.shader_resource
            texture = self._texture(image, form, len(levels), usage)
        else:
            levels, usage = (image.pixels,), spy.TextureUsage.shader_resource | spy.TextureUsage.render_target
            if form == _WEIGHTED:
                usage |= spy.TextureUsage.unordered_access
            texture = self._texture(image, form, max(image.size).bit_length(), usage)
        for level, texels in enumerate(levels):
            # SlangPy refuses read-only arrays.
            texture.copy_from_numpy(np.require(texels, requirements=["C", "W"]), mip=level)
        if texture.mip_count > len(levels):
            encoder = self._device.handle.create_command_encoder()
            encoder.generate_mips(texture)
            self._device.handle.submit_command_buffer(encoder.finish())
        made = ImageOnGpu(image, form, content, texture, texture.create_view())
        release = partial(self._device.count_memory, -texture.memory_usage.device)
        finalize(made, self._device.lock.defer, release).atexit = False
        return made

    def _weigh(self, texture: ImageOnGpu, base_color: ImageOnGpu) -> None:
        """Make the coarser levels anew."""
        texture.base_color = base_color
        size, widest = texture.image.size, max(base_color.image.size)
        views = [texture.texture.create_view(mip=level, mip_count=1) for level in range(texture.texture.mip_count)]
        wrap = spy.TextureAddressingMode.wrap
        values: dict[str, Any] = {
            "baseColor": base_color.texture,
            "smooth": self._device.sampler(address_u=wrap, address_v=wrap),
        }
        make = self._device.shared(_weighted_level)
        with self._device.record() as recording:
            for level, (finer, coarser) in enumerate(pairwise(views), start=1):
                width, height = (max(length >> level, 1) for length in size)
                values["baseColorLevel"] = max(math.log2(widest / max(size)) + level - 1, 0)
                values["size"] = spy.uint2(width, height)
                make(recording, (width, height, 1), finer=finer, level=coarser, **values)

    def _samples(self, form: spy.Format) -> bool:
        return bool(self._device.handle.get_format_support(form) & spy.FormatSupport.shader_sample)

    def _texture(self, image: Image, form: spy.Format, levels: int, usage: spy.TextureUsage) -> spy.Texture:
        width, height = image.size
        with self._device.allocating(f"picture {image.name}, {width}x{height} texels"):
            texture = self._device.handle.create_texture(
                format=form,
                width=width,
                height=height,
                mip_count=levels,
                usage=usage,
                label=image.name.encode(errors="replace").decode(),  # names in files may be invalid text
            )
        self._device.count_memory(texture.memory_usage.device)
        return texture

    def sampler(self, sampler: Sampler) -> spy.Sampler:
        """How a texture is read."""
        if sampler not in self._samplers:
            filtering = spy.TextureFilteringMode.linear if sampler.linear else spy.TextureFilteringMode.point
            self._samplers[sampler] = self._device.sampler(
                min_filter=filtering,
                mag_filter=filtering,
                mip_filter=filtering,
                address_u=_WRAP[sampler.wrap_u],
                address_v=_WRAP[sampler.wrap_v],
            )
        return self._samplers[sampler]


def _weighted_level(device: Device) -> ComputePass:
    return device.compute("gpu_scene/weighted_level.slang")


def _content(image: Image) -> object:
    """What changes when other pixels are assigned."""
    return image.pixels if image.blocks is None else image.blocks

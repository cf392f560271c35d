"""Textures of materials on the GPU, with mip levels; compressed ones stay so."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import slangpy as spy

from pica.rhi.device import Device
from pica.scene.changes import ChangeSet
from pica.scene.material import Image, Sampler, Wrap

_PIXELS = {False: spy.Format.rgba8_unorm, True: spy.Format.rgba8_unorm_srgb}
_BLOCKS = {False: spy.Format.bc7_unorm, True: spy.Format.bc7_unorm_srgb}
"""By whether red, green and blue are encoded as sRGB."""
_WRAP = {
    Wrap.REPEAT: spy.TextureAddressingMode.wrap,
    Wrap.MIRRORED_REPEAT: spy.TextureAddressingMode.mirror_repeat,
    Wrap.CLAMP_TO_EDGE: spy.TextureAddressingMode.clamp_to_edge,
}


@dataclass
class ImageOnGpu:
    """A texture, and the image that it was made of."""

    image: Image
    srgb: bool
    texture: spy.Texture
    view: spy.TextureView
    users: int = 0


class MaterialTextures:
    """The textures in use; an image used twice is uploaded once, and freed with its last user."""

    def __init__(self, device: Device, changes: ChangeSet) -> None:
        """`changes`: where images note that they were written to."""
        self._device, self._changes = device, changes
        self._textures: dict[tuple[Image, bool], ImageOnGpu] = {}
        self._samplers: dict[Sampler, spy.Sampler] = {}

    def acquire(self, image: Image, srgb: bool) -> ImageOnGpu:
        """The texture of an image, with one more user; uploaded for the first."""
        if (image, srgb) not in self._textures:
            self._textures[image, srgb] = self._upload(image, srgb)
            image.follow(self._changes)
        texture = self._textures[image, srgb]
        texture.users += 1
        return texture

    def _upload(self, image: Image, srgb: bool) -> ImageOnGpu:
        """The texture of an image: compressed as the image is, if the device samples such textures."""
        blocks = image.blocks if self._samples_blocks else None
        if blocks is not None:
            levels, usage = blocks.levels, spy.TextureUsage.shader_resource
            texture = self._texture(image, _BLOCKS[srgb], len(levels), usage)
        else:
            levels, usage = (image.pixels,), spy.TextureUsage.shader_resource | spy.TextureUsage.render_target
            texture = self._texture(image, _PIXELS[srgb], max(image.size).bit_length(), usage)
        for level, content in enumerate(levels):
            # SlangPy refuses read-only arrays.
            texture.copy_from_numpy(np.require(content, requirements=["C", "W"]), mip=level)
        if texture.mip_count > len(levels):
            encoder = self._device.handle.create_command_encoder()
            encoder.generate_mips(texture)
            self._device.handle.submit_command_buffer(encoder.finish())
        return ImageOnGpu(image, srgb, texture, texture.create_view())

    @cached_property
    def _samples_blocks(self) -> bool:
        support = self._device.handle.get_format_support(_BLOCKS[False])
        return bool(support & spy.FormatSupport.shader_sample)

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

    def renew(self, image: Image) -> None:
        """The image's pixels have changed: its next users upload them."""
        for srgb in (False, True):
            self._textures.pop((image, srgb), None)

    def release(self, on_gpu: ImageOnGpu) -> None:
        """Remove one user."""
        on_gpu.users -= 1
        if not on_gpu.users:
            self._device.count_memory(-on_gpu.texture.memory_usage.device)
            if self._textures.get((on_gpu.image, on_gpu.srgb)) is on_gpu:  # otherwise its pixels were edited
                del self._textures[on_gpu.image, on_gpu.srgb]

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

"""The last step of a denoised picture: Open Image Denoise on the accumulated samples."""

from functools import cached_property
from typing import Any, Literal

import numpy as np
import slangpy as spy

from pica.denoising.open_image_denoise import Picture, check_installed, denoised
from pica.errors import PicaError, shown
from pica.frame.context import FrameContext, Size
from pica.graph.graph import FrameGraph
from pica.graph.nodes import Condition
from pica.graph.resources import Lifetime, Texture, write
from pica.programs.library import programs
from pica.programs.recipes import MaterialPass
from pica.rhi.device import Device
from pica.scene.values import UnfitError, checked, flag

Denoise = bool | Literal["fast"]


def denoiser_of(device: Device, size: Size, denoise: Any) -> "Denoiser | None":
    """The `denoise` argument of `render`: False, True or "fast". Raises PicaError for anything else."""
    kind = checked("render: denoise", _yes_no_or_fast, denoise, PicaError)
    return Denoiser(device.memory_scope(), size, kind == "fast") if kind else None


def _yes_no_or_fast(value: Any) -> bool | str:
    if isinstance(value, str) and value == "fast":
        return "fast"
    try:
        return flag(value)
    except UnfitError:
        raise UnfitError(f"{shown(value)} is not True, False or 'fast'") from None


class Denoiser:
    """Accumulates colours and normals of visible surfaces during a picture, then denoises it."""

    def __init__(self, device: Device, size: Size, fast: bool) -> None:
        """`size`: of the picture. `fast`: less well. Raises PicaError where Open Image Denoise is not installed."""
        check_installed()
        self._fast = fast
        self._device = device
        self.sums = {name: device.texture(name, spy.Format.rgba32_float, size) for name in ("albedos", "normals")}
        """(width, height, rgba32f) that shaders add to, and in alpha how many they added (surface_features.slang)."""
        with device.record() as recording:
            for texture in self.sums.values():
                recording.encoder.clear_texture_float(texture)

    @cached_property
    def _gather(self) -> MaterialPass:
        return programs(self._device).compute("denoising/gather_features.slang")

    def gather(self, graph: FrameGraph) -> None:
        """Accumulate the G-buffer."""
        with graph.scope("denoising"):
            graph.add(self._gather, graph.output_grid, **self.sums)

    def finish(self, graph: FrameGraph, picture: Texture, when: Condition | None = None) -> Texture:
        """Linear radiance (width, height, rgba) without its noise."""
        with graph.scope("denoising"):
            light = spy.Format.rgba32_float
            clean = graph.texture("denoised", light, graph.output_size, lifetime=Lifetime.KEPT)
            graph.record("denoise", self._denoise, when=when, picture=picture, clean=write(clean))
        return clean

    def _denoise(self, frame: FrameContext, picture: spy.Texture, clean: spy.Texture) -> None:
        """Submit the recording and wait for it."""
        self._device.handle.submit_command_buffer(frame.encoder.finish())
        color = np.asarray(picture.to_numpy(), np.float32)[..., :3]
        albedo, normal = (_mean(texture) for texture in self.sums.values())
        result = denoised(color, albedo, normal, self._fast)
        clean.copy_from_numpy(np.dstack([result, np.ones(result.shape[:2], np.float32)]))
        frame.encoder = self._device.handle.create_command_encoder()


def _mean(texture: spy.Texture) -> Picture:
    sums = np.asarray(texture.to_numpy())
    return np.asarray(sums[..., :3] / np.maximum(sums[..., 3:], 1), np.float32)

"""Exposure and tone mapping."""

from functools import cached_property
from typing import Any

import numpy as np
import slangpy as spy

from pica.effects.post.bloom import Bloom
from pica.effects.post.glare import Glare
from pica.effects.post.white_balance import NEUTRAL, balance
from pica.frame.context import FrameContext
from pica.frame.effect import Effect, rgb
from pica.graph.graph import FrameGraph
from pica.graph.resources import Buffer, Lifetime, Texture, update, write
from pica.images.lut import Lut
from pica.rhi.device import Device
from pica.rhi.passes import ComputePass
from pica.settings import PostSettings

_BINS = 128  # histogram.slang: binCount
_AT_ONCE = 1e3
"""Stops, more than exposures may differ by."""
_CURVES = ("neutral", "agx", "aces", "linear")
"""In the order of tone_curves.slang."""


class Post(Effect):
    """Scene radiance in, sRGB for the display out (width, height, rgba8_unorm)."""

    name = "post"

    def __init__(self, device: Device, settings: PostSettings, lut: Lut | None = None) -> None:
        """`lut`: changes display colours after the tone map."""
        self._device, self._settings, self._lut = device, settings, lut
        self._begins = False
        """Whether the newest picture has none before it."""
        self._histogram = device.compute("effects/post/histogram.slang")
        self._expose = device.compute("effects/post/exposure.slang")
        self._bloom = Bloom(device, settings.bloom) if settings.bloom > 0 else None
        self._glare = Glare(device, settings.glare) if settings.glare > 0 else None
        edge = spy.TextureAddressingMode.clamp_to_edge
        self._linear = device.sampler(address_u=edge, address_v=edge)
        self._tone_map = device.compute("effects/post/tone_map.slang")

    def exposure(self, graph: FrameGraph) -> Buffer:
        """The factor from radiance to the display, and what of it is automatic: until `__call__` those of the frame
        before."""
        with graph.scope(self.name):
            return graph.buffer("exposure", data=np.ones(2, np.float32))

    def __call__(
        self,
        graph: FrameGraph,
        radiance: Texture,
        exposure: Buffer,
        alpha: Texture | None = None,
        channel: int = 0,
        cut: Texture | None = None,
    ) -> Texture:
        """The picture to show. `alpha`: that by which the radiance is premultiplied, in a channel of a texture. `cut`:
        Reprojection's."""
        with graph.scope(self.name):
            size = spy.uint2(*graph.output_size)
            if alpha is not None:
                radiance = self._straightened(graph, radiance, alpha, channel)
            bins = graph.buffer("histogram", data=np.zeros(_BINS, np.uint32))
            if self._settings.auto_exposure:
                graph.add(self._histogram, graph.output_grid, radiance=radiance, bins=update(bins), size=size)
            graph.add(
                self._expose,
                (1, 1, 1),
                bins=update(bins),
                exposure=update(exposure),
                stops=self._settings.exposure,
                automatic=int(self._settings.auto_exposure),
                cut=cut or graph.nothing(spy.Format.r32_uint),
                testsCut=lambda frame: int(cut is not None and frame.camera_moved),
                **self._adaptation(),
            )
            if self._bloom is not None:
                radiance = self._bloom(graph, radiance)
                graph.offer("debug.post.bloom", (radiance,), rgb)
            if self._glare is not None:
                radiance = self._glare(graph, radiance)
                graph.offer("debug.post.glare", (radiance,), rgb)
            display = graph.texture("display", spy.Format.rgba8_unorm, graph.output_size, lifetime=Lifetime.KEPT)
            outputs = {"exposure": exposure, "display": write(display)}
            graph.add(self._tone_map, graph.output_grid, radiance=radiance, size=size, **self._look(graph), **outputs)
        return display

    def _adaptation(self) -> dict[str, Any]:
        """How far the exposure may change since the frame before."""
        up, down = self._settings.adaptation_up, self._settings.adaptation_down

        def at_once(frame: FrameContext) -> int:
            if frame.first or not frame.continues:
                self._begins = frame.first  # all frames of a first picture meter anew
            return int(self._begins or frame.seconds is None or up == down == 0)

        return {
            "atOnce": at_once,
            "rise": lambda frame: up * (frame.seconds or 0.0) if up > 0 else _AT_ONCE,
            "fall": lambda frame: down * (frame.seconds or 0.0) if down > 0 else _AT_ONCE,
        }

    def _look(self, graph: FrameGraph) -> dict[str, Any]:
        """Arguments of the tone map that follow from the settings."""
        settings, lut = self._settings, self._lut or Lut(np.zeros((0, 0, 0, 3), np.float32))
        rows = np.pad(lut.table.reshape(-1, 3), ((0, max(0, 1 - lut.table.size)), (0, 1)))
        low, high = lut.domain
        return {
            "curve": _CURVES.index(settings.tone_map),
            "balances": int(settings.white_balance != NEUTRAL),
            "balance": [spy.float3(*row) for row in balance(settings.white_balance).tolist()],
            "linearSampler": self._linear,
            "aberration": settings.chromatic_aberration,
            "vignette": settings.vignette,
            "grain": settings.grain,
            "frameIndex": lambda frame: frame.index,
            "table": graph.buffer("look-up table", data=rows),
            "tableSize": len(lut.table),
            "tableLow": spy.float3(*low),
            "tableHigh": spy.float3(*high),
            "dithers": int(settings.dither),
        }

    @cached_property
    def _straighten(self) -> ComputePass:
        return self._device.compute("effects/post/straighten.slang")

    def _straightened(self, graph: FrameGraph, picture: Texture, alpha: Texture, channel: int) -> Texture:
        """The radiance of the covered part of each pixel, which is exposed and tone mapped."""
        straight = graph.texture("straight", spy.Format.rgba32_float, graph.output_size)
        outputs = {"picture": picture, "alpha": alpha, "straight": write(straight)}
        graph.add(self._straighten, graph.output_grid, size=spy.uint2(*graph.output_size), channel=channel, **outputs)
        return straight

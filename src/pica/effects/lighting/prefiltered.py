"""The environment's light filtered ahead for the raster preset; made once for each environment."""

import slangpy as spy

from pica.frame.context import FrameContext
from pica.gpu_scene.view import SceneView
from pica.graph.graph import FrameGraph
from pica.rhi.device import Device

LEVELS = 8  # prefiltered.slang: levelCount
NARROW = 3  # prefiltered.slang: narrowCount
_SIZE = (128, 64)  # prefiltered.slang: narrowRows
_SAMPLES = 128
_SAMPLE = 28
"""Bytes of an EnvironmentSample."""
_SMALLEST_ALPHA = 0.01
_COSINE_LOBE = -1.0


class PrefilteredEnvironment:
    """Radiance by direction and roughness, and irradiance. One black texel if disabled."""

    def __init__(self, device: Device, enabled: bool) -> None:
        self._size = size = _SIZE if enabled else (1, 1)
        self._levels = device.texture(
            "prefiltered environment", spy.Format.rgba32_float, size, layers=LEVELS + 1, mips=2 if enabled else 1
        )
        self._targets = [self._levels.create_view(mip=mip, mip_count=1) for mip in range(self._levels.mip_count)]
        self._samples = device.buffer(
            "prefilter samples", size=_SAMPLE * _SAMPLES if enabled else 0, struct_size=_SAMPLE
        )
        self.block = device.parameter_block("effects/lighting/prefiltered.slang", "prefiltered")
        self.block.bind(
            levels=self._levels,
            sampler=device.sampler(
                address_u=spy.TextureAddressingMode.wrap, address_v=spy.TextureAddressingMode.clamp_to_edge
            ),
            enabled=int(enabled),
        )
        self._prefilter = device.compute("effects/lighting/prefilter.slang") if enabled else None
        self._draw = device.compute("effects/lighting/prefilter_samples.slang") if enabled else None
        self._made_for = -1

    def add_update(self, graph: FrameGraph, scene: SceneView) -> None:
        """Add the passes that follow the scene's environment."""
        if self._prefilter is not None:
            graph.record("prefilter", self._update, scene=scene)

    def _update(self, frame: FrameContext, scene: SceneView) -> None:
        if self._prefilter is None or self._draw is None or self._made_for == scene.environment_revision:
            return
        self._made_for = scene.environment_revision
        self._draw(frame, (_SAMPLES, 1, 1), scene=scene, samples=self._samples, count=_SAMPLES)
        for layer in range(LEVELS + 1):
            alpha = max((layer / (LEVELS - 1)) ** 2, _SMALLEST_ALPHA) if layer < LEVELS else _COSINE_LOBE
            mip = int(layer >= NARROW)
            size = _SIZE[0] >> mip, _SIZE[1] >> mip
            values = {"layer": layer, "size": spy.uint2(*size), "alpha": alpha, "count": _SAMPLES}
            target = self._targets[mip]
            self._prefilter(frame, (*size, 1), scene=scene, target=target, samples=self._samples, **values)

"""Draws the samples of the light slots, once a frame for all who read them."""

from dataclasses import dataclass
from operator import gt
from typing import Any

import slangpy as spy

from pica.frame.context import FrameContext, Size
from pica.frame.gbuffer import GBuffer
from pica.gpu_scene.view import SceneView
from pica.light_sampling.light_slots import LightSlots
from pica.programs.library import programs
from pica.programs.recipes import ForTypes
from pica.programs.scene_features import SPLIT_SUM_ONLY
from pica.rhi.device import Device
from pica.rhi.passes import ComputePass

_PRESAMPLED = 1 << 14
"""Points of lights that are drawn ahead for all pixels, 32 bytes each."""
_PRESAMPLED_AT_HITS = 1 << 12
"""The same for what rays meet."""
_LEAST_ROUGHNESS = 0.3
"""Of what rays meet, in the light of lamps: a narrower highlight there is a rare spike (light_at_hits.slang)."""


@dataclass(frozen=True)
class LightSamples:
    """What a frame looks at to find its direct light."""

    slots: LightSlots
    samples: spy.Texture
    """(width, height, slots) light_samples.slang: the sample of each slot that needs one."""
    weights: spy.Texture
    """(width, height, denoised slots, r16_float) what they count in the share of their light that arrives."""
    pool: "LightPool | None"
    """Points of all that shines, for what rays meet; None where nobody asks for it."""

    def at_hits(self, regularized: bool) -> dict[str, Any]:
        """What ray effects need to light what they meet. `regularized`: with highlights wider than surfaces have."""
        assert self.pool is not None, "LightSampler.expect_hits comes first"
        return {
            "lightSlots": self.slots,
            "pool": self.pool.buffer,
            "entries": self.pool.entries if self.slots.every else 0,
            "leastRoughness": _LEAST_ROUGHNESS if regularized else 0.0,
        }


class LightPool:
    """Points of lights that are drawn ahead for a frame (presampled_lights.slang)."""

    def __init__(self, device: Device, entries: int) -> None:
        self.entries = entries
        self.buffer = device.buffer("presampled lights", size=32 * entries, struct_size=16)
        self._draw: ForTypes[Any, ComputePass] = programs(device).compute("light_sampling/presample_lights.slang")

    def __call__(self, frame: FrameContext, scene: SceneView, slots: LightSlots, lights: range) -> None:
        """Draw this frame's, of these places of the light table."""
        self._draw(scene.material_types)(
            frame,
            (self.entries, 1, 1),
            frame=frame,
            scene=scene,
            lightSlots=slots,
            pool=self.buffer,
            entries=self.entries,
            range=spy.uint2(lights.start, len(lights)),
        )


class LightSampler:
    """One sample a pixel and slot, of the slots that need any."""

    def __init__(self, device: Device, size: Size) -> None:
        self._device, self._size = device, size
        self._sample: ForTypes[Any, ComputePass] | None = None
        self._shared: LightPool | None = None
        self.at_hits: LightPool | None = None
        """Points of all that shines; None: nobody asks for them."""
        self._allocate(0, 0)

    def resize(self, size: Size) -> None:
        """Work at another size, (width, height) pixels, from the next frame on."""
        self._device.give_back(self._samples, self._weights)
        self._size = size
        self._allocate(0, 0)

    def expect(self, slots: LightSlots) -> None:
        """Have the pass that these slots call for, before their first frame."""
        if self._sample is None and slots.first_sampled < slots.count:
            features = () if slots.by_ratio else (SPLIT_SUM_ONLY,)
            self._sample = programs(self._device).compute("light_sampling/sample_lights.slang", features=features)
            self._no_pool = self._device.buffer("no lights", size=32, struct_size=16)
        if self._shared is None and slots.has_shared:
            self._shared = LightPool(self._device, _PRESAMPLED)

    def expect_hits(self, wanted: bool) -> None:
        """Whether somebody asks for light where rays meet something."""
        if wanted != (self.at_hits is not None):
            self.at_hits = LightPool(self._device.part(), _PRESAMPLED_AT_HITS) if wanted else None

    def __call__(self, frame: FrameContext, gbuffer: GBuffer, scene: SceneView, slots: LightSlots) -> LightSamples:
        """Draw this frame's samples."""
        self.expect(slots)
        if self.at_hits is not None and slots.every:
            self.at_hits(frame, scene, slots, range(slots.every))
        if self._sample is None or slots.first_sampled == slots.count:
            return LightSamples(slots, self._samples, self._weights, self.at_hits)
        wanted = slots.count, len(slots.denoised)
        if any(map(gt, wanted, self._layers)):
            self._device.give_back(self._samples, self._weights)
            self._allocate(*map(max, wanted, self._layers))
        pool = self._shared if slots.has_shared else None
        if pool is not None:
            pool(frame, scene, slots, slots.shared_lights)
        self._sample(scene.material_types)(
            frame,
            frame.grid,
            frame=frame,
            gbuffer=gbuffer,
            scene=scene,
            lightSlots=slots,
            pool=pool.buffer if pool else self._no_pool,
            entries=pool.entries if pool else 0,
            lightSamples=self._samples,
            weights=self._weights,
        )
        return LightSamples(slots, self._samples, self._weights, self.at_hits)

    def _allocate(self, slots: int, denoised: int) -> None:
        def make(label: str, texture_format: spy.Format, layers: int) -> spy.Texture:
            return self._device.texture(label, texture_format, self._size if layers else (1, 1), layers=layers or 1)

        self._layers = slots, denoised
        self._samples = make("light samples", spy.Format.rgba32_uint, slots)
        self._weights = make("light sample weights", spy.Format.r16_float, denoised)

"""Filters of shadow samples: a history in time, then a filter in the picture, one for each light."""

from functools import partial
from itertools import pairwise

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.effects.lighting.light_slots import LightSlots
from pica.frame.context import FrameContext, Size
from pica.frame.gbuffer import GBuffer
from pica.gpu_scene.scene import GpuScene
from pica.rhi.device import Device
from pica.scene.light import DirectionalLight
from pica.scene.model import Node

_NEW_LIGHT = 0xFFFFFFFF
_STEPS = (1, 2, 4, 8, 16)
"""Pixels between the taps of SVGF's five passes."""
_MOST_LIGHTS = 16
"""ShadowsSettings.denoised_lights has no more."""
_GROUP = 16
"""shadow_history.slang: GROUP."""
_TILE = 8
"""penumbra_tiles.slang: GROUP."""
_STILL = 256.0
"""Samples that a history holds while nothing moves."""
_CLAMP_WIDTH = 2.0
"""Standard errors of a frame's 5x5 mean by which the history may differ while something moves."""


class ShadowDenoiser:
    """Visibility of the denoised light slots from a sample a pixel and frame."""

    def __init__(self, device: Device, size: Size, history: int) -> None:
        """`history`: ShadowsSettings.history."""
        self._device, self._size, self._remembered = device, size, history
        folder = "effects/shadows"
        self._history = device.compute(f"{folder}/shadow_history.slang")
        # A pass whose parameters differ from dispatch to dispatch is bound anew each time; five passes are not.
        self._svgf = [device.compute(f"{folder}/svgf.slang") for _ in _STEPS]
        self._tiles = device.compute(f"{folder}/penumbra_tiles.slang")
        self._footprint = device.compute(f"{folder}/footprint.slang")
        self._anisotropic = [device.compute(f"{folder}/anisotropic.slang") for _ in range(2)]
        self._lights: list[Node] = []
        self._places: dict[Node, NDArray[np.float64]] = {}
        self._motions = device.structured("light motions", np.zeros((_MOST_LIGHTS, 4), np.float32))
        self._sources: dict[tuple[int, ...], spy.Buffer] = {}
        self._textures: list[spy.Texture] = []
        self._layers = 0

    def reset(self) -> None:
        """Drop the history."""
        self._lights = []

    def debug_views(self) -> dict[str, spy.Texture]:
        """What the newest frame left behind, by name: see views.py."""
        return {
            "filtered": self._filtered[0],
            "moments": self._moments[1],
            "deviation": self._deviation[0],
            "filtered deviation": self._deviation[1],
            "footprints": self._footprints,
        }

    def __call__(
        self,
        frame: FrameContext,
        gbuffer: GBuffer,
        scene: GpuScene,
        slots: LightSlots,
        samples: spy.Texture,
        slopes: spy.Texture,
        moved: bool,
    ) -> spy.Texture:
        """(width, height, denoised slots, rgba16_float) the share of each slot's light that arrives.

        `samples` and `slopes`: as shadow_rays.slang writes them. `moved`: something differs from the frame before.
        """
        layers = len(slots.denoised)
        self._allocate(layers)
        remembered = self._remembered if moved or self._remembered == 1 else _STILL
        shift = int(self._follow(frame, slots.denoised, slots.svgf))
        if slots.svgf < layers:
            self._find_footprints(frame, gbuffer, scene, slots, slopes, shift)
        self._history(
            frame,
            (self._size[0] + _GROUP, self._size[1] + _GROUP, layers),
            frame=frame,
            gbuffer=gbuffer,
            samples=samples,
            previousSignal=self._signal[1],
            previousMoments=self._moments[1],
            signal=self._signal[0],
            moments=self._moments[0],
            deviation=self._deviation[0],
            footprints=self._footprints,
            firstFootprint=slots.svgf,
            shifts=self._shifts,
            shadowsShift=shift,
            sourceLayers=self._source_layers(slots.denoised),
            remembered=float(remembered),
            clampWidth=_CLAMP_WIDTH if moved else 0.0,
        )
        if slots.svgf:
            self._filter_by_variance(frame, gbuffer, slots.svgf)
        if slots.svgf < layers:
            self._filter_by_footprint(frame, gbuffer, slots)
        self._signal.reverse()
        self._moments.reverse()
        return self._filtered[0]

    def _filter_by_variance(self, frame: FrameContext, gbuffer: GBuffer, layers: int) -> None:
        source = self._signal[0]
        for number, step in enumerate(_STEPS):
            target = self._filtered[number % 2]
            self._svgf[number](
                frame,
                (*self._size, layers),
                frame=frame,
                gbuffer=gbuffer,
                signal=source,
                deviation=self._deviation[number % 2],
                filtered=target,
                filteredDeviation=self._deviation[1 - number % 2],
                step=step,
                isLast=int(step == _STEPS[-1]),
            )
            source = target

    def _find_footprints(
        self,
        frame: FrameContext,
        gbuffer: GBuffer,
        scene: GpuScene,
        slots: LightSlots,
        slopes: spy.Texture,
        shift: int,
    ) -> None:
        first, layers = slots.svgf, len(slots.denoised) - slots.svgf
        grid = (*self._size, layers)
        self._tiles(frame, grid, frame=frame, slopes=slopes, tiles=self._tile_slopes)
        self._footprint(
            frame,
            grid,
            frame=frame,
            gbuffer=gbuffer,
            scene=scene,
            lightSlots=slots,
            slopes=slopes,
            tiles=self._tile_slopes,
            footprints=self._footprints,
            shifts=self._shifts,
            shadowsShift=shift,
            lightMotions=self._motions,
            tileCount=spy.uint2(*_tiles_of(self._size)),
            firstLayer=first,
        )

    def _filter_by_footprint(self, frame: FrameContext, gbuffer: GBuffer, slots: LightSlots) -> None:
        first, layers = slots.svgf, len(slots.denoised) - slots.svgf
        grid = (*self._size, layers)
        chain = self._signal[0], self._filtered[1], self._filtered[0]
        for axis, (source, target) in enumerate(pairwise(chain)):
            self._anisotropic[axis](
                frame,
                grid,
                frame=frame,
                gbuffer=gbuffer,
                signal=source,
                footprints=self._footprints,
                moments=self._moments[0],
                deviation=self._deviation[0],
                filtered=target,
                axis=axis,
                firstLayer=first,
            )

    def _allocate(self, layers: int) -> None:
        if layers <= self._layers:
            return
        self._device.give_back(*self._textures)
        self._layers, self._lights, self._textures = layers, [], []

        def pair(label: str, texture_format: spy.Format) -> list[spy.Texture]:
            made = [self._device.texture(label, texture_format, self._size, layers=layers) for _ in range(2)]
            self._textures += made
            return made

        self._signal = pair("shadow signal", spy.Format.rgba16_float)
        self._moments = pair("shadow moments", spy.Format.rg16_float)
        self._deviation = pair("shadow deviation", spy.Format.r16_float)
        self._filtered = pair("filtered shadows", spy.Format.rgba16_float)
        make = partial(self._device.texture, layers=layers)
        self._footprints = make("shadow footprints", spy.Format.rgba16_float, self._size)
        self._tile_slopes = make("tiles of slopes", spy.Format.rg16_float, _tiles_of(self._size))
        self._shifts = make("shadow shifts", spy.Format.rg16_float, self._size)
        self._textures += [self._footprints, self._tile_slopes, self._shifts]

    def _follow(self, frame: FrameContext, lights: list[Node], first: int) -> bool:
        """Note how far the lights from `first` on have come since the frame before; whether any has."""
        places = {light: _place(light) for light in lights[first:]}
        motions = np.zeros((_MOST_LIGHTS, 4), np.float32)
        for row, (light, place) in zip(motions, places.items(), strict=False):
            row[:3] = place - self._places.get(light, place)
        self._places = places
        moved = bool(motions.any())
        if moved:
            frame.encoder.upload_buffer_data(self._motions, 0, motions.view(np.uint8))
        return moved

    def _source_layers(self, lights: list[Node]) -> spy.Buffer:
        """Where each light was in the frame before."""
        sources = tuple(self._lights.index(light) if light in self._lights else _NEW_LIGHT for light in lights)
        self._lights = lights
        if sources not in self._sources:
            self._sources[sources] = self._device.structured("source layers", np.array(sources, np.uint32)[:, None])
        return self._sources[sources]


def _place(light: Node) -> NDArray[np.float64]:
    """Where it is; of a directional light the direction to it."""
    return light.world[:3, 2 if isinstance(light.light, DirectionalLight) else 3]


def _tiles_of(size: Size) -> Size:
    return -(-size[0] // _TILE), -(-size[1] // _TILE)

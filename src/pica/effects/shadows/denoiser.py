"""Filters of shadow samples: a history in time, then a filter in the picture, one for each light."""

from itertools import pairwise

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.frame.context import FrameContext, Size
from pica.frame.gbuffer import GBuffer
from pica.frame.history import History, accumulate_grid
from pica.frame.reprojection import Reprojection
from pica.gpu_scene.view import SceneView
from pica.light_sampling.light_slots import LightSlots
from pica.programs.library import programs
from pica.programs.scene_features import LIGHTS
from pica.rhi.device import Device
from pica.rhi.passes import ComputePass
from pica.scene.light import DirectionalLight
from pica.scene.model import Node

_NEW_LIGHT = 0xFFFFFFFF
_STEPS = (1, 2, 4, 8, 16)
"""Pixels between the taps of SVGF's five passes."""
_MOST_LIGHTS = 16
"""ShadowsSettings.denoised_lights has no more."""
_REMEMBERED = {"signal": spy.Format.rgba16_float, "moments": spy.Format.rgba16_float}
"""shadow_history.slang has what they hold."""
_TILE = 8
"""penumbra_tiles.slang: GROUP."""


class ShadowDenoiser:
    """Visibility of the denoised light slots from a sample a pixel and frame."""

    def __init__(self, device: Device, size: Size, history: int) -> None:
        """`history`: ShadowsSettings.history."""
        self._device, self._size, self._remembered = device, size, history

        def compute(name: str) -> ComputePass:
            return programs(device).compute_with(LIGHTS, f"effects/shadows/{name}.slang")

        self._history: History | None = None
        self._accumulate = compute("shadow_history")
        # A pass whose parameters differ from dispatch to dispatch is bound anew each time; five passes are not.
        self._svgf = [compute("svgf") for _ in _STEPS]
        self._tiles = compute("penumbra_tiles")
        self._footprint = compute("footprint")
        self._anisotropic = [compute("anisotropic") for _ in range(2)]
        self._lights: list[Node] = []
        self._places: dict[Node, NDArray[np.float64]] = {}
        self._motions = device.structured("light motions", np.zeros((_MOST_LIGHTS, 4), np.float32))
        self._sources: dict[tuple[int, ...], spy.Buffer] = {}
        self._textures: list[spy.Texture] = []
        self._layers = 0

    def reset(self) -> None:
        """Drop the history."""
        self._lights = []

    def resize(self, size: Size) -> None:
        """Work at another size; drops the history."""
        self._size, self._layers = size, 0
        self.reset()

    def debug_textures(self) -> dict[str, spy.Texture]:
        """What the newest frame left behind, by name: see views.py."""
        assert self._history is not None
        return {
            "filtered": self._filtered[0],
            "moments": self._history.current["moments"],
            "deviation": self._deviation[0],
            "filtered deviation": self._deviation[1],
            "footprints": self._footprints,
        }

    def __call__(
        self,
        frame: FrameContext,
        gbuffer: GBuffer,
        scene: SceneView,
        slots: LightSlots,
        samples: spy.Texture,
        slopes: spy.Texture,
        reprojection: Reprojection,
    ) -> spy.Texture:
        """(width, height, denoised slots, rgba16_float) the share of each slot's light that arrives.

        `samples` and `slopes`: as shadow_rays.slang writes them.
        """
        layers = len(slots.denoised)
        history = self._allocate(layers)
        textures = history.turn(frame)
        if history.empty:
            self._lights = []
        shift = int(self._follow(frame, slots.denoised, slots.svgf))
        if slots.svgf < layers:
            self._find_footprints(frame, gbuffer, scene, slots, slopes, shift)
        self._accumulate(
            frame,
            accumulate_grid(self._size, layers),
            frame=frame,
            gbuffer=gbuffer,
            reprojection=reprojection,
            samples=samples,
            deviation=self._deviation[0],
            footprints=self._footprints,
            firstFootprint=slots.svgf,
            shifts=self._shifts,
            shadowsShift=shift,
            sourceLayers=self._source_layers(slots.denoised),
            remembered=float(self._remembered),
            **textures,
        )
        if slots.svgf:
            self._filter_by_variance(frame, gbuffer, history.current["signal"], slots.svgf)
        if slots.svgf < layers:
            self._filter_by_footprint(frame, gbuffer, history, slots)
        return self._filtered[0]

    def _filter_by_variance(self, frame: FrameContext, gbuffer: GBuffer, source: spy.Texture, layers: int) -> None:
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
        scene: SceneView,
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

    def _filter_by_footprint(self, frame: FrameContext, gbuffer: GBuffer, history: History, slots: LightSlots) -> None:
        first, layers = slots.svgf, len(slots.denoised) - slots.svgf
        grid = (*self._size, layers)
        chain = history.current["signal"], self._filtered[1], self._filtered[0]
        for axis, (source, target) in enumerate(pairwise(chain)):
            self._anisotropic[axis](
                frame,
                grid,
                frame=frame,
                gbuffer=gbuffer,
                signal=source,
                footprints=self._footprints,
                moments=history.current["moments"],
                deviation=self._deviation[0],
                filtered=target,
                axis=axis,
                firstLayer=first,
            )

    def _allocate(self, layers: int) -> History:
        """The history, with room for so many lights."""
        if self._history is not None and layers <= self._layers:
            return self._history
        self._device.give_back(*self._textures)
        self._layers, self._lights, self._textures = layers, [], []
        if self._history is None:
            self._history = History(self._device, "shadow", _REMEMBERED, self._size, layers)
        else:
            self._history.resize(self._size, layers)

        def make(label: str, texture_format: spy.Format, size: Size) -> spy.Texture:
            self._textures.append(self._device.texture(label, texture_format, size, layers=layers))
            return self._textures[-1]

        self._deviation = [make("shadow deviation", spy.Format.r16_float, self._size) for _ in range(2)]
        self._filtered = [make("filtered shadows", spy.Format.rgba16_float, self._size) for _ in range(2)]
        self._footprints = make("shadow footprints", spy.Format.rgba16_float, self._size)
        self._tile_slopes = make("tiles of slopes", spy.Format.rg16_float, _tiles_of(self._size))
        self._shifts = make("shadow shifts", spy.Format.rg16_float, self._size)
        return self._history

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

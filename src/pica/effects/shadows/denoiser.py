"""Filters of shadow samples: a history in time, then a filter in the picture, one for each light."""

from itertools import pairwise

import numpy as np
import slangpy as spy

from pica.filtering.accumulation import accumulate_grid
from pica.frame.context import FrameContext
from pica.graph.graph import FrameGraph
from pica.graph.resources import History, Size, Texture, update, write
from pica.light_sampling.light_motions import LightMotions
from pica.light_sampling.light_slots import LightSlots
from pica.programs.library import programs
from pica.programs.scene_features import LIGHTS
from pica.rhi.device import Device
from pica.rhi.passes import ComputePass
from pica.scene.model import Node

_NEW_LIGHT = 0xFFFFFFFF
_STEPS = (1, 2, 4, 8, 16)
"""Pixels between the taps of SVGF's five passes."""
_REMEMBERED = {"signal": spy.Format.rgba16_float, "moments": spy.Format.rgba16_float}
"""Their content is documented in shadow_history.slang."""
_TILE = 8
"""penumbra_tiles.slang: GROUP."""


class ShadowDenoiser:
    """Visibility of the denoised light slots from a sample a pixel and frame."""

    def __init__(self, device: Device, history: int) -> None:
        """`history`: ShadowsSettings.history."""
        self._device, self._remembered = device, history

        def compute(name: str) -> ComputePass:
            return programs(device).compute_with(LIGHTS, f"effects/shadows/{name}.slang")

        self._accumulate = compute("shadow_history")
        # A pass whose parameters differ between dispatches is bound again each time; five passes are not.
        self._svgf = [compute("svgf") for _ in _STEPS]
        self._tiles = compute("penumbra_tiles")
        self._footprint = compute("footprint")
        self._anisotropic = [compute("anisotropic") for _ in range(2)]
        self._lights: list[Node] = []
        self._sources: dict[tuple[int, ...], spy.Buffer] = {}
        self._layers = 0
        self._source: spy.Buffer | None = None

    def reset(self) -> None:
        """Discard the lights' state."""
        self._lights = []

    def __call__(
        self,
        graph: FrameGraph,
        slots: LightSlots,
        samples: Texture,
        slopes: Texture,
        followed: Texture,
        motions: LightMotions,
    ) -> dict[str, Texture]:
        """filtered: (width, height, denoised slots, rgba16_float) visibility of each slot's light; and
        the textures for debug_aovs.py.

        `samples`, `slopes` and `followed`: as written by shadow_rays.slang.
        """
        layers = len(slots.denoised)
        # A history with slots for more lights than there are stays valid when one is removed.
        self._layers = max(self._layers, layers)
        history = graph.history("history", _REMEMBERED, layers=self._layers)
        deviation = graph.texture("deviation", spy.Format.r16_float, layers=self._layers)
        shifts = graph.texture("shifts", spy.Format.rg16_float, layers=self._layers)
        footprints = graph.texture("footprints", spy.Format.rgba16_float, layers=self._layers)
        state = history.state

        def follow(frame: FrameContext) -> None:
            if not state.precedes(frame):
                self._lights = []
            self._source = self._source_layers(slots.denoised)

        graph.record("follow lights", follow)
        if slots.svgf < layers:
            self._find_footprints(graph, slots, slopes, motions, footprints, shifts)
        else:
            footprints, shifts = graph.nothing(spy.Format.rgba16_float, 1), graph.nothing(spy.Format.rg16_float, 1)
        graph.add(
            self._accumulate,
            accumulate_grid(graph.size, layers),
            samples=samples,
            deviation=write(deviation),
            footprints=footprints,
            followed=followed,
            firstFootprint=slots.svgf,
            shifts=shifts,
            shadowsShift=motions.have_moved,
            sourceLayers=lambda frame: self._source,
            remembered=float(self._remembered),
            **history.swap(),
        )
        signal, moments = history["signal"], history["moments"]
        filtered = [graph.texture(f"filtered {i}", spy.Format.rgba16_float, layers=self._layers) for i in range(2)]
        after = deviation
        if slots.svgf:
            after = self._filter_by_variance(graph, signal, deviation, filtered, slots.svgf)
        if slots.svgf < layers:
            self._filter_by_footprint(graph, history, deviation, footprints, filtered, slots)
        return {
            "filtered": filtered[0],
            "moments": moments,
            "deviation": deviation,
            "filtered deviation": after,
            "footprints": footprints,
        }

    def _filter_by_variance(
        self,
        graph: FrameGraph,
        signal: Texture,
        deviation: Texture,
        filtered: list[Texture],
        layers: int,
    ) -> Texture:
        """Fill filtered[0] for the first `layers`. Returns its deviation."""
        other = graph.texture("filtered deviation", spy.Format.r16_float, layers=self._layers)
        deviations, source = [deviation, other], signal
        for number, step in enumerate(_STEPS):
            target, changed = filtered[number % 2], deviations[1 - number % 2]
            graph.add(
                self._svgf[number],
                (*graph.size, layers),
                signal=source,
                deviation=deviations[number % 2],
                filtered=write(target) if number < 2 else update(target),
                filteredDeviation=write(changed) if number == 0 else update(changed),
                step=step,
                isLast=int(step == _STEPS[-1]),
            )
            source = target
        return other

    def _find_footprints(
        self,
        graph: FrameGraph,
        slots: LightSlots,
        slopes: Texture,
        motions: LightMotions,
        footprints: Texture,
        shifts: Texture,
    ) -> None:
        first, layers = slots.svgf, len(slots.denoised) - slots.svgf
        grid, count = (*graph.size, layers), _tiles_of(graph.size)
        tiles = graph.texture("tiles of slopes", spy.Format.rg16_float, count, layers=self._layers)
        graph.add(self._tiles, grid, slopes=slopes, tiles=write(tiles))
        graph.add(
            self._footprint,
            grid,
            slopes=slopes,
            tiles=tiles,
            footprints=write(footprints),
            shifts=write(shifts),
            shadowsShift=motions.have_moved,
            lightMotions=motions.buffer,
            tileCount=spy.uint2(*count),
            firstLayer=first,
        )

    def _filter_by_footprint(
        self,
        graph: FrameGraph,
        history: History,
        deviation: Texture,
        footprints: Texture,
        filtered: list[Texture],
        slots: LightSlots,
    ) -> None:
        first, layers = slots.svgf, len(slots.denoised) - slots.svgf
        chain = history["signal"], filtered[1], filtered[0]
        for axis, (source, target) in enumerate(pairwise(chain)):
            graph.add(
                self._anisotropic[axis],
                (*graph.size, layers),
                signal=source,
                footprints=footprints,
                moments=history["moments"],
                deviation=deviation,
                filtered=update(target) if slots.svgf else write(target),
                axis=axis,
                firstLayer=first,
            )

    def _source_layers(self, lights: list[Node]) -> spy.Buffer:
        """Where each light was in the frame before."""
        sources = tuple(self._lights.index(light) if light in self._lights else _NEW_LIGHT for light in lights)
        self._lights = lights
        if sources not in self._sources:
            self._sources[sources] = self._device.structured("source layers", np.array(sources, np.uint32)[:, None])
        return self._sources[sources]


def _tiles_of(size: Size) -> Size:
    return -(-size[0] // _TILE), -(-size[1] // _TILE)

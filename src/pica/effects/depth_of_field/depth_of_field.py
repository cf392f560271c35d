"""Depth of field of a camera with an aperture."""

import math
from functools import cached_property
from typing import Any

import slangpy as spy

from pica.frame.effect import Effect
from pica.graph.graph import FrameGraph
from pica.graph.resources import Texture, write
from pica.rhi.device import Device
from pica.rhi.passes import ComputePass

_FOLDER = "effects/depth_of_field"
_LIGHT = spy.Format.rgba32_float
_LAYERS = {"surfaces": _LIGHT, "near": _LIGHT, "nearRadius": spy.Format.r32_float}
_LEVELS = 6  # gather.slang: LEVELS
_TILE = 16  # near_tiles.slang: TILE
_WIDE = 4.5  # gather.slang: WIDE
_LARGEST = 1 / 8
"""Radius of the largest circle of confusion over the picture's height."""


class DepthOfField(Effect):
    """The picture as a lens shows it (width, height, rgba32_float): Jimenez 2014, "Next Generation Post Processing in
    Call of Duty: Advanced Warfare". Only for cameras with an aperture."""

    name = "depth_of_field"

    def __init__(self, device: Device) -> None:
        self._device = device

    @cached_property
    def _passes(self) -> dict[str, ComputePass]:
        """Made for the first camera with an aperture."""
        names = "defocus_half", "reduce_level", "near_tiles", "spread_tiles", "gather", "apply_blur"
        return {name: self._device.compute(f"{_FOLDER}/{name}.slang") for name in names}

    def __call__(self, graph: FrameGraph, picture: Texture, alpha: Texture | None) -> tuple[Texture, Texture | None]:
        """The picture and its alpha, if there is one, through the aperture."""
        with graph.scope(self.name):
            lens = self._lens(graph)
            through = self._through(graph, "picture", picture, lens)
            return through, None if alpha is None else self._through(graph, "alpha", alpha, lens)

    def _lens(self, graph: FrameGraph) -> dict[str, Any]:
        height = graph.output_size[1]
        return {
            "apertureScale": lambda frame: (
                frame.camera.aperture_radius / frame.camera.focus_distance * height / (2 * frame.camera.half_height)
            ),
            "nearestFocus": lambda frame: frame.camera.near / frame.camera.focus_distance,
            "largestCircle": height * _LARGEST,
        }

    def _through(self, graph: FrameGraph, name: str, picture: Texture, lens: dict[str, Any]) -> Texture:
        passes, size = self._passes, graph.output_size
        widest = size[1] * _LARGEST / 2
        count = min(_LEVELS, 1 + max(0, math.ceil(math.log2(widest / _WIDE))))
        levels = self._levels(graph, name, picture, lens, count)
        half = levels["surfaces"][0].size
        every = {layer: (*found, *found[-1:] * (_LEVELS - count)) for layer, found in levels.items()}
        gathered = {layer: graph.texture(f"{name} {layer}", _LIGHT, half) for layer in ("behind", "front")}
        graph.add(
            passes["gather"],
            (*half, 1),
            reaching=self._tiles(graph, name, levels["nearRadius"][0], widest),
            size=spy.uint2(*half),
            levelCount=count,
            blades=lambda frame: frame.camera.aperture_blades,
            **every,
            **{layer: write(texture) for layer, texture in gathered.items()},
        )
        focused = graph.texture(f"{name} in focus", _LIGHT, size)
        outputs = {"focused": write(focused), "size": spy.uint2(*size)}
        graph.add(passes["apply_blur"], (*size, 1), picture=picture, **gathered, **lens, **outputs)
        return focused

    def _levels(
        self, graph: FrameGraph, name: str, picture: Texture, lens: dict[str, Any], count: int
    ) -> dict[str, list[Texture]]:
        """By layer, the picture at half size and coarser."""
        sizes = [_halved(graph.output_size)]
        while len(sizes) < count:
            sizes.append(_halved(sizes[-1]))
        levels = {
            layer: [graph.texture(f"{name} {layer} {level}", kind, size) for level, size in enumerate(sizes)]
            for layer, kind in _LAYERS.items()
        }
        for level, size in enumerate(sizes):
            written = {layer: write(textures[level]) for layer, textures in levels.items()}
            if level == 0:
                whole = spy.uint2(*graph.output_size)
                graph.add(self._passes["defocus_half"], (*size, 1), picture=picture, size=whole, **lens, **written)
                continue
            finer = {
                key: levels[layer][level - 1]
                for key, layer in (("finer", "surfaces"), ("finerNear", "near"), ("finerRadius", "nearRadius"))
            }
            graph.add(self._passes["reduce_level"], (*size, 1), size=spy.uint2(*sizes[level - 1]), **finer, **written)
        return levels

    def _tiles(self, graph: FrameGraph, name: str, radii: Texture, widest: float) -> Texture:
        """Largest circles in front of the focus, where they reach."""
        count = -(-radii.size[0] // _TILE), -(-radii.size[1] // _TILE)
        tiles, reaching = (
            graph.texture(f"{name} {what}", spy.Format.r32_float, count) for what in ("near tiles", "reached tiles")
        )
        every = count[0] * _TILE, count[1] * _TILE, 1
        graph.add(self._passes["near_tiles"], every, nearRadius=radii, tiles=write(tiles), size=spy.uint2(*radii.size))
        graph.add(
            self._passes["spread_tiles"],
            (*count, 1),
            tiles=tiles,
            reaching=write(reaching),
            count=spy.uint2(*count),
            reach=math.ceil(widest / _TILE),
        )
        return reaching


def _halved(size: tuple[int, int]) -> tuple[int, int]:
    return (size[0] + 1) // 2, (size[1] + 1) // 2

"""The G-buffer: the visible surface of each pixel, as one block that shaders read."""

from collections.abc import Collection, Mapping
from typing import Any

import slangpy as spy

from pica.graph.graph import FrameGraph
from pica.graph.resources import TEXTURE_USAGE, Block, History, Lifetime, Size, Texture, Write, write
from pica.rhi.device import Device
from pica.rhi.passes import ComputePass

_SHAPES = {"visibility": spy.Format.rg32_uint, "depth": spy.Format.r32_float, "normals": spy.Format.rg32_uint}
"""Of which the frame before is still there."""
_MATERIALS = {"material": spy.Format.rgba32_uint, "emission": spy.Format.rg32_uint, "motion": spy.Format.rg32_uint}
_OPTIONAL = {"coats": spy.Format.rg32_uint, "lobes": spy.Format.rgba32_uint}
"""Of a single texel where no material of the scene has any."""
VISIBILITY_USAGE = TEXTURE_USAGE | spy.TextureUsage.render_target
_USAGE = {"visibility": VISIBILITY_USAGE}


_PYRAMID_GROUP = 16
"""Pixels a side that a group of depth_pyramid.slang has."""


class GBuffer:
    """Textures of one size that a frame fills; the fields of frame/gbuffer.slang."""

    def __init__(
        self, graph: FrameGraph, size: Size, optional: Collection[str], lifetime: Lifetime = Lifetime.FRAME
    ) -> None:
        """Declare them. `optional`: "coats" and "lobes", where materials have such. `lifetime`: of all but shapes."""
        self.size, self._optional = size, frozenset(optional)
        self.shapes: History = graph.history("shapes", _SHAPES, size, usage=_USAGE)
        materials = {name: graph.texture(name, kind, size, lifetime=lifetime) for name, kind in _MATERIALS.items()}
        for name, kind in _OPTIONAL.items():
            materials[name] = graph.texture(name, kind, size if name in optional else (1, 1), lifetime=lifetime)
        self.textures: Mapping[str, Texture] = {**self.shapes.textures, **materials}
        self.block: Block
        self.glass_layers: list[Texture] = []
        """(width, height, rg32_uint) each: record + 1 and primitive of transmissive and blended surfaces in front of
        the G-buffer's, nearest first; 0 in the first number where there is none. Empty: such surfaces are in the
        G-buffer, or there are none."""
        self._half: GBuffer | None = None
        self._pyramid: Texture | None = None

    @property
    def glass(self) -> Texture | None:
        """The nearest of `glass_layers`. Where camera rays write it, only the first number says anything: not 0."""
        return self.glass_layers[0] if self.glass_layers else None

    def filled(self, graph: FrameGraph) -> None:
        """The passes that fill it have been added: from here on the block has it."""
        before = {f"previous{name.capitalize()}": texture.previous for name, texture in self.shapes.textures.items()}
        self.block = graph.block("frame/gbuffer.slang", "gbuffer", **self.textures, **before)

    def written(self, *names: str) -> dict[str, Write]:
        """Arguments for a pass that fills these textures, or all by default."""
        return {name: write(self.textures[name]) for name in names or self.textures}

    def at_half(self, graph: FrameGraph) -> "GBuffer":
        """The same at half width and height, for passes with `graph.half_frame`; filled at first use."""
        if self._half is None:
            with graph.scope("half_gbuffer"):
                self._half = self._make_half(graph)
        return self._half

    def half_blocks(self, graph: FrameGraph) -> dict[str, Any]:
        """Arguments of a pass at half width and height: the blocks `frame` and `gbuffer`."""
        return {"frame": graph.half_frame, "gbuffer": self.at_half(graph)}

    def depth_pyramid(self, graph: FrameGraph) -> Texture:
        """(columns, rows, rg32_float) nearest and farthest depth of squares of pixels, as frame/depth_levels.slang has
        them, for marches over the depth buffer; filled at first use."""
        if self._pyramid is None:
            width, height = (-(-length // _PYRAMID_GROUP) * _PYRAMID_GROUP for length in self.size)
            with graph.scope("depth_pyramid"):
                self._pyramid = graph.texture("depth pyramid", spy.Format.rg32_float, (width // 2, height))
                threads = (width // 2, height // 2, 1)
                graph.add(graph.device.shared(_depth_pyramid), threads, pyramid=write(self._pyramid))
        return self._pyramid

    def _make_half(self, graph: FrameGraph) -> "GBuffer":
        half = GBuffer(graph, graph.half_size, self._optional)
        state = half.shapes.state
        # A frame that had no half G-buffer left nothing that a shape of now may be found in.
        graph.record(
            "forget shapes",
            lambda frame, visibility: frame.encoder.clear_texture_uint(visibility),
            when=lambda frame: not state.precedes(frame),
            visibility=half.textures["visibility"].previous,
        )
        textures = {f"half{name.capitalize()}": write(texture) for name, texture in half.textures.items()}
        there = {"coated": "coats" in self._optional, "hasLobes": "lobes" in self._optional}
        step = graph.device.shared(_half_gbuffer)
        graph.add(step, graph.half_grid, frame=graph.half_frame, gbuffer=self, **there, **textures)
        half.filled(graph)
        return half


def _half_gbuffer(device: Device) -> ComputePass:
    return device.compute("frame/half_gbuffer.slang")


def _depth_pyramid(device: Device) -> ComputePass:
    return device.compute("frame/depth_pyramid.slang")

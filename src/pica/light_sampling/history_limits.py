"""How many frames of a history count where what shines moves, or what hides its light."""

import numpy as np
import slangpy as spy

from pica.frame.context import FrameContext
from pica.gpu_scene.view import SceneView
from pica.graph.graph import FrameGraph
from pica.graph.resources import Block, History, Texture, write
from pica.light_sampling.light_motions import FOLLOWED_LIGHTS, LightMotions
from pica.programs.library import programs
from pica.rhi.device import Device

_SECTIONS = 32
"""Sections of emissive meshes that are followed, the first of those that move."""
_EMITTER = 80
"""Bytes of a MovingEmitter (moving_emitters.slang)."""


class HistoryLimits:
    """Decides it in frames in which any moves; others cost nothing."""

    def __init__(self, device: Device) -> None:
        self._list = programs(device).compute("light_sampling/list_emitters.slang")
        self._limit = programs(device).compute("light_sampling/limit_histories.slang")
        self._sections = np.zeros(_SECTIONS, np.uint32)
        self._buffer = device.structured("moving sections", self._sections)
        self._count = 0
        self._follows = self._apply = False

    def __call__(
        self, graph: FrameGraph, view: SceneView, motions: LightMotions, picture: History, rates: Texture | None
    ) -> Block:
        """The block of filtering/history_limits.slang. `picture`: Antialiasing.history's; `rates`: ShadowTextures'."""

        def follow(frame: FrameContext) -> None:
            sections = view.moving_emitters()[:_SECTIONS] if frame.changed_lights else ()
            self._count = len(sections)
            self._follows = motions.moved or self._count > 0
            self._apply = self._follows or (rates is not None and frame.changed_scene and bool(picture.known(frame)))
            if self._count:
                self._sections[: self._count] = sections
                frame.encoder.upload_buffer_data(self._buffer, 0, self._sections.view(np.uint8))

        with graph.scope("light_sampling"):
            frames = graph.texture("history limits", spy.Format.rg8_uint)
            emitters = graph.buffer("moving emitters", _EMITTER * (FOLLOWED_LIGHTS + _SECTIONS), struct_size=_EMITTER)
            count = graph.buffer("number of moving emitters", 4, struct_size=4)
            graph.record("follow emissive meshes", follow)
            graph.add(
                self._list,
                (1, 1, 1),
                when=lambda frame: self._follows,
                lightMotions=motions.buffer,
                movingSections=self._buffer,
                movingSectionCount=lambda frame: self._count,
                emitters=write(emitters),
                emitterCount=write(count),
            )
            graph.add(
                self._limit,
                graph.grid,
                when=lambda frame: self._apply,
                previousPicture=picture.textures["picture"].previous,
                pictureKnown=picture.known,
                shadowRates=rates or graph.nothing(spy.Format.r8_unorm),
                hasRates=int(rates is not None),
                emitters=emitters,
                emitterCount=count,
                hasEmitters=lambda frame: int(self._follows),
                limits=write(frames),
            )
            return graph.block(
                "filtering/history_limits.slang",
                "historyLimits",
                frames=frames,
                apply=lambda frame: int(self._apply),
            )

"""Specular reflections: a quarter of a ray a pixel, then reuse in space and time (RTG 25, 25.2.2)."""

from typing import Any

import slangpy as spy

from pica.effects.reflections.convergence_correction import ConvergenceCorrection
from pica.effects.reflections.debug_aovs import (
    REPROJECTION_AOVS,
    offer_history_aovs,
    offer_ray_aovs,
    offer_reflection_aovs,
    offer_reprojection_aovs,
)
from pica.effects.reflections.ray_grid import ray_size
from pica.effects.reflections.ray_traced.traced_rays import TracedRays
from pica.effects.reflections.screen_space.screen_rays import ScreenRays
from pica.filtering.reprojection import Reprojection
from pica.frame.aovs import light_of
from pica.frame.context import FrameContext
from pica.frame.effect import Effect, Reference, ReferenceLayer
from pica.frame.gbuffer import GBuffer
from pica.frame.signals.indirect import ENDLESS, IndirectResult
from pica.frame.signals.light import SIGNAL
from pica.frame.signals.mirrors import MirrorImages
from pica.graph.graph import FrameGraph
from pica.graph.resources import History, Lifetime, Texture, write
from pica.light_sampling.light_sampler import LightSamples
from pica.programs.library import programs
from pica.rhi.device import Device
from pica.settings import ReflectionsSettings
from pica.tracing.many_samples import ManySamples
from pica.tracing.ray_buffers import Tracer

_FOLDER = "effects/reflections"
_LIGHT = spy.Format.rgba32_float


class Reflections(Effect):
    """Specular reflections of other surfaces, of emissive triangles and of the environment."""

    name = "reflections"
    aov_names = ("reflections",)

    def __init__(
        self,
        device: Device,
        settings: ReflectionsSettings,
        tracer: Tracer | None,
        cache: str | None,
        filters: bool,
    ) -> None:
        """`cache`: the module of the cache of indirect light, if calls pass one. `filters`:
        DebugSettings.filters."""
        self._device, self._cache, self._filters = device, cache, filters
        by_rays = settings.mode == "ray_traced"
        self._traced = TracedRays(device, settings, tracer, cache, filters) if by_rays else None
        self._screen = ScreenRays(device) if settings.mode == "screen_space" else None
        self._by_mirror_rays = settings.reconstruction == "mirror_rays" and filters
        self._adapts = settings.rays == "adaptive" and by_rays and not self._by_mirror_rays
        step = "reconstruct_radiance" if self._by_mirror_rays else "reconstruct"
        self._reconstruct = programs(device).compute(f"{_FOLDER}/{step}.slang")
        self._accumulate = programs(device).compute(f"{_FOLDER}/reflection_history.slang")
        self._filter = programs(device).compute(f"{_FOLDER}/reflection_filter.slang")
        self._correction = ConvergenceCorrection(device) if filters and not self._by_mirror_rays else None
        reference = f"{_FOLDER}/reflection_reference.slang"
        self._by_many_paths = ManySamples(device, reference, "MirroredLight", "surface", tracer, is_light=True)

    def reset(self) -> None:
        """Discard the state of earlier frames."""
        if self._correction is not None:
            self._correction.reset()

    def surroundings(self, graph: FrameGraph) -> Texture | None:
        """The texture for specular light of the prefiltered environment, (width, height,
        rgba32_float) over albedo; None if reflections do not add it, and without screen-space reflections."""
        with graph.scope(self.name):
            return None if self._screen is None else graph.texture("mirrored surroundings", _LIGHT)

    def reference(self) -> Reference | None:
        """The ground truth by many rays; None for screen-space reflections."""
        if self._traced is None:
            return None
        inputs = "frame", "gbuffer", "scene", "lightSlots"
        bounces = self._traced.bounces | ({"indirectBounces": ENDLESS} if self._cache else {})
        layers = {"reflections": ReferenceLayer("reflections", bounces)}
        return Reference(self._by_many_paths, inputs, layers)

    def __call__(
        self,
        graph: FrameGraph,
        gbuffer: GBuffer,
        light: LightSamples,
        reprojection: Reprojection,
        indirect: IndirectResult | None,
        surroundings: Texture | None,
        picture: Texture | None,
        mirrors: bool,
    ) -> tuple[Texture, MirrorImages | None]:
        """The specular reflections of this frame's surfaces, as in frame/signals/light.py, and the motion of what flat
        mirrors show; None without filters, or if nothing mirrors sharply.

        `indirect`: indirect light at hits; None: none. `surroundings`: the texture of that function, filled;
        with it `picture`, the light of this frame towards the camera without reflections. `mirrors`: whether any
        material may mirror sharply.
        """
        with graph.scope(self.name):
            history = graph.history("history", {"history": _LIGHT}, layers=1)
            # Screen-space rays read the reflections of the previous frame.
            lifetime = Lifetime.FRAME if self._screen is None else Lifetime.KEPT
            reflected = graph.texture("reflected", SIGNAL, lifetime=lifetime)
            dense = self._adapts and mirrors
            size = ray_size(graph, dense)
            hit_position_and_pdf = graph.texture("hit position and pdf", _LIGHT, size)
            ray_light = single = graph.texture("light", spy.Format.rgba32_uint, size)
            hit_motion = graph.nothing(spy.Format.rgba16_float)
            if self._traced is not None:
                hit_motion = graph.texture("hit motion", spy.Format.rgba16_float, size)
                rays = hit_position_and_pdf, ray_light, hit_motion, int(self._by_mirror_rays), dense
                single = self._traced(graph, gbuffer, light, indirect, *rays)
            if self._screen is not None:
                assert surroundings is not None and picture is not None
                state = history.state
                self._screen(
                    graph,
                    gbuffer,
                    surroundings,
                    known=lambda frame: int(self._filters and state.precedes(frame)),
                    mirrors=int(self._by_mirror_rays),
                    picture=picture,
                    reflected=reflected,
                    hitPositionAndPdf=write(hit_position_and_pdf),
                    light=write(ray_light),
                )
            offer_ray_aovs(graph, single)
            signal, images = self._rebuild(graph, history, hit_position_and_pdf, ray_light, hit_motion, dense)
            graph.add(
                self._filter,
                graph.grid,
                signal=signal,
                reflected=write(reflected),
            )
            if self._correction is not None:
                self._correction(graph, reprojection, hit_position_and_pdf, single, reflected, dense)
            graph.offer("reflections", (reflected,), light_of)
        return reflected, images

    def _rebuild(
        self,
        graph: FrameGraph,
        history: History,
        hit_position_and_pdf: Texture,
        light: Texture,
        hit_motion: Texture,
        dense: bool,
    ) -> tuple[Texture, MirrorImages | None]:
        """(width, height, rgba32_float) mirrored light over albedo from fewer rays, and its variance; and the motion as
        `__call__` gives it."""
        reconstructed = graph.texture("reconstructed", _LIGHT)
        distances = graph.texture("distances", spy.Format.rg32_float)
        motions = graph.texture("motions", spy.Format.rgba16_float)
        graph.add(
            self._reconstruct,
            graph.grid,
            hitPositionAndPdf=hit_position_and_pdf,
            light=light,
            reconstructed=write(reconstructed),
            distances=write(distances),
            hitMotion=hit_motion,
            moves=self._moves,
            motions=write(motions),
            dense=int(dense),
            **({} if self._by_mirror_rays else {"filtered": int(self._filters)}),
        )
        offer_reflection_aovs(graph, reconstructed, distances)
        if not self._filters:
            return reconstructed, None
        followed = graph.history("followed", {"followed": spy.Format.r8_uint})
        images = MirrorImages(followed["followed"], graph.texture("image shift", spy.Format.rg32_float))
        signal = graph.texture("signal", _LIGHT)
        past = {"reconstructed": reconstructed, "distances": distances, "motions": motions, "moves": self._moves}
        graph.add(
            self._accumulate,
            graph.grid,
            dense=int(dense),
            known=history.known,
            signal=write(signal),
            imageShift=write(images.shift),
            **history.swap(),
            **followed.swap(),
            **past,
        )
        offer_history_aovs(graph, signal, history["history"])
        if graph.wants(*REPROJECTION_AOVS):
            self._show_past(graph, signal, history, past)
        return signal, images if dense else None

    def _moves(self, frame: FrameContext) -> int:
        """Whether rays know how what they hit has moved."""
        return int(frame.changed_scene and self._traced is not None)

    def _show_past(self, graph: FrameGraph, signal: Texture, history: History, past: dict[str, Any]) -> None:
        """Views of the frame before are made by a pass of their own."""
        formats = {"ofSurface": _LIGHT, "ofImage": _LIGHT, "choice": spy.Format.rg32_float}
        textures = {name: graph.texture(name, kind) for name, kind in formats.items()}
        graph.add(
            self._device.compute(f"{_FOLDER}/reflection_debug.slang"),
            graph.grid,
            signal=signal,
            previousHistory=history["history"].previous,
            **past,
            **{name: write(texture) for name, texture in textures.items()},
        )
        offer_reprojection_aovs(graph, textures)

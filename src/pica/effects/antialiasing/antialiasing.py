"""Temporal antialiasing and upscaling: jittered frames of the render size make one picture of the output size."""

from functools import partial

import slangpy as spy

from pica.effects.antialiasing.coverage import Coverage
from pica.effects.antialiasing.temporal_resolve import TemporalResolve
from pica.frame.aovs import alpha_of
from pica.frame.context import FrameContext
from pica.frame.effect import Effect
from pica.frame.signals.mirrors import MirrorImages
from pica.graph.graph import FrameGraph
from pica.graph.resources import Buffer, History, Lifetime, Texture, write
from pica.rhi.device import Device
from pica.settings import AntialiasingSettings


class Antialiasing(Effect):
    """The accumulated picture (width, height, rgba32_float): the plain mean at rest, otherwise a reprojected
    history (RTG 25, 25.1, last step). Alpha likewise, if the background is transparent."""

    name = "antialiasing"

    def __init__(self, device: Device, settings: AntialiasingSettings, transparent: bool = False) -> None:
        """`transparent`: pictures have alpha, by which they are premultiplied: `radiance` is 0 where it is 0."""
        self._settings = settings
        self._resolve = TemporalResolve(device, "antialiasing")
        self._coverage = Coverage(device) if transparent else None
        self.aov_names = ("alpha",) if transparent else ()
        if settings.sharpness > 0:
            self._sharpen = device.compute("effects/antialiasing/sharpen.slang")
        self._restarted = False

    def restart(self) -> None:
        """Restart accumulation with the next frame; other histories stay."""
        self._restarted = True

    def history(self, graph: FrameGraph) -> History:
        """Of the picture: TemporalResolve.history."""
        with graph.scope(self.name):
            return self._resolve.history(graph)

    def __call__(
        self,
        graph: FrameGraph,
        history: History,
        radiance: Texture,
        exposure: Buffer,
        glass: History | None,
        shadows: Texture | None,
        mirrors: MirrorImages | None,
    ) -> tuple[Texture, Texture | None]:
        """The picture with this frame's `radiance`, and its alpha in r, None where the background is not transparent.

        `history`: what the function of this name gave. `exposure`: of the frame before (Post.exposure). `glass`,
        `shadows`, `mirrors`: as TemporalResolve has them.
        """
        with graph.scope(self.name):
            graph.record("restarts", self._decide)
            alpha = None
            if self._coverage is not None:
                alpha = self._coverage(graph, radiance, glass, self._restarts)
            picture = self._resolve(graph, history, radiance, exposure, glass, shadows, mirrors, self._restarts)
            if self._settings.sharpness > 0:
                picture = self._sharpened(graph, picture, exposure)
        return picture, alpha

    def offer(self, graph: FrameGraph, alpha: Texture | None) -> None:
        """Offer the finished alpha, after lens effects."""
        if alpha is not None:
            with graph.scope(self.name):
                graph.offer("alpha", (alpha,), partial(alpha_of, 0))

    def _decide(self, frame: FrameContext) -> None:
        accumulates = self._settings.mode == "accumulate"
        self._restarting, self._restarted = self._restarted or (frame.changed and accumulates), False

    def _restarts(self, frame: FrameContext) -> bool:
        return self._restarting

    def _sharpened(self, graph: FrameGraph, picture: Texture, exposure: Buffer) -> Texture:
        light = spy.Format.rgba32_float
        sharpened = graph.texture("sharpened", light, graph.output_size, lifetime=Lifetime.KEPT)
        graph.add(
            self._sharpen,
            graph.output_grid,
            picture=picture,
            exposure=exposure,
            sharpened=write(sharpened),
            sharpness=self._settings.sharpness,
        )
        return sharpened

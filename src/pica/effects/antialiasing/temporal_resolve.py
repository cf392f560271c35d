"""One picture of many jittered frames."""

from collections.abc import Callable
from typing import Any

import slangpy as spy

from pica.filtering.convergence import AT_REST_AFTER_RELIT
from pica.frame.signals.mirrors import MirrorImages
from pica.graph.graph import FrameGraph
from pica.graph.resources import Buffer, History, Texture, write
from pica.rhi.device import Device


class TemporalResolve:
    """The mean of all samples where nothing changes, a history that follows the motion elsewhere."""

    def __init__(self, device: Device, name: str, is_light: bool = True) -> None:
        self._name, self._is_light = name, is_light
        edge = spy.TextureAddressingMode.clamp_to_edge
        self._linear = device.sampler(address_u=edge, address_v=edge)
        self._no_glass = device.texture("no glass", spy.Format.rgba32_uint, (1, 1))
        self._nothing_moves = device.texture("nothing moves", spy.Format.r8_uint, (1, 1))
        self._no_shift = device.texture("no shift", spy.Format.rg32_float, (1, 1))
        self._pass = device.compute("effects/antialiasing/temporal_resolve.slang")

    def _glass_inputs(self, glass: History | None) -> dict[str, Any]:
        if glass is None:
            return {
                "glassMotion": self._no_glass,
                "previousGlassMotion": self._no_glass,
                "hasGlass": 0,
                "knownGlass": 0,
            }
        motion = glass.textures["glassMotion"]
        known = {"hasGlass": 1, "knownGlass": glass.known}
        return {"glassMotion": motion, "previousGlassMotion": motion.previous, **known}

    def history(self, graph: FrameGraph) -> History:
        """What `__call__` takes. `picture`: radiance, and in alpha the samples in the mean of a pixel at rest, negative
        elsewhere."""
        formats = {"picture": spy.Format.rgba32_float, "deviation": spy.Format.rgba16_float}
        return graph.history(self._name, formats, graph.output_size)

    def __call__(
        self,
        graph: FrameGraph,
        history: History,
        samples: Texture,
        exposure: Buffer,
        glass: History | None,
        shadows: Texture | None = None,
        mirrors: MirrorImages | None = None,
        restarts: Callable[[Any], bool] | None = None,
    ) -> Texture:
        """The picture with this frame's `samples` (render size).

        `exposure`: of the previous frame. `glass`: Transparency's, if there is any. `shadows`: ShadowTextures.followed.
        `mirrors`: of Reflections. `restarts`: whether accumulation restarts, as a function of the frame.
        """
        state = history.state

        def restart(frame: Any) -> None:
            if restarts is not None and restarts(frame):
                state.reset()

        if restarts is not None:
            graph.record("restart", restart)
        moving = graph.texture(f"{self._name} moving picture", spy.Format.rgba16_float, graph.output_size)
        graph.add(
            self._pass,
            graph.output_grid,
            radiance=samples,
            exposure=exposure,
            **self._glass_inputs(glass),
            movingShadows=shadows or self._nothing_moves,
            movingImages=mirrors.followed if mirrors else self._nothing_moves,
            imageShift=mirrors.shift if mirrors else self._no_shift,
            hasShadows=int(shadows is not None),
            hasImages=int(mirrors is not None),
            isLight=int(self._is_light),
            linearSampler=self._linear,
            movingPicture=write(moving),
            known=history.known,
            changed=lambda frame: int(frame.changed or frame.since_relit < AT_REST_AFTER_RELIT),
            relit=lambda frame: int(frame.since_relit < AT_REST_AFTER_RELIT),
            **history.swap(),
        )
        return history["picture"]

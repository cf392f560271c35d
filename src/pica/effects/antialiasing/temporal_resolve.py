"""One picture of many jittered frames."""

from collections.abc import Callable
from typing import Any

import slangpy as spy

from pica.filtering.convergence import AT_REST_AFTER_RELIT
from pica.graph.graph import FrameGraph
from pica.graph.resources import Buffer, History, Texture, write
from pica.rhi.device import Device


class TemporalResolve:
    """The mean of all samples where nothing changes, a history that follows the motion elsewhere."""

    def __init__(self, device: Device, name: str) -> None:
        self._name = name
        edge = spy.TextureAddressingMode.clamp_to_edge
        self._linear = device.sampler(address_u=edge, address_v=edge)
        self._no_glass = device.texture("no glass", spy.Format.rgba32_uint, (1, 1))
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

    def __call__(
        self,
        graph: FrameGraph,
        samples: Texture,
        exposure: Buffer,
        glass: History | None,
        restarts: Callable[[Any], bool] | None = None,
    ) -> Texture:
        """The picture with this frame's `samples` (render size). `exposure`: of the previous frame. `glass`:
        Transparency's, if there is any. `restarts`: whether
        accumulation restarts, as a function of the frame."""
        formats = {"picture": spy.Format.rgba32_float, "deviation": spy.Format.rgba16_float}
        history = graph.history(self._name, formats, graph.output_size)
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
            linearSampler=self._linear,
            movingPicture=write(moving),
            known=history.known,
            changed=lambda frame: int(frame.changed or frame.since_relit < AT_REST_AFTER_RELIT),
            relit=lambda frame: int(frame.since_relit < AT_REST_AFTER_RELIT),
            **history.swap(),
        )
        return history["picture"]

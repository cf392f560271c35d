"""Paths chosen from those of earlier frames and of neighbours: ReSTIR GI (Ouyang et al. 2021)."""

import slangpy as spy

from pica.frame.context import FrameContext, Size, half_size
from pica.frame.gbuffer import GBuffer
from pica.frame.history import History
from pica.frame.reprojection import Reprojection
from pica.gpu_scene.view import SceneView
from pica.rhi.device import Device
from pica.tracing.ray_buffers import Tracer
from pica.tracing.ray_effect import ray_effect

_FOLDER = "effects/global_illumination"


class PathResampling:
    """Puts what paths chosen from many bring in the place of what each pixel's own path does."""

    def __init__(self, device: Device, size: Size, tracer: Tracer | None) -> None:
        modules = {"reuse_in_time": "ReuseInTime", "reuse_of_neighbours": "ReuseOfNeighbours"}
        self._in_time, self._of_neighbours = (
            ray_effect(device, f"{_FOLDER}/{module}.slang", effect, "hit", tracer) for module, effect in modules.items()
        )
        formats = dict.fromkeys(("starts", "ends", "kept"), spy.Format.rgba32_uint)
        self._reservoirs = History(device, "indirect reservoirs", formats, half_size(size))

    def resize(self, size: Size) -> None:
        """Work at another size."""
        self._reservoirs.resize(half_size(size))

    def reset(self) -> None:
        """Forget all paths."""
        self._reservoirs.reset()

    def __call__(
        self,
        frame: FrameContext,
        gbuffer: GBuffer,
        scene: SceneView,
        reprojection: Reprojection,
        found: spy.Texture,
        met: spy.Texture,
    ) -> None:
        """Replace the light in `found`, of paths that were to be chosen from (indirect_rays.slang)."""
        half = frame.at_half()
        shared = {"frame": half, "gbuffer": gbuffer.at_half(frame), "scene": scene, "found": found}
        reservoirs = self._reservoirs.turn(frame)
        known = int(not (self._reservoirs.empty or frame.changed_lights))  # the light of paths is that of their frame
        self._in_time(half, half.size, **shared, **reservoirs, reprojection=reprojection, met=met, known=known)
        self._of_neighbours(half, half.size, **shared, **self._reservoirs.current)

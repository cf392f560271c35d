"""What a still picture's reflections lack of the light of each pixel's own rays."""

import slangpy as spy

from pica.frame.context import FrameContext
from pica.frame.convergence import OWN_RAYS_FROM
from pica.frame.gbuffer import GBuffer
from pica.frame.reprojection import Reprojection
from pica.gpu_scene.view import SceneView
from pica.graph.graph import FrameGraph
from pica.graph.resources import Lifetime, Texture, update
from pica.programs.library import programs
from pica.rhi.device import Device

_FOLDER = "effects/reflections"


class OwnRays:
    """Turns what is rebuilt from neighbours' rays into the mean of a pixel's own, while nothing changes."""

    def __init__(self, device: Device) -> None:
        self._collect = programs(device).compute(f"{_FOLDER}/own_rays.slang")
        self._mend = device.compute(f"{_FOLDER}/own_light.slang")
        self._newest = -1

    def reset(self) -> None:
        """Forget."""
        self._newest = -1

    def __call__(
        self,
        graph: FrameGraph,
        gbuffer: GBuffer,
        scene: SceneView,
        reprojection: Reprojection,
        hit_position_and_pdf: Texture,
        light: Texture,
        reflected: Texture,
    ) -> None:
        """Mend `reflected`.

        `hit_position_and_pdf` and `light`: of this frame's rays, as reflected.slang has them.
        """
        missing = graph.texture("missing light", spy.Format.rgba32_float, lifetime=Lifetime.KEPT)
        squares = graph.texture("missing squares", spy.Format.r32_float, lifetime=Lifetime.KEPT)
        shared = {"frame": graph.frame, "gbuffer": gbuffer}

        def resting(frame: FrameContext) -> bool:
            return reprojection.unchanged >= OWN_RAYS_FROM

        def known(frame: FrameContext) -> int:
            goes_on = reprojection.unchanged > OWN_RAYS_FROM and self._newest + 1 == frame.index
            self._newest = frame.index
            return int(goes_on)

        graph.add(
            self._collect,
            graph.half_grid,
            when=resting,
            scene=scene,
            hitPositionAndPdf=hit_position_and_pdf,
            light=light,
            reflected=reflected,
            missing=update(missing),
            squares=update(squares),
            known=known,
            **shared,
        )
        graph.add(
            self._mend,
            graph.grid,
            when=resting,
            missing=missing,
            squares=squares,
            reflected=update(reflected),
            **shared,
        )

"""Reflections' rays over the depth buffer, where nothing traces them."""

import slangpy as spy

from pica.frame.context import FrameContext, Size, half_size
from pica.frame.gbuffer import GBuffer
from pica.frame.reprojection import Reprojection
from pica.gpu_scene.view import SceneView
from pica.programs.library import programs
from pica.rhi.device import Device

_FOLDER = "effects/reflections"
_GROUP = 16
"""Pixels a side that a group of depth_pyramid.slang has."""


class ScreenRays:
    """A ray for 2x2 pixels over the depth buffer; beyond it is the prefiltered environment."""

    def __init__(self, device: Device, size: Size) -> None:
        self._device = device
        self._build = device.compute(f"{_FOLDER}/depth_pyramid.slang")
        self._march = programs(device).compute(f"{_FOLDER}/screen_space.slang")
        self._allocate(size)

    def _allocate(self, size: Size) -> None:
        width, height = (-(-length // _GROUP) * _GROUP for length in size)
        self._levels = self._device.texture("depth pyramid", spy.Format.rg32_float, (width // 2, height))
        self.surroundings = self._device.texture("mirrored surroundings", spy.Format.rgba32_float, size)
        """(width, height) what each pixel mirrors of the prefiltered environment, over albedo."""

    def resize(self, size: Size) -> None:
        """Work at another size."""
        self._device.give_back(self._levels, self.surroundings)
        self._allocate(size)

    def __call__(
        self,
        frame: FrameContext,
        gbuffer: GBuffer,
        scene: SceneView,
        reprojection: Reprojection,
        **pictures: object,
    ) -> None:
        """March. `pictures`: the parameters of screen_space.slang beyond that."""
        width, height = half_size(frame.size)
        threads = (-(-width // 8) * 8, -(-height // 8) * 8, 1)
        self._build(frame, threads, frame=frame, gbuffer=gbuffer, pyramid=self._levels)
        self._march(scene.material_types)(
            frame,
            (width, height, 1),
            frame=frame,
            gbuffer=gbuffer,
            scene=scene,
            reprojection=reprojection,
            pyramid=self._levels,
            surroundings=self.surroundings,
            **pictures,
        )

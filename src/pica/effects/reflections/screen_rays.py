"""Reflections' rays over the depth buffer: in place of traced ones, or ahead of them."""

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


class DepthMarch:
    """A ray for 2x2 pixels over the depth buffer."""

    def __init__(self, device: Device, size: Size, step: str) -> None:
        """`step`: the name of the file that marches."""
        self._device = device
        self._build = device.compute(f"{_FOLDER}/depth_pyramid.slang")
        self._march = programs(device).compute(f"{_FOLDER}/{step}.slang")
        self._allocate(size)

    def _allocate(self, size: Size) -> None:
        width, height = (-(-length // _GROUP) * _GROUP for length in size)
        self._levels = self._device.texture("depth pyramid", spy.Format.rg32_float, (width // 2, height))

    def resize(self, size: Size) -> None:
        """Work at another size."""
        self._device.give_back(self._levels)
        self._allocate(size)

    def __call__(self, frame: FrameContext, gbuffer: GBuffer, scene: SceneView, **pictures: object) -> None:
        """March. `pictures`: the parameters of the step beyond that."""
        width, height = half_size(frame.size)
        threads = (-(-width // 8) * 8, -(-height // 8) * 8, 1)
        self._build(frame, threads, frame=frame, gbuffer=gbuffer, pyramid=self._levels)
        self._march(scene.material_types)(
            frame, (width, height, 1), frame=frame, gbuffer=gbuffer, scene=scene, pyramid=self._levels, **pictures
        )


class ScreenRays:
    """Rays over the depth buffer in place of traced ones; beyond it is the prefiltered environment."""

    def __init__(self, device: Device, size: Size) -> None:
        self._device = device
        self._march = DepthMarch(device, size, "screen_space")
        self._allocate(size)

    def _allocate(self, size: Size) -> None:
        self.surroundings = self._device.texture("mirrored surroundings", spy.Format.rgba32_float, size)
        """(width, height) what each pixel mirrors of the prefiltered environment, over albedo."""

    def resize(self, size: Size) -> None:
        """Work at another size."""
        self._march.resize(size)
        self._device.give_back(self.surroundings)
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
        self._march(frame, gbuffer, scene, reprojection=reprojection, surroundings=self.surroundings, **pictures)

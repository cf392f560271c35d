"""What a still picture's reflections lack of the light of each pixel's own rays."""

import slangpy as spy

from pica.frame.context import FrameContext, Size, half_size
from pica.frame.gbuffer import GBuffer
from pica.gpu_scene.view import SceneView
from pica.programs.library import programs
from pica.rhi.device import Device

_FOLDER = "effects/reflections"
_FROM = 32
"""Frames without a change after which a picture is to become that of each pixel's own rays."""


class OwnRays:
    """Turns what is rebuilt from neighbours' rays into the mean of a pixel's own, while nothing changes."""

    def __init__(self, device: Device, size: Size) -> None:
        self._device = device
        self._collect = programs(device).compute(f"{_FOLDER}/own_rays.slang")
        self._add = device.compute(f"{_FOLDER}/own_light.slang")
        self._newest = -1
        self._allocate(size)

    def _allocate(self, size: Size) -> None:
        self._textures = {
            "missing": self._device.texture("light of own reflection rays", spy.Format.rgba32_float, size),
            "squares": self._device.texture("squares of own reflection rays", spy.Format.r32_float, size),
        }

    def resize(self, size: Size) -> None:
        """Work at another size."""
        self._device.give_back(*self._textures.values())
        self._allocate(size)
        self.reset()

    def reset(self) -> None:
        """Forget."""
        self._newest = -1

    def __call__(
        self,
        frame: FrameContext,
        gbuffer: GBuffer,
        scene: SceneView,
        unchanged: int,
        ends: spy.Texture,
        light: spy.Texture,
        reflected: spy.Texture,
        radiance: spy.Texture,
    ) -> None:
        """Mend `reflected`, and `radiance`, which it is a part of.

        `unchanged`: frames since anything has changed. `ends` and `light`: of this frame's rays, as reflected.slang has
        them.
        """
        if unchanged < _FROM:
            return
        half = half_size(frame.size)
        shown = {"frame": frame, "gbuffer": gbuffer, "reflected": reflected, **self._textures}
        known = int(unchanged > _FROM and self._newest + 1 == frame.index)
        self._collect(scene.material_types)(
            frame, (*half, 1), scene=scene, ends=ends, light=light, known=known, **shown
        )
        self._add(frame, frame.grid, radiance=radiance, **shown)
        self._newest = frame.index

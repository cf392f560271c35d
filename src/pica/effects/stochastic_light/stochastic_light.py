"""Light of the slots that many sources share, from one noisy sample a pixel and frame."""

import slangpy as spy

from pica.effects.stochastic_light.views import stochastic_light_views
from pica.frame.context import FrameContext, Size
from pica.frame.effect import Aov, Effect
from pica.frame.gbuffer import GBuffer
from pica.frame.history import History, accumulate_grid
from pica.frame.reprojection import Reprojection
from pica.gpu_scene.view import SceneView
from pica.programs.library import programs
from pica.rhi.device import Device

_FOLDER = "effects/stochastic_light"
_PARTS = 2
"""demodulation.slang: PARTS."""
_STEPS = (1, 3, 9)
"""Pixels between the taps of the filter's passes; docs/measurements/tried.md compares others."""
_HANDED_OVER = 56
"""Frames without any change after which no pixel shows filtered light (stochastic_light_add.slang)."""
_KNOWN = 128
"""The same, after which a history learns nothing more: it stays as it is until something changes."""


class StochasticLightDenoiser(Effect):
    """Filters noisy light: a history in time, then an a-trous filter as wide as its variance asks for.

    Its textures are made when there is such light for the first time.
    """

    name = "stochastic_light"

    def __init__(self, device: Device, size: Size) -> None:
        self._device, self._size = device, size
        self._textures: list[spy.Texture] = []
        self._history: History | None = None
        self._accumulate = programs(device).compute(f"{_FOLDER}/stochastic_light_history.slang")
        # A pass whose parameters differ from dispatch to dispatch would be bound anew each time.
        self._passes = [device.compute(f"{_FOLDER}/stochastic_light_filter.slang") for _ in _STEPS]
        self._add = programs(device).compute(f"{_FOLDER}/stochastic_light_add.slang")

    def samples(self) -> spy.Texture:
        """(width, height, 2, rgba32_float) what the next call filters: reflected light over albedo, diffuse and
        specular; alpha 1, or 0 where nothing is reflected."""
        if not self._textures:
            self._allocate()
        return self._samples

    def _allocate(self) -> None:
        def make(label: str, texture_format: spy.Format) -> spy.Texture:
            self._textures.append(self._device.texture(label, texture_format, self._size, layers=_PARTS))
            return self._textures[-1]

        color = spy.Format.rgba32_float  # radiance in nits leaves the range of half precision
        self._samples = make("noisy light", color)
        if self._history is None:
            self._history = History(
                self._device, "stochastic light", {"history": color, "moments": color}, self._size, _PARTS
            )
        else:
            self._history.resize(self._size, _PARTS)
        self._filtered = [make("filtered light", spy.Format.rgba32_uint) for _ in range(2)]
        self._lobes = self._device.texture("mirror lobes", spy.Format.rgba32_uint, self._size)
        self._textures.append(self._lobes)

    def reset(self) -> None:
        """Drop the history."""
        if self._history is not None:
            self._history.reset()

    def resize(self, size: Size) -> None:
        """As Effect."""
        self._device.give_back(*self._textures)
        self._size, self._textures = size, []
        self.reset()

    def debug_aovs(self) -> dict[str, Aov]:
        """See views.py; "filtered" of the newest frame that needed it."""
        if self._history is None or not self._textures:
            return {}
        last = len(_STEPS) % 2
        textures = {
            "samples": self._samples,
            "filtered": self._filtered[last],
            "moments": self._history.current["moments"],
        }
        return stochastic_light_views(textures)

    def __call__(
        self, frame: FrameContext, gbuffer: GBuffer, scene: SceneView, radiance: spy.Texture, reprojection: Reprojection
    ) -> None:
        """Add the filtered `samples` to `radiance`."""
        assert self._history is not None, "samples() comes first"
        if reprojection.unchanged < _KNOWN or not self._history.stays(frame, _KNOWN):
            self._remember(frame, gbuffer, scene, reprojection)
        smoothed = reprojection.unchanged < _HANDED_OVER
        if smoothed:
            self._smooth(frame, gbuffer, scene)
        self._add(scene.material_types)(
            frame,
            frame.grid,
            frame=frame,
            gbuffer=gbuffer,
            scene=scene,
            filtered=self._filtered[len(_STEPS) % 2],
            samples=self._samples,
            moments=self._history.current["moments"],
            reprojection=reprojection,
            smoothed=int(smoothed),
            radiance=radiance,
        )

    def _remember(self, frame: FrameContext, gbuffer: GBuffer, scene: SceneView, reprojection: Reprojection) -> None:
        assert self._history is not None
        textures = self._history.turn(frame)
        self._accumulate(scene.material_types)(
            frame,
            accumulate_grid(frame.size, _PARTS),
            frame=frame,
            gbuffer=gbuffer,
            scene=scene,
            reprojection=reprojection,
            samples=self._samples,
            signal=self._filtered[0],
            lobes=self._lobes,
            known=int(not self._history.empty),
            **textures,
        )

    def _smooth(self, frame: FrameContext, gbuffer: GBuffer, scene: SceneView) -> None:
        for number, (step, smooth) in enumerate(zip(_STEPS, self._passes, strict=True)):
            source, target = number % 2, 1 - number % 2
            smooth(
                frame,
                frame.grid,
                frame=frame,
                gbuffer=gbuffer,
                scene=scene,
                signal=self._filtered[source],
                lobes=self._lobes,
                filtered=self._filtered[target],
                step=step,
            )

"""What surfaces mirror: a quarter of a ray a pixel, rebuilt from neighbours and earlier frames (RTG 25, 25.2.2)."""

import numpy as np
import slangpy as spy

from pica.effects.reflections.views import color, reflection_views
from pica.frame.context import FrameContext, Size, half_size
from pica.frame.effect import Aov, Effect, Reference, ReferenceLayer
from pica.frame.gbuffer import GBuffer
from pica.frame.history import History
from pica.frame.reprojection import Reprojection
from pica.gpu_scene.view import SceneView
from pica.light_sampling.light_sampler import LightSamples
from pica.programs.library import programs
from pica.rhi.device import Device
from pica.settings import ReflectionsSettings
from pica.tracing.ray_buffers import Tracer
from pica.tracing.ray_effect import ray_effect

_FOLDER = "effects/reflections"
_LEAST_ROUGHNESS = 0.3
"""Of what is mirrored, in the light of lamps (reflection_rays.slang)."""


class Reflections(Effect):
    """Adds the light that surfaces mirror of others, of emissive triangles and of the environment."""

    name = "reflections"

    def __init__(self, device: Device, size: Size, settings: ReflectionsSettings, tracer: Tracer | None) -> None:
        self._device, self._settings = device, settings
        module = f"{_FOLDER}/reflection_rays.slang"
        self._trace = ray_effect(device, module, "ReflectionRays", "surface", tracer, simplified=True)
        self._reconstruct = programs(device).compute(f"{_FOLDER}/reconstruct.slang")
        self._accumulate = device.compute(f"{_FOLDER}/reflection_history.slang")
        self._filter = programs(device).compute(f"{_FOLDER}/reflection_filter.slang")
        self._allocate(size)

    def _allocate(self, size: Size) -> None:
        light, half = spy.Format.rgba32_float, half_size(size)
        make = self._device.texture
        self._textures = {
            "ends": make("reflection ray ends", light, half),
            "light": make("reflected light", spy.Format.rgba32_uint, half),
            "reconstructed": make("reconstructed reflections", light, size),
            "distances": make("reflection distances", spy.Format.rg32_float, size),
            "signal": make("reflection signal", light, size),
            "reflected": make("reflections", light, size),
        }
        self._history = History(self._device, "reflections", {"history": light}, size, 1)

    def resize(self, size: Size) -> None:
        """As Effect."""
        self._device.give_back(*self._textures.values())
        self._history.give_back()
        self._allocate(size)

    def reset(self) -> None:
        """Drop the history."""
        self._history.reset()

    def aovs(self) -> dict[str, Aov]:
        """reflections: (height, width, 3) the light that surfaces mirror, in nits."""
        return {"reflections": Aov((self._textures["reflected"],), color)}

    def reference(self) -> Reference:
        """The same by many rays."""
        inputs = "frame", "gbuffer", "scene", "lightSlots"
        layers = {"reflections": ReferenceLayer(self.aovs()["reflections"], {"bounces": self._settings.bounces})}
        return Reference("path_tracer/mirrored_light.slang", "MirroredLight", "surface", inputs, layers, is_light=True)

    def debug_aovs(self) -> dict[str, Aov]:
        """See views.py."""
        return reflection_views({**self._textures, **self._history.current})

    def ray_counts(self) -> dict[str, int]:
        """Rays that followed a surface's lobe; those from what they met to a light are as many at most."""
        return {"reflection_rays": int(np.count_nonzero(self._textures["ends"].to_numpy()[..., 3]))}

    def __call__(
        self,
        frame: FrameContext,
        gbuffer: GBuffer,
        scene: SceneView,
        light: LightSamples,
        reprojection: Reprojection,
        radiance: spy.Texture,
    ) -> None:
        """Add what this frame's surfaces mirror to `radiance`."""
        assert light.pool is not None, "LightSampler.expect_hits comes first"
        textures, half = self._textures, frame.at_half()
        self._trace(
            half,
            half.size,
            frame=half,
            gbuffer=gbuffer.at_half(frame),
            scene=scene,
            lightSlots=light.slots,
            pool=light.pool.buffer,
            entries=light.pool.entries if light.slots.every else 0,
            bounces=self._settings.bounces,
            leastRoughness=_LEAST_ROUGHNESS if self._settings.filter else 0.0,
            ends=textures["ends"],
            light=textures["light"],
        )
        self._reconstruct(scene.material_types)(
            frame,
            frame.grid,
            frame=frame,
            gbuffer=gbuffer,
            scene=scene,
            ends=textures["ends"],
            light=textures["light"],
            reconstructed=textures["reconstructed"],
            distances=textures["distances"],
            filtered=int(self._settings.filter),
        )
        if self._settings.filter:
            self._accumulate(
                frame,
                frame.grid,
                frame=frame,
                gbuffer=gbuffer,
                reprojection=reprojection,
                reconstructed=textures["reconstructed"],
                distances=textures["distances"],
                signal=textures["signal"],
                **self._history.turn(frame),
                known=int(not self._history.empty),
            )
        self._filter(scene.material_types)(
            frame,
            frame.grid,
            frame=frame,
            gbuffer=gbuffer,
            scene=scene,
            signal=textures["signal" if self._settings.filter else "reconstructed"],
            reflected=textures["reflected"],
            radiance=radiance,
        )

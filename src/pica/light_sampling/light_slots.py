"""Which lights get a ray of their own: the slots of shaders light_slots.slang."""

import operator
from typing import Any

import numpy as np
import slangpy as spy

from pica.frame.context import FrameContext, Size
from pica.frame.gbuffer import GBuffer
from pica.gpu_scene.lights.light_table import LightTable
from pica.gpu_scene.view import SceneView
from pica.programs.library import programs
from pica.programs.recipes import ForTypes
from pica.rhi.device import Device
from pica.rhi.passes import ComputePass
from pica.scene.light import DirectionalLight, DiskLight, Light, RectangleLight
from pica.scene.model import Node
from pica.settings import Settings

_NO_SLOT = 0xFFFFFFFF


class LightSlots:
    """A slot for each of the strongest lights, one for all others and the emissive triangles, one for the environment.

    Of the single lights those with filtered shadows come first, first those with the filter "svgf"; last those that
    would be filtered too if they were not too many.
    """

    def __init__(self, device: Device, size: Size, settings: Settings) -> None:
        self._device, self._size, self._settings = device, size, settings
        self._lights: LightTable | None = None
        self._shown: list[Light | None] = []
        self.count = 0
        self.single_lights: list[str] = []
        """Names of the lights that have a slot of their own, in the order of their slots."""
        self.denoised: list[Node] = []
        """The lights of the first slots, whose shadows are filtered."""
        self.svgf = 0
        """How many of them by SVGF; the others by the anisotropic filter."""
        self.noisy = 0
        """How many slots, the last, bring noisy light that is filtered together."""
        self.reservoirs = device.texture("light reservoirs", spy.Format.rg32_uint, (1, 1))
        """Which candidate the shared slot follows; full size where there is such a slot."""
        self._has_shared = False
        self._choose: ForTypes[Any, ComputePass] | None = None
        self.block = device.parameter_block("light_sampling/light_slots.slang", "lightSlots")

    def resize(self, size: Size) -> None:
        """Work at another size, (width, height) pixels, from the next frame on."""
        self._size, self._lights = size, None

    def update(self, lights: LightTable) -> None:
        """Follow the scene's lights; does nothing while they are the same."""
        single = min(lights.light_count, self._settings.shadows.max_lights)
        shown = [node.light for node in lights.nodes[:single]]
        if lights is self._lights and all(map(operator.is_, shown, self._shown)):
            return
        self._lights, self._shown = lights, shown
        chosen = {number: self._denoiser(light) for number, light in enumerate(shown)}
        denoised = [light for light in chosen if chosen[light] != "off"][: self._settings.shadows.denoised_lights]
        if self._settings.shadows.method == "maps":
            mapped = self._settings.shadows.mode != "off"
            denoised = list(chosen)[: self._settings.shadow_maps.max_lights if mapped else 0]
        denoised.sort(key=lambda light: chosen[light] != "svgf")
        self.denoised = [lights.nodes[light] for light in denoised]
        self.svgf = sum(chosen[light] == "svgf" for light in denoised)
        rest = sorted((light for light in chosen if light not in denoised), key=lambda light: chosen[light] != "off")
        order = denoised + rest
        self.single_lights = [lights.names[light] for light in order]
        ranges = [(light, 1) for light in order]
        triangles = lights.parameters["emissiveCount"]
        sources = lights.light_count - single + triangles
        self._has_shared = sources > 0
        if self._has_shared:
            self._choose = self._choose or programs(self._device).compute("light_sampling/reservoir.slang")
            # The triangles' one entry follows the lights.
            ranges.append((single, lights.light_count - single + (triangles > 0)))
            if (self.reservoirs.width, self.reservoirs.height) != self._size:
                self._device.give_back(self.reservoirs)
                self.reservoirs = self._device.texture("light reservoirs", spy.Format.rg32_uint, self._size)
        shared = len(ranges) - 1 if self._has_shared else _NO_SLOT
        environment = lights.environment_light if self._settings.lighting.environment == "sampled" else None
        if environment is not None:
            ranges.append((environment, 1))
        self.count = len(ranges)
        steady = len(denoised) + sum(chosen[light] == "off" for light in rest)
        self.noisy = self.count - steady if self._settings.lighting.filter else 0
        ratio = bool(denoised) and self._settings.lighting.area_shadows == "ratio"
        self.block.bind(
            ranges=self._device.structured("light slots", np.array(ranges, np.uint32).reshape(-1, 2)),
            count=self.count,
            denoised=len(denoised),
            firstDistance=self.svgf,
            firstNoisy=self.count - self.noisy,
            hard=int(self._settings.shadows.mode == "hard"),
            needMaterial=int(environment is not None or ratio),
            ratio=int(ratio),
            shared=shared,
            candidates=min(self._settings.lighting.candidates, sources),
        )

    def choose(self, frame: FrameContext, gbuffer: GBuffer, scene: SceneView) -> None:
        """Choose what each pixel's shared slot looks at in this frame."""
        if self._has_shared and self._choose:
            self._choose(scene.material_types)(
                frame,
                frame.grid,
                frame=frame,
                gbuffer=gbuffer,
                scene=scene,
                lightSlots=self,
                reservoirs=self.reservoirs,
            )

    def _denoiser(self, light: Light | None) -> str:
        """The filter of a light's shadow; none where shadows have no penumbra."""
        if light is None or self._settings.shadows.mode != "soft" or not _has_penumbra(light):
            return "off"
        return light.shadow_denoiser or self._settings.shadows.denoiser


def _has_penumbra(light: Light) -> bool:
    match light:
        case DirectionalLight():
            return light.angular_diameter > 0
        case RectangleLight() | DiskLight():
            return True
        case _:
            return light.radius > 0

"""Which lights get a ray of their own: the slots of shaders light_slots.slang."""

import operator

import numpy as np
import slangpy as spy

from pica.gpu_scene.lights.light_table import LightTable
from pica.rhi.device import Device
from pica.scene.light import DirectionalLight, DiskLight, Light, RectangleLight
from pica.scene.model import Node
from pica.settings import Settings

_NO_SLOT = 0xFFFFFFFF
MOST_SHAPES = 32
"""Lights up to which reflections meet their shapes, since each of their rays tests all lights."""
_OF_SHAPE = 4
"""Candidates for a light with an extent: narrow lobes show a part of it."""
_UNTRACED = 8
"""Lights with a slot of their own, where that costs no ray."""


class LightSlots:
    """A slot for each of a few lights, and one for all others, the emissive triangles and the environment.

    Single lights with filtered shadows come first, of these those with the filter "svgf"; last the lights without a
    filtered slot because there are too many.
    """

    def __init__(self, device: Device, settings: Settings) -> None:
        self._device, self._settings = device, settings
        self._lights: LightTable | None = None
        self._shown: list[Light | None] = []
        self._ranges: list[spy.Buffer] = []
        self.count = 0
        self.single_lights: list[str] = []
        """Names of the lights that have a slot of their own, in the order of their slots."""
        self.denoised: list[Node] = []
        """The lights of the first slots, whose shadows are filtered."""
        self.svgf = 0
        """Number of them with SVGF; the others have the anisotropic filter."""
        self.noisy = 0
        """Number of slots, at the end, with noisy light that is filtered together."""
        self.shared_lights = range(0)
        """Entries of the light table in the last slot."""
        self.every = 0
        """Entries of the light table that light the hits of rays: the first ones."""
        self.first_sampled = 0
        """Slots before this one need no samples."""
        self.block = device.parameter_block("light_sampling/light_slots.slang", "lightSlots")

    @property
    def by_ratio(self) -> bool:
        """Whether filtered shadows multiply analytic direct light (ratio estimator)."""
        return self._settings.lighting.area_shadows == "ratio_estimator"

    @property
    def has_shared(self) -> bool:
        """Whether several lights share the last slot."""
        return len(self.shared_lights) > 0

    @property
    def lights(self) -> list[Node]:
        """The lights of the table, in its order."""
        return [] if self._lights is None else self._lights.nodes

    @property
    def layout(self) -> tuple[int, ...]:
        """The properties that determine the passes and the number of layers."""
        return self.count, len(self.denoised), self.svgf, self.noisy, self.first_sampled, self.has_shared

    def update(self, lights: LightTable) -> None:
        """Follow the scene's lights; does nothing while they are the same."""
        mapped = self._settings.shadows.method == "maps"
        maps = self._settings.shadow_maps.max_lights
        own = max(maps, _UNTRACED) if mapped else self._settings.shadows.max_lights
        single = min(lights.light_count, own)
        single_lights = [node.light for node in lights.nodes[:single]]
        if lights is self._lights and all(map(operator.is_, single_lights, self._shown)):
            return
        self._lights, self._shown = lights, single_lights
        chosen = {number: self._denoiser(light) for number, light in enumerate(single_lights)}
        denoised = [light for light in chosen if chosen[light] != "off"][: self._settings.shadows.denoised_lights]
        if mapped:
            denoised = list(chosen)[: maps if self._settings.shadows.mode != "off" else 0]
        denoised.sort(key=lambda light: chosen[light] != "svgf")
        self.denoised = [lights.nodes[light] for light in denoised]
        self.svgf = sum(chosen[light] == "svgf" for light in denoised)
        rest = sorted((light for light in chosen if light not in denoised), key=lambda light: chosen[light] != "off")
        order = denoised + rest
        self.single_lights = [lights.names[light] for light in order]
        ranges = [(light, 1) for light in order]
        triangles = lights.parameters["emissiveCount"]
        has_environment = lights.environment_light is not None
        environment = has_environment and self._settings.lighting.environment == "sampled"
        # The triangles' one entry and that of the environment follow the lights.
        others = lights.light_count + (triangles > 0)
        self.shared_lights = range(single, others + environment)
        # Prefiltered light is unshadowed: hits of rays are always lit by samples.
        self.every = others + (has_environment and self._settings.lighting.environment != "off")
        if self.has_shared:
            ranges.append((single, len(self.shared_lights)))
        shared = len(ranges) - 1 if self.has_shared else _NO_SLOT
        self.count = len(ranges)
        steady = len(denoised) + sum(chosen[light] == "off" for light in rest)
        self.noisy = self.count - steady if self._settings.debug.filters else 0
        by_rays = self._settings.shadows.mode != "off" and self._settings.shadows.method == "rays"
        self.first_sampled = 0 if by_rays else len(denoised)
        by_reflection_rays = self._settings.reflections.mode == "ray_traced"
        ratio = bool(denoised) and self.by_ratio
        shapes = self._met_shapes(lights)
        self._device.give_back(*self._ranges)
        self._ranges = [self._device.structured("light slots", np.array(ranges, np.uint32).reshape(-1, 2))]
        self.block.bind(
            ranges=self._ranges[0],
            count=self.count,
            firstSampled=self.first_sampled,
            denoised=len(denoised),
            firstDistance=self.svgf,
            firstNoisy=self.count - self.noisy,
            hard=int(self._settings.shadows.mode == "hard"),
            needMaterial=int(self.has_shared or ratio or (shapes > 0 and self.count > len(denoised))),
            ratio=int(ratio),
            shared=shared,
            candidates=self._candidates(lights.nodes[single:], triangles, environment),
            byBrdf=int(environment),
            reflections=int(self._settings.reflections.mode != "off"),
            shapes=shapes,
            sharesEmitters=int(by_reflection_rays and self._settings.reflections.reconstruction != "mirror_rays"),
            single=single,
            surroundings=int(by_reflection_rays and self._settings.lighting.environment != "off"),
        )

    def _candidates(self, nodes: list[Node], triangles: int, environment: bool) -> int:
        """Of the shared slot: no more than tell its emitters, or points on them, apart."""
        most = self._settings.lighting.candidates
        if environment:
            return most
        count = _OF_SHAPE * triangles
        for node in nodes[:most]:
            count += _OF_SHAPE if node.light and _has_penumbra(node.light) else 1
        return min(count, most)

    def _met_shapes(self, lights: LightTable) -> int:
        """light_slots.slang: `shapes`."""
        reflections = self._settings.reflections
        if reflections.mode != "ray_traced":
            return 0
        if reflections.area_lights:
            return 2
        return int(reflections.rays == "adaptive" and lights.light_count <= MOST_SHAPES)

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

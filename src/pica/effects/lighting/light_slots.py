"""Which lights get a ray of their own: the slots of shaders light_slots.slang."""

import numpy as np

from pica.gpu_scene.lights import LightTable
from pica.rhi.device import Device
from pica.settings import Settings


class LightSlots:
    """A slot for each of the strongest lights, one for all others, the emissive triangles, the environment."""

    def __init__(self, device: Device, settings: Settings) -> None:
        self._device, self._settings = device, settings
        self._lights: LightTable | None = None
        self.count = 0
        self.single_lights: list[str] = []
        """Names of the lights that have a slot of their own, in the order of their slots."""
        self.block = device.parameter_block("effects/lighting/light_slots.slang", "lightSlots")

    def update(self, lights: LightTable) -> None:
        """Follow the scene's lights; does nothing while they are the same."""
        if lights is self._lights:
            return
        self._lights = lights
        single = min(lights.light_count, self._settings.shadows.max_lights)
        self.single_lights = lights.names[:single]
        ranges = [(light, 1) for light in range(single)]
        if lights.light_count > single:
            ranges.append((single, lights.light_count - single))
        if lights.emissive_light is not None:
            ranges.append((lights.emissive_light, 1))
        environment = lights.environment_light if self._settings.lighting.environment == "sampled" else None
        if environment is not None:
            ranges.append((environment, 1))
        self.count = len(ranges)
        self.block.bind(
            ranges=self._device.structured("light slots", np.array(ranges, np.uint32).reshape(-1, 2)),
            count=self.count,
            hard=int(self._settings.shadows.mode == "hard"),
            needMaterial=int(environment is not None),
        )

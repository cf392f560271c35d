"""The environment's light filtered ahead for the raster preset; made once per scene."""

import slangpy as spy

from pica.gpu_scene.view import SceneView
from pica.rhi.device import Device

LEVELS = 8  # prefiltered.slang: levelCount
_SIZE = (128, 64)
_SAMPLES = 128
_SMALLEST_ALPHA = 0.01


class PrefilteredEnvironment:
    """Radiance by direction and roughness, and irradiance. Where it is not wanted, one black texel stands in."""

    def __init__(self, device: Device, scene: SceneView, wanted: bool) -> None:
        size = _SIZE if wanted else (1, 1)
        usage = spy.TextureUsage.shader_resource | spy.TextureUsage.unordered_access
        self._levels = device.handle.create_texture(
            type=spy.TextureType.texture_2d_array,
            format=spy.Format.rgba32_float,
            width=size[0],
            height=size[1],
            array_length=LEVELS,
            usage=usage | spy.TextureUsage.copy_destination,
            label="prefiltered environment",
        )
        irradiance = device.texture("irradiance", spy.Format.rgba32_float, size)
        self.block = device.parameter_block("effects/lighting/prefiltered.slang", "prefiltered")
        self.block.bind(
            levels=self._levels,
            irradiance=irradiance,
            sampler=device.sampler(
                address_u=spy.TextureAddressingMode.wrap, address_v=spy.TextureAddressingMode.clamp_to_edge
            ),
            enabled=int(wanted),
        )
        if not wanted:
            return
        prefilter = device.compute("effects/lighting/prefilter.slang")
        with device.record() as recording:
            for level in range(LEVELS):
                layer = spy.SubresourceRange({"layer": level, "layer_count": 1, "mip": 0, "mip_count": 1})
                target = self._levels.create_view(spy.TextureViewDesc({"subresource_range": layer}))
                alpha = max((level / (LEVELS - 1)) ** 2, _SMALLEST_ALPHA)
                values = {"target": target, "size": spy.uint2(*size), "alpha": alpha, "samples": _SAMPLES}
                prefilter(recording, (*size, 1), scene=scene, **values)
            prefilter(
                recording,
                (*size, 1),
                scene=scene,
                target=irradiance,
                size=spy.uint2(*size),
                alpha=-1.0,
                samples=_SAMPLES,
            )

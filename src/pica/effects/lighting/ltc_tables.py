"""The linearly transformed cosines of tools/fit_ltc.py on the GPU."""

import numpy as np
import slangpy as spy

from pica.rhi.device import Device
from pica.rhi.slang_sessions import PACKAGE

TABLE = PACKAGE / "effects" / "lighting" / "ltc_ggx.npy"
"""(roughness, view, 6) float16: four entries of the inverse matrix, two albedos."""


class LtcTables:
    """The block of ltc_tables.slang."""

    def __init__(self, device: Device) -> None:
        table = np.load(TABLE)
        size = (table.shape[1], table.shape[0])
        inverse = device.texture("LTC matrices", spy.Format.rgba16_float, size)
        albedo = device.texture("LTC albedos", spy.Format.rg16_float, size)
        inverse.copy_from_numpy(np.ascontiguousarray(table[..., :4]))
        albedo.copy_from_numpy(np.ascontiguousarray(table[..., 4:]))
        edge = spy.TextureAddressingMode.clamp_to_edge
        self.block = device.parameter_block("effects/lighting/ltc_tables.slang", "ltcTables")
        self.block.bind(inverse=inverse, albedo=albedo, sampler=device.sampler(address_u=edge, address_v=edge))

"""How many textures shaders can reach by bindless handles, as those of many views are (many_views/)."""

import slangpy as spy

from pica.rhi.adapters import is_software

_FEW, _MANY = 1 << 10, 1 << 16
"""SlangPy's default, and that of graphics cards here; memory for all of them is reserved, 31 MB on a processor."""


def most_handles(adapter: spy.AdapterInfo, is_existing: bool) -> int:
    """Handles of textures on a device, one to read a texture and one to write it. `is_existing`: others opened it."""
    return _FEW if is_existing or is_software(adapter) else _MANY

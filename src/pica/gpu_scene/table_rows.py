"""Rows of the scene's tables, as gpu_scene/table_rows.slang has them: SectionRecord and Instance."""

import numpy as np

RECORD = np.dtype(
    [
        (name, "u4")
        for name in ("first_index", "first_vertex", "material", "instance", "first_emissive", "first_previous", "shape")
    ]
    + [("center", "f4", 3), ("extent", "f4", 3), ("unused", "u4", 3)]
)
INSTANCE = np.dtype([("to_world", "f4", (3, 4)), ("node", "u4"), ("mask_and_channels", "u4"), ("unused", "u4", 2)])
NOT_EMISSIVE = 0xFFFFFFFF

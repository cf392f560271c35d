"""UDIM: pictures that cover one unit square of texture coordinates each, put together as one.

The tile 1001 + column + 10 row covers u from `column` and v, which points up, from `row` (OpenUSD, UsdPreviewSurface
specification, "Texture Reader").
"""

from typing import NamedTuple

import numpy as np
import PIL.Image

from pica.scene.conversion.conversion import Conversion
from pica.scene.conversion.pictures import FAULTS, Pictures, png

FIRST = 1001
PATTERN = "<UDIM>"
_COLUMNS = 10
_LONGEST_SIDE, _MOST_PIXELS = 16384, 16384 * 8192
"""Of all tiles together, which are halved until they fit."""


class Joined(NamedTuple):
    """One picture of all tiles."""

    content: bytes
    """Of a picture's file."""
    transform: tuple[float, float, float, float, float, float]
    """Of texture coordinates whose v points up, to this picture's: rows of a 2x3 matrix."""


def joined(conversion: Conversion, pictures: Pictures, tiles: dict[int, bytes], name: str) -> Joined | None:
    """The contents of files by their tiles' numbers, as one picture; None, with a warning, where none can be read."""
    places = {tile: ((tile - FIRST) % _COLUMNS, (tile - FIRST) // _COLUMNS) for tile in tiles}
    across, upwards = zip(*places.values(), strict=True)
    left, bottom = min(across), min(upwards)
    columns, rows = max(across) + 1 - left, max(upwards) + 1 - bottom
    transform = (1 / columns, 0.0, -left / columns, 0.0, 1 / rows, -bottom / rows)
    if len(tiles) == 1:
        return Joined(next(iter(tiles.values())), transform)
    missing = [
        FIRST + column + _COLUMNS * row
        for row in range(bottom, bottom + rows)
        for column in range(left, left + columns)
        if FIRST + column + _COLUMNS * row not in tiles
    ]
    if missing:
        conversion.warn(f"texture {name!r}: of its tiles {', '.join(map(str, missing))} are missing; black there")
    try:
        sizes = [pictures.size(content) for content in tiles.values()]
        width, height = (max(size[axis] for size in sizes) for axis in (0, 1))
        halvings = 0
        while max(width * columns, height * rows) > _LONGEST_SIDE or width * columns * height * rows > _MOST_PIXELS:
            width, height, halvings = max(width // 2, 1), max(height // 2, 1), halvings + 1
        if halvings:
            conversion.warn(f"texture {name!r}: its tiles together are too large, so each is {width}x{height}")
        pixels = width * columns * height * rows
        conversion.budget.take_picture(pixels, 4 * pixels)
        whole = np.zeros((height * rows, width * columns, 4), np.uint8)
        for tile, (column, row) in places.items():
            picture = PIL.Image.fromarray(pictures.pixels(tiles[tile])).resize(
                (width, height), PIL.Image.Resampling.BOX
            )
            top = (rows - 1 - row + bottom) * height
            whole[top : top + height, (column - left) * width :][:, :width] = np.asarray(picture)
    except FAULTS as error:
        pictures.warn(name, error)
        return None
    return Joined(png(whole if (whole[..., 3] < 255).any() else whole[..., :3]), transform)

"""Pictures side by side with captions."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from pica.text import one_line

_GAP = 8
_BACKGROUND = (24, 24, 24)
_INK = (235, 235, 235)
# Nine even steps of the magma colour map by N. Smith and S. van der Walt (public domain), which FLIP's maps use.
_MAGMA = np.array(
    [
        *((0, 0, 4), (29, 17, 71), (81, 18, 124), (130, 38, 129), (182, 54, 121)),
        *((229, 81, 100), (251, 136, 97), (254, 194, 135), (252, 253, 191)),
    ],
    np.float64,
)


def sheet(pictures: Mapping[str, NDArray[np.floating[Any]]]) -> NDArray[np.uint8]:
    """One (height, width, 3) uint8 picture of several, left to right, each below its caption.

    A value is an (h, w, 3) sRGB picture from 0 to 1, or an (h, w) map from 0 to 1 such as FLIP's, which is coloured
    from black over red to pale yellow (magma). A caption wider than its picture is set smaller.
    """
    # Captions contain names of lights, which are arbitrary text in files.
    named = {one_line(title): picture for title, picture in pictures.items()}
    panels = {title: magma(p) if p.ndim == 2 else (p * 255 + 0.5).astype(np.uint8) for title, p in named.items()}
    caption = max(16, max(panel.shape[0] for panel in panels.values()) // 24)
    top = caption + 2 * _GAP
    width = sum(panel.shape[1] for panel in panels.values()) + _GAP * (len(panels) + 1)
    height = max(panel.shape[0] for panel in panels.values()) + top + _GAP
    page = Image.new("RGB", (width, height), _BACKGROUND)
    draw = ImageDraw.Draw(page)
    left = _GAP
    for title, panel in panels.items():
        page.paste(Image.fromarray(panel), (left, top))
        draw.text((left, top / 2), title, _INK, _font(title, caption, panel.shape[1]), anchor="lm")
        left += panel.shape[1] + _GAP
    return np.asarray(page)


def magma(values: NDArray[np.floating[Any]]) -> NDArray[np.uint8]:
    """Colour (h, w) values from 0 to 1 with the magma map, (h, w, 3) uint8."""
    steps = np.linspace(0, 1, len(_MAGMA))
    channels = [np.interp(values, steps, _MAGMA[:, channel]) for channel in range(3)]
    return (np.stack(channels, -1) + 0.5).astype(np.uint8)


def _font(title: str, size: int, room: int) -> Any:
    font = ImageFont.load_default(size)
    if font.getlength(title) > room:
        font = ImageFont.load_default(max(8, int(size * room / font.getlength(title))))
    return font

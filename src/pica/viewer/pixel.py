"""All that is known of one pixel, as texts."""

from typing import Any

import numpy as np

from pica.images.aov_table import aov_info
from pica.images.output import Frame

_UNITS = {"metres": "m", "pixels": "px"}


def pixel_rows(frame: Frame, x: int, y: int) -> list[tuple[str, str]]:
    """What pixel (x, y), right and down from the upper left one, has in the picture and in each AOV: names and
    values."""
    shown = [("display", _text(frame.display[y, x]), "sRGB"), ("radiance", _text(frame.color[y, x]), "nits")]
    aovs = [(name, _text(frame.aov(name)[y, x]), aov_info(name).unit) for name in frame.aov_names]
    return [
        (name.replace("_", " "), f"{value} {_UNITS.get(unit, unit)}".rstrip()) for name, value, unit in [*shown, *aovs]
    ]


def _text(value: Any) -> str:
    return ", ".join(f"{number:.4g}" for number in np.atleast_1d(value).tolist())

"""A frame in a notebook: the picture, and its AOVs under a line to click."""

import base64
import io
from collections.abc import Iterable
from html import escape

import numpy as np
import PIL.Image
from numpy.typing import NDArray

from pica.images.pictures import encoded_png

THUMBNAIL = 240
"""Pixels of an AOV's picture, along its longer side."""
_QUALITY = 85
"""Of JPEG, for AOVs: a notebook stores all that it shows."""


def frame_html(display: NDArray[np.uint8] | None, thumbnails: Iterable[tuple[str, NDArray[np.uint8]]]) -> str:
    """HTML without a script: `display`, (height, width, 3) uint8 sRGB, if there is one, and below it (name, picture)
    of each AOV; without a display these are open."""
    figures = [
        f'<figure style="margin:0"><img alt="" src="{_jpeg(picture)}"><figcaption>{escape(name)}</figcaption></figure>'
        for name, picture in thumbnails
    ]
    picture = "" if display is None else f'<img alt="" src="{_url("png", encoded_png(display))}">'
    if not figures:
        return picture
    grid = f'<div style="display:flex;flex-wrap:wrap;gap:8px">{"".join(figures)}</div>'
    is_open = " open" if display is None else ""
    return f"{picture}<details{is_open}><summary>{len(figures)} AOVs</summary>{grid}</details>"


def _jpeg(pixels: NDArray[np.uint8]) -> str:
    stream = io.BytesIO()
    PIL.Image.fromarray(pixels).save(stream, "JPEG", quality=_QUALITY)
    return _url("jpeg", stream.getvalue())


def _url(kind: str, data: bytes) -> str:
    return f"data:image/{kind};base64,{base64.b64encode(data).decode()}"

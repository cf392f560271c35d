"""Indirect light and the work of its filters as arrays for people."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.frame.effect import Aov

Array = NDArray[Any]


def color(values: Array) -> Array:
    """(height, width, 3) of a texture with an alpha channel."""
    return values[..., :3].astype(np.float32)


def indirect_views(textures: Mapping[str, spy.Texture]) -> dict[str, Aov]:
    """Views of the textures; light is in nits over diffuse albedo, which is irradiance over pi.

    Of half size raw: what each ray brought; distance: metres to what it met, below 0 where that was nothing; gathered:
    from neighbours' rays of this frame; nearness: 1 / metres to what lights the surface. Of full size accumulated: with
    earlier frames; variance: of that; history: how many frames these are.
    """
    return {
        "raw": Aov((textures["found"],), color),
        "distance": Aov((textures["found"],), lambda values: values[..., 3]),
        "gathered": Aov((textures["gathered"],), color),
        "nearness": Aov((textures["nearness"],), lambda values: values),
        "accumulated": Aov((textures["signal"],), color),
        "variance": Aov((textures["signal"],), lambda values: values[..., 3]),
        "history": Aov((textures["moments"],), lambda layers: layers[0, ..., 1]),
    }


def arriving_views(arriving: spy.Texture) -> dict[str, Aov]:
    """What each pixel gets, (height, width[, 3]).

    arriving: the light over diffuse albedo, in nits; coverage: the sum of the weights of surfels' discs, else 1 where
    that is known.
    """
    return {"arriving": Aov((arriving,), color), "coverage": Aov((arriving,), lambda values: values[..., 3])}


def surfel_views(textures: Mapping[str, spy.Texture]) -> dict[str, Aov]:
    """Views of surfels, (height, width[, 3]); 0 where there is none.

    discs: number of the surfel whose disc is nearest, from 1; age: its frames, with this one; samples: its rays so far;
    rays: those of this frame. cells: a colour for each cell of the grid, in the hue of the grid's level.
    """
    nearest, cells = textures["nearest"], textures["cells"]
    return {
        "discs": Aov((nearest,), lambda values: values[..., 0]),
        "age": Aov((nearest,), lambda values: values[..., 1].astype(np.float32)),
        "samples": Aov((nearest,), lambda values: values[..., 2].astype(np.float32)),
        "rays": Aov((nearest,), lambda values: values[..., 3].astype(np.float32)),
        "cells": Aov((cells,), _cell_colors),
    }


_HUES = np.array([(1, 0.2, 0.2), (1, 1, 0.2), (0.2, 1, 0.2), (0.2, 1, 1), (0.2, 0.2, 1), (1, 0.2, 1)], np.float32)
"""Of six levels in turn."""


def _cell_colors(cells: Array) -> Array:
    """The lightness is of the cell's own number, by multiplicative hashing (Knuth)."""
    number, level = cells[..., :1], cells[..., 1].view(np.int32)
    hashed = (number * np.uint32(2654435761)) >> np.uint32(24)
    lightness = np.where(number > 0, 0.15 + 0.85 * hashed / 255, 0)
    return (_HUES[level % 6] * lightness).astype(np.float32)

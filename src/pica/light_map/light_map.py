"""A baked light map, and its file."""

import math
import re
import warnings
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pica.errors import PicaError, SceneError
from pica.light_map.arrays_file import Lengths, Wanted, read_arrays, write_arrays
from pica.light_map.bricks import CELLS, CORNERS, LEVELS, MOST_PLACES, Bricks
from pica.light_map.fingerprint import content_of, layout_of
from pica.scene.model import Scene
from pica.scene.values import BRIGHTEST, LARGEST

HARMONICS = 9
"""shaders/spherical_harmonics.slang."""
PARTS = 4
"""light_map.slang: PARTS, along a cell's side."""
SEEN_PER_BRICK = (CELLS * PARTS) ** 3
MOST_BRICKS = 1 << 17
"""A brick needs 5 to 12 kB on a device."""
HIDDEN, INSIDE = 1e-12, 1e-24
"""light_map.slang: HIDDEN, INSIDE."""
_BRIGHTEST = BRIGHTEST / 16
"""Of one coefficient: their sum in any direction is less than 16 times the largest."""
_FARTHEST = LARGEST / 2**40
"""Metres: places that are found from spacing and size are finite too."""
_NEAREST = 1 / _FARTHEST
_DIGEST = re.compile("[0-9a-f]{32}")
_FORMAT = 2
_FILE = {
    "format": Wanted((), "<i4"),
    "origin": Wanted((3,), "<f8"),
    "spacing": Wanted((), "<f8"),
    "size": Wanted((3,), "<i4"),
    "places": Wanted((-1, 4), "<i4"),
    "scale": Wanted((), "<f4"),
    "harmonics": Wanted((-1, HARMONICS, 3), "<f2", stored=True),  # 16-bit noise hardly gets smaller
    "in_the_open": Wanted((-1,), "|b1"),
    "seen": Wanted((-1, SEEN_PER_BRICK), "|u1"),
    "content": Wanted((), "<U32"),
    "layout": Wanted((), "<U32"),
}


@dataclass(frozen=True, eq=False)
class LightMap:
    """Indirect irradiance about the places of a scene; `pica.bake` makes it."""

    bricks: Bricks
    scale: float
    """Nits of a coefficient of 1."""
    harmonics: NDArray[np.float16]
    """(probes, 9, 3) irradiance over pi as spherical harmonics, red, green and blue."""
    in_the_open: NDArray[np.bool_]
    """(probes,) False inside objects; such probes have the light of their neighbours."""
    seen: NDArray[np.uint8]
    """(bricks, 4096) of each part of each cell, x fastest: visibility of the cell's 8 corners, a bit each."""
    content: str
    """Digest of the scene's content (fingerprint.py)."""
    layout: str
    """And of where that stood."""

    def save(self, path: str | PathLike[str]) -> None:
        """Write a file, whole or not at all. Raises PicaError."""
        bricks = self.bricks
        arrays = {
            "format": np.int32(_FORMAT),
            "origin": bricks.origin,
            "spacing": np.float64(bricks.spacing),
            "size": bricks.size,
            "places": bricks.places,
            "scale": np.float32(self.scale),
            "harmonics": self.harmonics,
            "in_the_open": self.in_the_open,
            "seen": self.seen,
            "content": np.array(self.content, "<U32"),
            "layout": np.array(self.layout, "<U32"),
        }
        write_arrays(Path(path), {name: np.asarray(array) for name, array in arrays.items()}, _FILE)

    @staticmethod
    def load(path: str | PathLike[str]) -> "LightMap":
        """Read a file, which need not be trusted. Raises PicaError if it is damaged or no light map.

        It needs a few times the memory of the arrays that the file declares, which is checked first.
        """
        arrays = read_arrays(Path(path), _FILE, _check_lengths)
        if arrays["format"] != _FORMAT:
            raise PicaError(
                f"{path}: is a light map of format {arrays['format']}; this is for {_FORMAT}: bake it again"
            )
        bricks = Bricks(arrays["origin"], float(arrays["spacing"]), arrays["size"], arrays["places"])
        try:
            _check_bricks(bricks)
            _check_light(bricks, float(arrays["scale"]), arrays["harmonics"], arrays["in_the_open"])
            content, layout = _digest(arrays["content"]), _digest(arrays["layout"])
        except ValueError as error:
            raise PicaError(f"{path}: is damaged: {error}") from None
        light = float(arrays["scale"]), arrays["harmonics"], arrays["in_the_open"], arrays["seen"]
        return LightMap(bricks, *light, content, layout)

    def check_scene(self, scene: Scene) -> None:
        """Raises SceneError for another scene than it was baked for; warns where things have moved since."""
        if content_of(scene) != self.content:
            what = f"another scene than {scene.name!r}, or for other meshes, materials or lights"
            raise SceneError(f"light map: it was baked for {what}")
        if layout_of(scene) != self.layout:
            warnings.warn(
                f"light map: things in scene {scene.name!r} stand elsewhere than when it was baked", stacklevel=4
            )


def _check_lengths(lengths: Lengths) -> None:
    """Raises ValueError for impossible lengths, before anything is read."""
    bricks, probes = lengths["places"], lengths["harmonics"]
    if not 0 < bricks <= MOST_BRICKS:
        raise ValueError(f"it has {bricks} bricks")
    # Bricks of a level share no probes but those of their faces.
    if not CELLS**3 * bricks <= LEVELS * probes <= LEVELS * CORNERS**3 * bricks:
        raise ValueError(f"it has light of {probes} probes for {bricks} bricks")
    if lengths["in_the_open"] != probes or lengths["seen"] != bricks:
        raise ValueError("its arrays are not of the same bricks and probes")


def _check_bricks(bricks: Bricks) -> None:
    """Raises ValueError for inconsistent arrays, before anything is made from them."""
    size, places = bricks.size.tolist(), bricks.places.astype(np.int64)
    if not (
        np.abs(bricks.origin).max() <= _FARTHEST and _NEAREST <= bricks.spacing <= _FARTHEST
    ):  # nor if not a number
        raise ValueError("its box is nowhere")
    room = math.prod(size)  # in Python's integers, which have no end
    if not (min(size) > 0 and room <= MOST_PLACES):
        raise ValueError(f"its box is {tuple(size)} bricks large")
    levels = places[:, 3]
    if not ((levels >= 0) & (levels < LEVELS)).all():
        raise ValueError("a brick has an unknown level")
    if not ((places[:, :3] >= 0) & (places[:, :3] < size) & (places[:, :3] % CELLS ** levels[:, None] == 0)).all():
        raise ValueError("a brick is not in its place")
    if len(np.unique(places, axis=0)) != len(places):
        raise ValueError("a brick is there twice")
    if (CELLS ** (3 * levels)).sum() < room:
        raise ValueError("its bricks leave room in its box")


def _check_light(bricks: Bricks, scale: float, harmonics: NDArray[np.float16], in_the_open: NDArray[np.bool_]) -> None:
    count = len(bricks.probes)
    if len(harmonics) != count:
        raise ValueError(f"it has light of {len(harmonics)} probes, but its bricks have {count}")
    if not (np.isfinite(harmonics).all() and 0 < scale < np.inf):
        raise ValueError("its light is not finite")
    if scale * float(np.abs(harmonics).max()) > _BRIGHTEST:
        raise ValueError(f"its light is brighter than {BRIGHTEST:g} nits")
    if in_the_open.view(np.uint8).max() > 1:
        raise ValueError("what is in the open is neither true nor false")


def _digest(text: NDArray[np.str_]) -> str:
    """Raises ValueError if it is no digest."""
    digest = str(text)  # NumPy raises one too, for invalid characters
    if not _DIGEST.fullmatch(digest):
        raise ValueError("it does not say what it was baked for")
    return digest

"""What a render gives: the picture, what lies under it, and what it cost."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica import pictures
from pica.color import srgb_encode
from pica.errors import PicaError

Lazy = Callable[[], NDArray[Any]]

_VECTORS = ("normal", "geometric_normal", "tangent", "position", "motion")


class Frame:
    """A rendered picture with its arbitrary output variables (AOVs): the G-buffer and the buffers of the effects.

    Arrays are fetched from the device when first asked for, once; do not write into them.
    """

    def __init__(self, color: Lazy, display: Lazy, aovs: Mapping[str, Lazy], timings: Mapping[str, float]) -> None:
        """Take functions that give (height, width, 3) float32 radiance, (height, width, 3) uint8 for the display and
        one (height, width) or (height, width, channels) array for each AOV; `timings` as below.
        """
        self._sources: dict[str, Lazy] = {"/color": color, "/display": display, **aovs}
        self._arrays: dict[str, NDArray[Any]] = {}
        self._aov_names = tuple(aovs)
        self.timings: dict[str, float] = dict(timings)
        """GPU milliseconds of every pass, by name."""

    @property
    def color(self) -> NDArray[np.float32]:
        """(height, width, 3) linear Rec. 709 radiance of the scene in nits, no exposure applied; premultiplied by the
        AOV "alpha" where the background is transparent."""
        return self._array("/color")

    @property
    def display(self) -> NDArray[np.uint8]:
        """(height, width, 3) sRGB, exposed and tone mapped; straight where the background is transparent."""
        return self._array("/display")

    @property
    def aov_names(self) -> tuple[str, ...]:
        """What `aov` can give, in the order of the frame."""
        return self._aov_names

    def aov(self, name: str) -> NDArray[Any]:
        """One buffer: (height, width) for scalars and ids, (height, width, channels) for vectors and colours.

        Raises PicaError for an unknown name, listing those there are.
        """
        if name not in self._aov_names:
            raise PicaError(f"no AOV {name!r} in this frame; there are {', '.join(self._aov_names) or 'none'}")
        return self._array(name)

    def save(self, path: str | Path, aovs: Sequence[str] | None = None) -> None:
        """Write the picture: .png the display picture, .exr the radiance as R, G, B and AOVs as named channels.

        With a transparent background (visibility.background) there is alpha: A in an .exr, where colours are
        premultiplied, and straight in a .png.

        `aovs` chooses the AOVs of an .exr, None for all. Their channels are depth.Z, X, Y, Z for directions and
        motion (normal.X), R, G, B, A for colours (albedo.R), the bare name for other scalars (instance), and numbers
        where there are more than four (shadows.0).
        Raises PicaError for another suffix, an unknown AOV or a folder that cannot be written.
        """
        suffix = Path(path).suffix.lower()
        if suffix == ".png":
            alpha = [np.round(self.aov("alpha")[..., None] * 255).astype(np.uint8)] if self._has_alpha else []
            pictures.write_png(path, np.concatenate([self.display, *alpha], axis=-1))
        elif suffix == ".exr":
            channels = _channels("", self.color, "RGB")
            if self._has_alpha:
                channels["A"] = self.aov("alpha").astype(np.float32)
            for name in [name for name in self.aov_names if name != "alpha"] if aovs is None else aovs:
                channels |= _channels(name, self.aov(name), "XYZW" if name in _VECTORS else "RGBA")
            pictures.write_exr(path, channels)
        else:
            raise PicaError(f"cannot write {path}: the name must end in .png or .exr")

    def save_aov(self, name: str, path: str | Path) -> None:
        """Write one AOV as a .png to look at: see `preview`. Raises PicaError as `save` does."""
        if Path(path).suffix.lower() != ".png":
            raise PicaError(f"cannot write {path}: the name of an AOV's picture must end in .png")
        pictures.write_png(path, preview(name, self.aov(name)))

    @property
    def _has_alpha(self) -> bool:
        return "alpha" in self._aov_names

    def _array(self, key: str) -> NDArray[Any]:
        if key not in self._arrays:
            self._arrays[key] = self._sources[key]()
        return self._arrays[key]


def _channels(name: str, array: NDArray[Any], letters: str) -> dict[str, NDArray[np.float32]]:
    values = array.astype(np.float32, copy=False)
    if values.ndim == 2:
        return {f"{name}.Z" if name == "depth" else name: values}
    count = values.shape[2]
    names = letters if count <= len(letters) else map(str, range(count))
    prefix = f"{name}." if name else ""
    return {prefix + part: values[..., channel] for channel, part in zip(range(count), names, strict=False)}


def preview(name: str, array: NDArray[Any]) -> NDArray[np.uint8]:
    """An AOV as a picture for the eye, (height, width, 3) uint8.

    Integers: a colour for each id. Directions: -1 to 1 becomes black to white. Motion: grey is none, full colour the
    largest, or a pixel where all is less. Depth: near is light. Other scalars: black to white. Colours: sRGB, divided
    by their largest value above 1.
    """
    values = array[..., None] if array.ndim == 2 else array
    if values.dtype.kind in "iu":
        # Multiplicative hashing (Knuth, The Art of Computer Programming, volume 3, section 6.4), a byte a channel.
        hashed = values[..., :1].astype(np.uint64) * np.array([2654435761, 2246822519, 3266489917], np.uint64)
        return ((hashed >> np.uint64(16)) & np.uint64(255)).astype(np.uint8)
    values = np.where(np.isfinite(values), values, 0).astype(np.float32)[..., :3]
    largest = float(np.abs(values).max(initial=0))
    if name == "motion":
        values = 0.5 + 0.5 * values / max(largest, 1.0)
    elif name in _VECTORS:
        values = 0.5 + 0.5 * values
    elif name == "depth":
        lit = values > 0
        near = float(values[lit].min()) if lit.any() else 1.0
        values = np.where(lit, near / np.maximum(values, near), 0)
    else:
        values = values / max(largest, 1.0)
        if values.shape[2] == 3:
            values = srgb_encode(values)
    picture = np.full((*values.shape[:2], 3), 0.5 if name == "motion" else 0.0, np.float32)
    picture[..., : values.shape[2]] = values
    if values.shape[2] == 1:
        picture[:] = values
    return (np.clip(picture, 0, 1) * 255 + 0.5).astype(np.uint8)

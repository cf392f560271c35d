"""How far a picture is from its golden one."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.images.pictures import write_exr, write_png
from pica.quality import Errors, compare, exposed, sheet

Picture = NDArray[np.floating[Any]]
_BLOCK = 8


@dataclass(frozen=True)
class Limits:
    """The most that a picture may be from its golden one, as `Comparison` has it."""

    flip: float
    energy: float


@dataclass(frozen=True)
class Comparison:
    """A golden picture beside a new one of the same size."""

    golden: Picture
    picture: Picture
    errors: Errors
    """At the golden picture's own exposure."""

    @classmethod
    def of(cls, golden: Picture, picture: Picture) -> "Comparison":
        return cls(golden, picture, compare(golden, picture))

    @property
    def flip(self) -> float:
        """Mean FLIP: tells of structure, and of noise, which it makes much of."""
        return self.errors.flip

    @property
    def energy(self) -> float:
        """Mean absolute difference between the means of blocks of 8 x 8 pixels, as a share of the golden mean.

        Noise nearly vanishes in it: it tells of light that is lost, won or elsewhere.
        """
        return float(np.abs(_blocks(self.golden) - _blocks(self.picture)).mean() / self.golden.mean())

    @property
    def largest(self) -> float:
        """Maximum absolute difference, nits."""
        return float(np.abs(self.golden - self.picture).max())

    @property
    def same_bits(self) -> bool:
        return np.array_equal(self.golden, self.picture)

    def within(self, limits: Limits) -> bool:
        return self.flip <= limits.flip and self.energy <= limits.energy

    def save(self, folder: Path) -> None:
        """Write golden.exr, picture.exr and sheet.png with FLIP's map."""
        for name, picture in (("golden", self.golden), ("picture", self.picture)):
            save_picture(folder / f"{name}.exr", picture)
        large = np.ones((4, 4))
        panels = {
            "golden": exposed(self.golden, self.errors.exposure),
            "now": exposed(self.picture, self.errors.exposure),
            f"FLIP {self.flip:.4f}": self.errors.flip_map,
        }
        shown = {title: np.kron(p, large if p.ndim == 2 else large[..., None]) for title, p in panels.items()}
        write_png(folder / "sheet.png", sheet(shown))


def save_picture(path: Path, picture: Picture) -> None:
    """Write (height, width, 3) radiance as .exr, to the last bit: half precision alone is FLIP 0.001 apart."""
    write_exr(path, {name: picture[..., i] for i, name in enumerate("RGB")})


def _blocks(picture: Picture) -> NDArray[np.float64]:
    height, width, channels = picture.shape
    return picture.reshape(height // _BLOCK, _BLOCK, width // _BLOCK, _BLOCK, channels).mean((1, 3), np.float64)

"""A source of particles: a fountain that is a function of time and seed alone."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.errors import SceneError
from pica.names import checked_names
from pica.scene.arrays import doubles
from pica.scene.checked_field import CheckedField
from pica.scene.deformer import Floats
from pica.scene.light import COLOR, Color
from pica.scene.particles import Particles
from pica.scene.values import checked, number, positive, vector, whole

Path = Callable[[Floats], Floats]
"""(n,) seconds to (n, 3) metres."""
_LATEST = 1e6
"""Maximum number of lives of each particle, to either side of time 0."""


def _origin(value: Any) -> Path | tuple[float, float, float]:
    return value if callable(value) else vector(3)(value)


def _two_colors(values: Any) -> tuple[Color, Color]:
    pair: NDArray[np.float64] = doubles(2, 3)(values)
    return COLOR(pair[0]), COLOR(pair[1])


@checked_names(SceneError)
@dataclass(frozen=True, eq=False)
class Emitter:
    """Emits `count` particles in every `life` seconds, evenly, without end; each moves ballistically and fades.

    The state is a function of time and seed, so any moment can be evaluated directly and repeatably.
    Raises SceneError for numbers that are not finite and for a count or life that is not above 0.
    """

    count: CheckedField[int] = CheckedField(whole(1, 1 << 31))
    life: CheckedField[float] = CheckedField(positive())
    """Seconds."""
    origin: CheckedField[Path | tuple[float, float, float]] = CheckedField(_origin, (0.0, 0.0, 0.0))
    """Metres; a function of time for an emitter that moves: particles start where it is when they are born."""
    origin_radius: CheckedField[float] = CheckedField(number(0), 0.0)
    """Metres, of the ball round the origin in which they start."""
    velocity: CheckedField[tuple[float, float, float]] = CheckedField(vector(3), (0.0, 1.0, 0.0))
    """Metres a second at birth."""
    spread: CheckedField[float] = CheckedField(number(), 0.3)
    """Metres a second that each particle's own velocity may differ by, in any direction."""
    acceleration: CheckedField[tuple[float, float, float]] = CheckedField(vector(3), (0.0, 0.0, 0.0))
    """Metres a second squared; gravity, or the rise of smoke."""
    size: CheckedField[tuple[float, float]] = CheckedField(vector(2), (0.1, 0.1))
    """Metres at birth and at the end."""
    color: CheckedField[tuple[Color, Color]] = CheckedField(_two_colors, ((1.0, 1.0, 1.0), (1.0, 1.0, 1.0)))
    """Linear, at birth and at the end."""
    alpha: CheckedField[tuple[float, float]] = CheckedField(vector(2), (1.0, 0.0))
    spin: CheckedField[float] = CheckedField(number(), 1.0)
    """Radians a second at most, either way."""
    seed: CheckedField[int] = CheckedField(whole(), 0)

    def at(self, time: float) -> Particles:
        """The particles at `time` seconds, a row each; a row is reused when its particle has died."""
        identities, ages = self._living(time)
        share = ages / self.life
        end = share[:, None]
        random = _random(self.seed, identities, 6)
        color, alpha, size = (np.asarray(pair, np.float64) for pair in (self.color, self.alpha, self.size))
        colors = np.column_stack([color[0] * (1 - end) + color[1] * end, alpha[0] * (1 - share) + alpha[1] * share])
        return Particles(
            positions=self._places(identities, time - ages, ages),
            sizes=size[0] * (1 - share) + size[1] * share,
            colors=colors,
            rotations=2 * np.pi * random[:, 4] + (2 * random[:, 5] - 1) * self.spin * ages,
            ages=share,
            identities=identities,
            axes=_directions(random[:, :2]),
        )

    def trails(self, time: float, points: int, seconds: float) -> tuple[Floats, NDArray[np.int64]]:
        """(count, points, 3) positions of each particle over the last `seconds`, newest first, and identities (count,).

        For Ribbons. Tails of younger particles begin at their birth.
        """
        identities, ages = self._living(time)
        back = np.maximum(ages[:, None] - np.linspace(0, seconds, points), 0)
        many = np.repeat(identities, points)
        places = self._places(many, np.repeat(time - ages, points), back.ravel())
        return places.reshape(self.count, points, 3), identities

    def _living(self, time: float) -> tuple[NDArray[np.int64], Floats]:
        """(count,) which particle each row shows, and its age in seconds."""
        time = checked("emitter: time", number(-_LATEST * self.life, _LATEST * self.life), time)
        rows = np.arange(self.count)
        interval = self.life / self.count
        generation = np.floor((time / interval - rows) / self.count).astype(np.int64)
        identities = rows + generation * self.count
        return identities, np.clip(time - identities * interval, 0, self.life)

    def _places(self, identities: NDArray[np.int64], births: Floats, ages: Floats) -> Floats:
        """(n, 3) free flight from where the emitter was at birth."""
        random = _random(self.seed + 1, identities, 6)
        start = self.origin(births) if callable(self.origin) else np.asarray(self.origin, np.float64)
        start = start + self.origin_radius * _directions(random[:, :2]) * np.cbrt(random[:, 4:5])
        own = self.spread * _directions(random[:, 2:4]) * np.cbrt(random[:, 5:6])
        age = ages[:, None]
        return np.asarray(start + age * (self.velocity + own) + age**2 / 2 * np.asarray(self.acceleration))


def _directions(random: Floats) -> Floats:
    """(n, 3) unit vectors, evenly over the sphere, from (n, 2) numbers of 0 to 1."""
    height, angle = 2 * random[:, 0] - 1, 2 * np.pi * random[:, 1]
    radius = np.sqrt(np.maximum(1 - height**2, 0))
    return np.stack([radius * np.cos(angle), height, radius * np.sin(angle)], -1)


def _random(seed: int, identities: NDArray[np.int64], count: int) -> Floats:
    """(n, count) numbers of 0 to 1 that depend on seed, identity and column alone."""
    # Steele, Lea and Flood 2014, "Fast Splittable Pseudorandom Number Generators", figure 15: SplitMix64's mix
    step = np.uint64(0x9E3779B97F4A7C15)
    with np.errstate(over="ignore"):
        state = identities.astype(np.uint64)[:, None] * np.uint64(count) + np.arange(1, count + 1, dtype=np.uint64)
        z = np.asarray(_mixed(np.uint64(seed % 2**64) * step + step) + state * step, np.uint64)
        return (_mixed(z) >> np.uint64(11)).astype(np.float64) * 2.0**-53


def _mixed(z: NDArray[np.uint64] | np.uint64) -> NDArray[np.uint64]:
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.asarray(z ^ (z >> np.uint64(31)))

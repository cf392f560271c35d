"""What frames cost on the device: milliseconds by effect, now and before."""

from collections import deque
from collections.abc import Mapping

_SAMPLES = 120
"""That are kept."""


class Costs:
    """Milliseconds by effect of the frames that were noted, the newest last; names are words."""

    def __init__(self) -> None:
        self.history: deque[dict[str, float]] = deque(maxlen=_SAMPLES)

    def note(self, milliseconds: Mapping[str, float]) -> None:
        """Keep the milliseconds of a frame."""
        self.history.append({name.replace("_", " "): time for name, time in milliseconds.items() if time > 0})

    @property
    def rows(self) -> list[tuple[str, float]]:
        """Effects of the newest frame, longest first."""
        newest = self.history[-1] if self.history else {}
        return sorted(newest.items(), key=lambda row: -row[1])

    @property
    def sums(self) -> list[float]:
        """Of all effects, frame by frame."""
        return [sum(times.values()) for times in self.history]

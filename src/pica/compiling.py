"""Progress of shader compilation: a frame may wait for it before it begins."""

import logging
import time

from pica.reports import Reports

LONG = 10.0
"""Seconds after which the log has a line, if there is no listener."""
_ENOUGH = 0.25
"""Share of the programs after which the rest can be estimated: the slowest come first."""
REPORTS = Reports("compilation")
"""(programs compiled, programs to compile), first with none of them."""


class Compilation:
    """Programs that no cache had, while they are compiled."""

    def __init__(self, total: int) -> None:
        self._total, self._done = total, 0
        self._began, self._logged = time.monotonic(), False
        self._listener = REPORTS.listener
        self.tell(0)

    def tell(self, done: int) -> None:
        """This many are compiled."""
        self._done = done
        if self._listener is not None:
            self._listener(done, self._total)
        elif time.monotonic() - self._began >= LONG:
            self.log_once()

    def log_once(self) -> None:
        """Log the expected duration; as WARNING, which Python shows by default."""
        if self._logged or self._listener is not None or self._done == self._total:
            return
        self._logged = True
        elapsed = time.monotonic() - self._began
        left = ", the slowest first"
        if self._done >= _ENOUGH * self._total:
            left = f", about {seconds_left(elapsed, self._done, self._total):.0f} s more if nothing else runs"
        logging.getLogger("pica").warning(
            f"shaders are compiled: {self._done} of {self._total} programs after {elapsed:.0f} s{left}. "
            "Later starts find them; `pica prepare` compiles them ahead"
        )


def seconds_left(elapsed: float, done: int, total: int) -> float:
    """Estimated time for the rest, from programs compiled so far: up to three times too long after a quarter of them,
    and about right from half of them on, with two cores and an empty cache."""
    return elapsed * (total - done) / done

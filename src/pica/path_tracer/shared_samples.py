"""The samples of a picture, shared among devices."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from threading import Lock
from typing import Any

Sum = Callable[["SharedSamples"], Any]


class SharedSamples:
    """The indices of a picture's samples, which the threads of devices take one by one: a faster device takes more.

    The first and the last are the finishing device's, whose picture begins and ends with them.
    """

    def __init__(self, count: int) -> None:
        self._last = count - 1
        self._left = iter(range(1, self._last))
        self._lock = Lock()
        self.taken = 0
        """How many have been, by all."""

    def take(self) -> int | None:
        """One that is left, or None."""
        with self._lock:
            index = next(self._left, None)
            self.taken += index is not None
            return index

    def finishing(self) -> Iterator[int]:
        """Those of the device that finishes the picture."""
        self.taken += 1
        yield 0
        while (index := self.take()) is not None:
            yield index
        if self._last > 0:
            self.taken += 1
            yield self._last

    def end(self) -> None:
        """Leave none."""
        with self._lock:
            self._left = iter(range(0))

    @contextmanager
    def beside(self, others: Sequence[Sum]) -> Iterator[Callable[[], list[Any]]]:
        """Sum samples on other devices while the block runs, a thread each. The given function waits for what they
        return, and raises what they raised."""
        with ThreadPoolExecutor(max(1, len(others))) as pool:
            sums = [pool.submit(each, self) for each in others]
            try:
                yield lambda: [each.result() for each in sums]
            finally:
                self.end()

"""Work for other threads, such as encoding, while this one makes the next picture."""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from types import TracebackType
from typing import Self


class Background:
    """Threads for the length of a block. Work is begun in order, and all of it done at the end; its errors are raised
    by a later call, or at the end."""

    def __init__(self, threads: int, ahead: int) -> None:
        """`ahead`: how many pieces of work wait at most; beyond, a call waits for the first."""
        self._pool = ThreadPoolExecutor(threads, "pica")
        self._ahead = ahead
        self._waiting: deque[Future[object]] = deque()

    def __call__(self, work: Callable[..., object], *arguments: object) -> None:
        """Have `work(*arguments)` called."""
        self._waiting.append(self._pool.submit(work, *arguments))
        if len(self._waiting) > self._ahead:
            self._waiting.popleft().result()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._pool.shutdown()
        if error is None:
            for task in self._waiting:
                task.result()

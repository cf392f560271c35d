"""Threads take turns at a device, frame by frame."""

from collections import deque
from collections.abc import Callable
from threading import Lock, RLock, get_ident


class Turns:
    """A lock, for `with`, that threads have in the order in which they ask; whoever has it may take it again.

    What is dropped may be so in any thread and in the midst of anything, as Python's collector likes; what has to be
    done then waits until nobody has the lock (`later`).
    """

    def __init__(self, check: Callable[[], None]) -> None:
        """`check` may raise an error before anybody gets the lock."""
        # Whoever lets go of the second lock waits at the first, behind those who wait for the second: by itself a lock
        # goes back to the thread that has just had it.
        self._queue, self._lock = Lock(), RLock()
        self._check, self._owner, self._depth = check, 0, 0
        self._waiting: deque[Callable[[], object]] = deque()

    def __enter__(self) -> None:
        me = get_ident()
        if self._owner == me:
            self._depth += 1
            return
        self._check()
        with self._queue:
            self._lock.acquire()
        self._owner = me
        try:
            self._check()
        except BaseException:
            self._let_go()
            raise

    def __exit__(self, *_: object) -> None:
        if self._depth:
            self._depth -= 1
        else:
            self._let_go()

    def later(self, call: Callable[[], object]) -> None:
        """Call this at once, or as soon as nobody has the lock."""
        self._waiting.append(call)
        self.tidy()

    def tidy(self) -> None:
        """Make the calls that wait, unless somebody has the lock, who makes them when letting go."""
        if self._waiting and self._owner != get_ident() and self._lock.acquire(blocking=False):
            self._owner = get_ident()
            self._let_go()

    def _let_go(self) -> None:
        try:
            while self._waiting:
                self._waiting.popleft()()
        finally:
            self._owner = 0
            self._lock.release()
        self.tidy()  # what has come between the last call and the release

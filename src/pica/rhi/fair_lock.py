"""The lock of a device: first come, first served."""

from collections import deque
from collections.abc import Callable, Iterable
from threading import Lock, RLock, get_ident


class FairLock:
    """A re-entrant lock, for `with`, which threads get in the order of their requests.

    Python may run finalizers in any thread, between any two instructions. Those that need the lock are deferred until
    it is free (`defer`).
    """

    def __init__(self, check: Callable[[], None]) -> None:
        """`check` runs before the lock is acquired and again once it is; it may raise an error."""
        # Python's locks are not fair: the thread that has just released one mostly gets it again. The queue lock makes
        # it wait behind the threads that already wait for the second.
        self._queue, self._lock = Lock(), RLock()
        self._check, self._owner, self._depth = check, 0, 0
        self._deferred: deque[Callable[[], object]] = deque()

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
            self._release()
            raise

    def __exit__(self, *_: object) -> None:
        if self._depth:
            self._depth -= 1
        else:
            self._release()

    def defer(self, call: Callable[[], object]) -> None:
        """Call this now if the lock is free, else when it is released."""
        self._deferred.append(call)
        self.run_deferred()

    def run_deferred(self) -> None:
        """Run deferred calls if the lock is free; otherwise its owner runs them on release."""
        if self._deferred and self._owner != get_ident() and self._lock.acquire(blocking=False):
            self._owner = get_ident()
            self._release()

    def _release(self) -> None:
        try:
            while self._deferred:
                self._deferred.popleft()()
        finally:
            self._owner = 0
            self._lock.release()
        self.run_deferred()  # calls deferred between the last call and the release


class SeveralLocks:
    """Locks of several devices as one, for `with`: acquired in one order everywhere, or two threads could wait for
    each other."""

    def __init__(self, locks: Iterable[FairLock]) -> None:
        self._locks = sorted(locks, key=id)

    def __enter__(self) -> None:
        acquired = []
        try:
            for lock in self._locks:
                lock.__enter__()
                acquired.append(lock)
        except BaseException:
            for lock in reversed(acquired):
                lock.__exit__()
            raise

    def __exit__(self, *_: object) -> None:
        for lock in reversed(self._locks):
            lock.__exit__()

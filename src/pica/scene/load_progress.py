"""Progress of loading: large files take seconds, most of them for their pictures."""

from threading import Lock

from pica.reports import Reports

REPORTS = Reports("load")
"""(pictures decoded, pictures to decode), from any thread."""


class LoadProgress:
    """So many pictures are decoded, in other threads too."""

    def __init__(self, total: int) -> None:
        self._done, self._total, self._lock = 0, total, Lock()
        self._listener = REPORTS.listener

    def advance(self) -> None:
        """One more is decoded."""
        with self._lock:
            self._done += 1
            if self._listener is not None:
                self._listener(self._done, self._total)

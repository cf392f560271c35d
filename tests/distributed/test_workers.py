import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from pica.distributed.workers import THREADS, do
from pica.errors import PicaError


@dataclass(frozen=True)
class Writing:
    """Writes a file a chunk; `fault` comes in chunk 2."""

    folder: Path
    fault: str = ""

    def weight(self, chunk):
        return 10 + chunk

    def open(self, worker):
        (self.folder / f"worker {worker}").touch()

        def chunk(number):
            if number == 2 and self.fault == "dies":
                os._exit(1)
            if number == 2 and self.fault:
                raise PicaError(self.fault) if self.fault != "bug" else ZeroDivisionError("by zero")
            (self.folder / f"{number}").touch()

        return chunk


def names(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.parametrize("workers", [1, 2, 9])
def test_all_chunks_are_done_and_each_worker_opens_once(tmp_path, workers):
    done = []
    do(Writing(tmp_path), [0, 1, 3], workers, lambda *counts: done.append(counts))
    opened = [name for name in names(tmp_path) if name.startswith("worker")]  # one that is late finds nothing to do
    assert set(opened) <= {f"worker {number}" for number in range(min(workers, 3))} and opened
    assert [name for name in names(tmp_path) if name not in opened] == ["0", "1", "3"]
    assert done[0] == (0, 34) and done[-1] == (34, 34) and {total for _, total in done} == {34}
    assert sorted(np.diff([made for made, _ in done])) == [10, 11, 13]


def test_nothing_is_opened_for_nothing(tmp_path):
    do(Writing(tmp_path), [], 2, lambda *counts: None)
    assert names(tmp_path) == []


@pytest.mark.parametrize(
    ("fault", "kind", "line"),
    [
        ("no room", PicaError, "no room"),
        ("bug", RuntimeError, "worker [01]: ZeroDivisionError: by zero"),
        ("dies", PicaError, "worker [01] ended before its work was done"),
    ],
)
def test_what_happens_in_a_worker_is_raised_here(tmp_path, fault, kind, line):
    with pytest.raises(kind, match=line):
        do(Writing(tmp_path, fault), [0, 1, 2], 2, lambda *counts: None)


def test_workers_have_the_driver_use_one_thread():
    """By the variable's name in Mesa: sums in another order would change last bits of pictures."""
    assert THREADS == "LP_NUM_THREADS"

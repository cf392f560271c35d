"""Work in chunks, by this process or by several, each of which opens the work once."""

import os
import signal
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from typing import Protocol

from pica.errors import PicaError
from pica.text import first_line

Progress = Callable[[int, int], None]
"""Called with (done, total)."""
THREADS = "LP_NUM_THREADS"
"""Environment variable: the threads of the software device (Mesa's lavapipe)."""
_WAIT = 10.0
"""Seconds for a process that was told to end."""


class Work(Protocol):
    """What is to be done; it can be pickled."""

    def weight(self, chunk: int) -> int:
        """How much of the progress a chunk is."""

    def open(self, worker: int) -> Callable[[int], None]:
        """Load what all chunks need. Returns the function that does a chunk, by its number. `worker`: from 0."""


def do(work: Work, chunks: Sequence[int], workers: int, progress: Progress) -> None:
    """Do all chunks, in any order, by `workers` processes, or by this one if it is one.

    Raises what the work raises, and PicaError if a process ends before its chunk is done.
    """
    progress(0, total(work, chunks))
    if workers > 1 and len(chunks) > 1:
        _share(work, chunks, min(workers, len(chunks)), progress)
    elif chunks:
        call, done = work.open(0), 0
        for chunk in chunks:
            call(chunk)
            done += work.weight(chunk)
            progress(done, total(work, chunks))


def total(work: Work, chunks: Sequence[int]) -> int:
    """The weight of all chunks together."""
    return sum(map(work.weight, chunks))


def _share(work: Work, chunks: Sequence[int], workers: int, progress: Progress) -> None:
    context = get_context("spawn")  # a fork would have this process's device without its threads
    left, done = deque(chunks), 0
    with ExitStack() as stack:
        ends: dict[Connection, int] = {}
        given: dict[Connection, int] = {}
        for number in range(workers):
            here, there = context.Pipe()
            process = context.Process(target=_serve, args=(there, work, number), daemon=True)
            process.start()
            there.close()
            stack.callback(process.join, _WAIT)
            stack.callback(process.terminate)
            ends[here] = number
        while ends:
            for end in wait(list(ends)):
                assert isinstance(end, Connection)
                try:
                    error = end.recv()
                except (EOFError, ConnectionResetError):
                    advice = "give it more memory or use fewer workers, then resume"
                    raise PicaError(f"worker {ends[end]} ended before its work was done; {advice}") from None
                if error is not None:
                    raise error
                if end in given:
                    done += work.weight(given.pop(end))
                    progress(done, total(work, chunks))
                if left:
                    given[end] = left.popleft()
                    end.send(given[end])
                else:
                    del ends[end]


def _serve(end: Connection, work: Work, worker: int) -> None:
    """Do the chunks that come, until the other process ends this one or has ended itself."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that has started this one
    os.environ.setdefault(THREADS, "1")  # several change the order of sums, and last bits of pictures with it
    try:
        call = work.open(worker)
        end.send(None)
        while True:
            call(end.recv())
            end.send(None)
    except (EOFError, OSError):
        return
    except PicaError as error:
        end.send(error)
    except Exception as error:
        end.send(RuntimeError(f"worker {worker}: {type(error).__name__}: {first_line(error)}"))

"""Work in chunks on the machines of a Ray cluster (the extra pica[ray])."""

import os
from collections import Counter, deque
from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any

from pica.distributed.workers import THREADS, Progress, Work, total
from pica.errors import PicaError
from pica.text import first_line

AUTO = "auto"
"""The address of the cluster that this machine is part of."""
_CORES = 4
"""Of an actor on machines without graphics cards."""
_TRIES = 3
"""Of a chunk whose actors are lost, after which it is taken for their reason."""


def check_installed() -> None:
    """Raises PicaError without Ray."""
    _ray()


def do_on_cluster(work: Work, chunks: Sequence[int], address: str, progress: Progress) -> None:
    """Do all chunks, in any order, by an actor for each graphics card of the cluster, or for each few cores.

    `address`: "auto", or as ray.init has it. A chunk whose actor is lost is done again by another one. Every machine
    needs pica, and this folder under its name. Raises what the work raises; PicaError without Ray or a cluster, if it
    has no room, or if a chunk loses three actors.
    """
    ray = _ray()
    connects = not ray.is_initialized()
    if connects:
        try:
            ray.init(address=address, log_to_driver=False, logging_level="ERROR")
        except Exception as error:  # not documented; ConnectionError and ValueError among them
            fault = f"cluster {address}: cannot be reached ({first_line(error)}); `ray start --head` starts one"
            raise PicaError(fault) from None
    try:
        _Schedule(ray, work, progress).run(chunks)
    finally:
        if connects:
            ray.shutdown()


class _Actor:
    """On a machine of the cluster: opens the work at its first chunk."""

    def __init__(self, work: Work, folder: str, cores: int) -> None:
        os.environ.setdefault(THREADS, str(cores))
        self._work, self._folder = work, folder
        self._call: Callable[[int], None] | None = None

    def do(self, chunk: int) -> None:
        """Do one chunk."""
        if self._call is None:
            try:
                os.chdir(self._folder)
            except OSError:
                raise PicaError(
                    f"a machine of the cluster has no folder {self._folder}; start in a shared one"
                ) from None
            cards = [str(card) for card in _ray().get_gpu_ids()]
            self._call = self._work.open(int(cards[0]) if cards and cards[0].isdigit() else 0)
        self._call(chunk)


class _Schedule:
    """Which actor does which chunk."""

    def __init__(self, ray: Any, work: Work, progress: Progress) -> None:
        self._ray, self._work, self._progress = ray, work, progress
        has_cards = bool(ray.cluster_resources().get("GPU"))
        self._needed = {"GPU": 1.0, "CPU": 1.0} if has_cards else {"CPU": min(_CORES, self._resource("CPU"))}
        options = {"num_cpus": self._needed["CPU"], "num_gpus": self._needed.get("GPU", 0.0), "max_restarts": 0}
        self._kind = ray.remote(_Actor).options(**options)
        self._shared = ray.put(work)
        self._idle: list[Any] = []
        self._busy: dict[Any, tuple[Any, int]] = {}
        """Actor and chunk by what it will return."""

    def run(self, chunks: Sequence[int]) -> None:
        """Do them all."""
        left, lost, done = deque(chunks), Counter[int](), 0
        everything = total(self._work, chunks)
        self._progress(0, everything)
        while left or self._busy:
            while left and (self._idle or self._has_room()):
                self._start(left.popleft())
            if not self._busy:
                raise PicaError(f"cluster: has no room for a worker, which takes {self._needed}")
            for chunk, error in self._finished():
                if error is None:
                    done += self._work.weight(chunk)
                    self._progress(done, everything)
                    continue
                lost[chunk] += 1
                if lost[chunk] == _TRIES:
                    raise PicaError(f"cluster: lost {_TRIES} workers in one place ({error}); resume without it")
                left.append(chunk)

    def _start(self, chunk: int) -> None:
        actor = self._idle.pop() if self._idle else self._make()
        self._busy[actor.do.remote(chunk)] = actor, chunk

    def _make(self) -> Any:
        return self._kind.remote(self._shared, os.getcwd(), max(int(self._needed["CPU"]), 1))

    def _finished(self) -> list[tuple[int, str | None]]:
        """Waits for chunks: those that ended, with what became of the actor if it was lost."""
        ended: list[tuple[int, str | None]] = []
        ready, _ = self._ray.wait(list(self._busy), num_returns=1)
        for result in ready:
            actor, chunk = self._busy.pop(result)
            try:
                self._ray.get(result)
            except self._ray.exceptions.RayTaskError as error:
                if isinstance(error.cause, PicaError):
                    raise error.cause from None
                raise RuntimeError(f"cluster: {type(error.cause).__name__}: {first_line(error.cause)}") from None
            except self._ray.exceptions.RayError as error:
                ended.append((chunk, first_line(error)))
            else:
                self._idle.append(actor)
                ended.append((chunk, None))
        return ended

    def _has_room(self) -> bool:
        """Whether the machines that are there now have room for one actor more."""
        actors = len(self._idle) + len(self._busy) + 1
        return all(self._resource(name) >= actors * count for name, count in self._needed.items())

    def _resource(self, name: str) -> float:
        return float(self._ray.cluster_resources().get(name, 0.0))


def _ray() -> Any:
    try:
        return import_module("ray")
    except ImportError:
        raise PicaError('cluster: Ray is not installed; `pip install "pica[ray]"` installs it') from None

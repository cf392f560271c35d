"""Worker processes that compile programs: one beside a running renderer, or one a core before a first frame.

SlangPy holds Python's lock while it compiles, so threads would stall frames and each other. A worker process makes the
same programs from the same recipes on its own device: its results are stored in the caches on disk, from which this
process then reads them (program_round.py, preparation.py).
"""

import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any

from pica.errors import DeviceError, PicaError
from pica.programs.material_types import MaterialTypeSet
from pica.rhi.recipes import Recipe

if TYPE_CHECKING:
    from pathlib import Path

_ATTEMPTS = 2
_SECONDS_TO_END = 10


@dataclass
class Task:
    """A recipe for the worker. The serving thread writes all but `cancelled` and `linked`, `done` last."""

    recipe: Recipe[Any]
    types: MaterialTypeSet
    done: bool = False
    answered: bool = False
    """Whether a worker has tried, and not died of it."""
    fault: PicaError | None = None
    cancelled: bool = False
    linked: bool = False


class Compiler:
    """A worker process of a device; it starts with `start`, and ends with `close`, with None among its tasks,
    or with this process. Its thread here starts it: Linux ends it with that thread."""

    def __init__(
        self,
        adapter: str,
        cache: "Path | None",
        tasks: "SimpleQueue[Task | None] | None" = None,
        heard: Callable[[Task], None] | None = None,
    ) -> None:
        """`tasks`: shared by several workers; a single one runs beside frames, which have priority. `heard` is called
        for each finished task, in a thread of the worker's."""
        self._adapter, self._cache = adapter, cache
        self._call = f"main({os.getpid()}, beside_frames={tasks is None})"
        # The same modules under the same cache, and nothing of the script that runs here.
        self._environment = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
            "PICA_CACHE": str(cache),
        }
        self._tasks: SimpleQueue[Task | None] = tasks or SimpleQueue()
        self._heard = heard
        self._thread: threading.Thread | None = None
        self._closed = False
        self.process: subprocess.Popen[bytes] | None = None
        self.failure = ""
        """Why the worker cannot start, once it could not; programs are then compiled where they are used."""
        self.warned = False
        """Whether the user has been warned."""

    def submit(self, task: Task) -> None:
        """Queue a task for the worker."""
        self._tasks.put(task)
        self.start()

    def start(self) -> None:
        """Start the process, which initializes and then works on the queued tasks, and on later ones."""
        if self._thread is None:
            self._thread = threading.Thread(target=self._serve, name="pica shader compiler", daemon=True)
            self._thread.start()

    def close(self) -> None:
        """End the worker; tasks that wait stay undone."""
        self._closed = True
        self._tasks.put(None)
        if self.process is not None:
            self.process.kill()

    def _serve(self) -> None:
        with suppress(OSError):  # tried again with a task, which hears of it
            self.process = self._started()
        while (task := self._tasks.get()) is not None and not self._closed:
            if not task.cancelled:
                task.fault = self._answer(task)
                task.done = True
            if self._heard is not None:
                self._heard(task)
        self._end(0 if self._closed else _SECONDS_TO_END)

    def _answer(self, task: Task) -> PicaError | None:
        """The fault that the worker found. A worker that dies gets a successor; twice at one task is a fault."""
        for _ in range(_ATTEMPTS):
            try:
                process = self.process = self.process or self._started()
            except OSError as error:
                self.failure = str(error)
                return None
            assert process.stdin is not None and process.stdout is not None
            try:
                pickle.dump((task.recipe, task.types), process.stdin)
                process.stdin.flush()
                answer: PicaError | None = pickle.load(process.stdout)
                task.answered = True
                return answer
            except (OSError, EOFError, pickle.UnpicklingError):
                self._end(0)
                if self._closed:
                    return None
        return DeviceError("the shader compiler crashes")

    def _started(self) -> "subprocess.Popen[bytes]":
        if self._cache is None:
            raise OSError("no folder to hand over in what it compiles")
        process = subprocess.Popen(
            [sys.executable, "-c", "from pica.programs.compile_worker import main; " + self._call],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=self._environment,
            start_new_session=True,  # Ctrl-C is for the renderer
        )
        assert process.stdin is not None
        with suppress(OSError):  # it has died, as the first task will find
            pickle.dump(self._adapter, process.stdin)
            process.stdin.flush()
        return process

    def _end(self, seconds: float) -> None:
        """`seconds`: time to store its results in the caches."""
        process, self.process = self.process, None
        if process is None:
            return
        with suppress(OSError, subprocess.TimeoutExpired):
            assert process.stdin is not None
            process.stdin.close()
            process.wait(seconds)
        process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout):
            assert pipe is not None
            with suppress(OSError):  # unflushed output is lost
                pipe.close()


class Workers:
    """Several workers with one queue, for all programs of a first frame."""

    def __init__(self, adapter: str, cache: "Path | None", count: int) -> None:
        self.heard: SimpleQueue[Task] = SimpleQueue()
        """Tasks that are done."""
        self._tasks: SimpleQueue[Task | None] = SimpleQueue()
        self._all = [Compiler(adapter, cache, self._tasks, self.heard.put) for _ in range(count)]

    def start(self) -> None:
        """Start the processes, which make themselves ready for tasks."""
        for worker in self._all:
            worker.start()

    def give(self, tasks: Sequence[Task]) -> None:
        """Queue these tasks, in this order, then the end."""
        for task in (*tasks, *(None for _ in self._all)):
            self._tasks.put(task)

    def close(self) -> None:
        """End them; tasks that wait stay undone."""
        for worker in self._all:
            worker.close()

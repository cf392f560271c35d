"""Programs for material types that come to a running renderer, made without stalling it.

SlangPy holds Python's lock while it compiles, so a thread would stall the frame as much. A worker process makes the
same programs from the same recipes on a device of its own: what it finds lies in the shader cache on disk, from which
this process then takes one program in two frames: one links it, the other makes its pipeline.
"""

import os
import pickle
import subprocess
import sys
import threading
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


@dataclass
class Task:
    """A recipe for the worker. The serving thread writes `fault`, then `done`."""

    recipe: Recipe[Any]
    types: MaterialTypeSet
    done: bool = False
    fault: PicaError | None = None
    cancelled: bool = False
    linked: bool = False


class Compiler:
    """The worker process of a device; it starts with the first task and goes with `close`."""

    def __init__(self, adapter: str, cache: "Path | None") -> None:
        self._adapter, self._cache = adapter, cache
        # The same modules under the same cache, and nothing of the script that runs here.
        self._environment = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
            "PICA_CACHE": str(cache),
        }
        self._tasks: SimpleQueue[Task | None] = SimpleQueue()
        self._thread: threading.Thread | None = None
        self._closed = False
        self.unanswered = 0
        """Tasks that the worker has not seen to."""
        self.process: subprocess.Popen[bytes] | None = None
        self.failure = ""
        """Why the worker cannot start, once it could not; programs are then compiled where they are used."""
        self.warned = False
        """Whether the user has been told."""

    def submit(self, task: Task) -> None:
        """Let the worker see to a task, after those before."""
        self.unanswered += 1
        self._tasks.put(task)
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
        while (task := self._tasks.get()) is not None and not self._closed:
            if not task.cancelled:
                task.fault = self._answer(task)
                task.done = True
            self.unanswered -= 1
        self._end()

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
                pickle.dump((self._adapter, task.recipe, task.types), process.stdin)
                process.stdin.flush()
                answer: PicaError | None = pickle.load(process.stdout)
                return answer
            except (OSError, EOFError, pickle.UnpicklingError):
                self._end()
                if self._closed:
                    return None
        return DeviceError("the shader compiler crashes")

    def _started(self) -> "subprocess.Popen[bytes]":
        if self._cache is None:
            raise OSError("no folder to hand over in what it compiles")
        return subprocess.Popen(
            [sys.executable, "-c", "from pica.programs.compile_worker import main; main()"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=self._environment,
            start_new_session=True,  # Ctrl-C is for the renderer
        )

    def _end(self) -> None:
        process, self.process = self.process, None
        if process is None:
            return
        process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout):
            assert pipe is not None
            with suppress(OSError):  # what was written last can no longer be flushed
                pipe.close()

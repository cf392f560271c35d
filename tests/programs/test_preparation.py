"""Programs for a first frame: by workers where there are several to compile, by this process whatever befalls those."""

import ctypes
import logging
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import slangpy as spy

from pica import compiling
from pica.programs import compiler, preparation
from pica.programs.compile_worker import end_with_parent
from pica.programs.compiler import Compiler
from pica.programs.library import programs
from pica.programs.material_types import STANDARD_ONLY
from pica.rhi.device import Device

PASSES = ("effects/post/straighten.slang", "effects/post/exposure.slang", "effects/post/histogram.slang")
pytestmark = pytest.mark.device


@pytest.fixture
def empty(tmp_path, monkeypatch):
    """A device whose caches are empty, on two cores."""
    monkeypatch.setenv("PICA_CACHE", str(tmp_path))
    monkeypatch.setattr(preparation, "cores", lambda: 2)
    made = Device()
    yield made
    made.close()


@pytest.fixture
def started(monkeypatch):
    """The workers that were started."""
    found, start = [], Compiler._started

    def noting(self):
        found.append(self)
        return start(self)

    monkeypatch.setattr(Compiler, "_started", noting)
    return found


def prepared(device, files=PASSES):
    """Passes made before a first frame, and what was told meanwhile."""
    passes, said = [device.compute(file) for file in files], []
    with compiling.REPORTS.to(lambda *counts: said.append(counts)):
        preparation.prepare(device, STANDARD_ONLY)
    return passes, said


def running(started) -> list[subprocess.Popen]:
    """The processes of two workers, once they are there."""
    until(lambda: len(started) == 2 and all(worker.process is not None for worker in started), 60)
    return [worker.process for worker in started]


def compiled_here(device) -> int:
    """How many shaders this process did not find in the cache."""
    return device.handle.shader_cache_stats.miss_count


def straightened(device, straighten) -> np.ndarray:
    """(8, 8, 4) what the pass makes of a ramp."""
    picture, straight = (device.texture(name, spy.Format.rgba32_float, (8, 8)) for name in ("picture", "straight"))
    picture.copy_from_numpy(np.linspace(0.5, 1, 256, dtype=np.float32).reshape(8, 8, 4))
    with device.record() as recording:
        values = {"size": spy.uint2(8, 8), "channel": 3}
        straighten(recording, (8, 8, 1), picture=picture, alpha=picture, straight=straight, **values)
    return straight.to_numpy()


def test_workers_compile_what_this_process_then_finds(empty, started):
    passes, said = prepared(empty)
    assert said == [(0, 3), (1, 3), (2, 3), (3, 3)]
    assert len(started) == 2 and compiled_here(empty) == 0
    again = Device()
    (straighten, *_), said = prepared(again)
    assert said == [] and len(started) == 2, "the next process has nothing to compile"
    assert straightened(again, straighten).tolist() == straightened(empty, passes[0]).tolist()
    again.close()


@pytest.mark.gpu_differs("NVIDIA's pipelines miss the shader cache twice a program")
def test_one_process_makes_the_same(empty, started, monkeypatch, tmp_path):
    by_workers, _ = prepared(empty)
    monkeypatch.setenv("PICA_CACHE", str(tmp_path / "alone"))
    monkeypatch.setattr(preparation, "cores", lambda: 1)
    alone = Device()
    passes, said = prepared(alone)
    assert said == [(0, 3), (1, 3), (2, 3), (3, 3)]
    assert len(started) == 2 and compiled_here(alone) == 3
    assert straightened(alone, passes[0]).tolist() == straightened(empty, by_workers[0]).tolist()
    assert len(np.unique(straightened(alone, passes[0]))) > 20
    alone.close()


@pytest.mark.gpu_differs("NVIDIA's pipelines miss the shader cache twice a program")
def test_one_program_needs_no_worker(empty, started):
    assert prepared(empty, PASSES[:1])[1] == [(0, 1), (1, 1)]
    assert not started and compiled_here(empty) == 1


def test_workers_get_ready_where_there_is_nothing_yet(empty, started):
    preparation.expect(empty)
    preparation.expect(empty)
    assert all(process.poll() is None for process in running(started))
    assert prepared(empty)[1] == [(0, 3), (1, 3), (2, 3), (3, 3)]
    assert len(started) == 2 and compiled_here(empty) == 0
    again = Device()
    preparation.expect(again)
    assert len(started) == 2, "there is something now"
    again.close()


def test_workers_that_nobody_needed_go_with_the_device(empty, started):
    preparation.expect(empty)
    processes = running(started)
    empty.close()
    for process in processes:
        process.wait(10)  # killed, or at its end before that


@pytest.mark.gpu_differs("NVIDIA's pipelines miss the shader cache twice a program")
def test_a_record_of_what_is_not_there_costs_only_time(empty, started, monkeypatch):
    monkeypatch.setattr(programs(empty).compiled, "has", lambda program: True)
    passes, said = prepared(empty)
    assert said == [] and not started
    assert compiled_here(empty) == 3 and all(compute.pipeline for compute in passes)


@pytest.mark.gpu_differs("NVIDIA's pipelines miss the shader cache twice a program")
@pytest.mark.parametrize("fault", ["dies", "does not start", "has no device"])
def test_a_worker_that_fails_is_no_obstacle(empty, started, monkeypatch, fault):
    if fault == "dies":
        monkeypatch.setattr(compiler, "Compiler", Dying)
    elif fault == "does not start":
        monkeypatch.setattr(sys, "executable", "/nowhere/python")
    else:
        monkeypatch.setattr(compiler, "Compiler", Deviceless)
    passes, said = prepared(empty)
    assert said == [(0, 3), (1, 3), (2, 3), (3, 3)]
    assert started and compiled_here(empty) == 3
    assert all(compute.pipeline for compute in passes)


class Dying(Compiler):
    def _started(self):
        self._call = "raise SystemExit"
        return super()._started()


class Deviceless(Compiler):
    def __init__(self, adapter, *others):
        super().__init__("no such device", *others)


ASKS = """
import sys, threading
from queue import SimpleQueue
from pica.programs.compiler import Compiler
compiler = Compiler("", sys.argv[1], SimpleQueue())
compiler._call = "from tests.programs.test_preparation import endless; endless(" + compiler._call.removeprefix("main(")
compiler.start()
threading.Event().wait()
"""


def endless(parent: int, beside_frames: bool) -> None:
    """A worker whose compiler never comes back, and has Python's lock meanwhile."""
    end_with_parent(parent)
    Path(os.environ["PICA_CACHE"], "worker").write_text(f"{os.getpid()}\n")
    ctypes.PyDLL(None).pause()


@pytest.mark.skipif(sys.platform != "linux", reason="the system does not end workers at once elsewhere")
def test_workers_end_with_their_process_whatever_ends_it(tmp_path):
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, [os.getcwd(), *sys.path]))}
    parent = subprocess.Popen([sys.executable, "-c", ASKS, str(tmp_path)], env=environment)
    told = tmp_path / "worker"
    until(lambda: told.exists() and told.read_text().endswith("\n"), 60)
    worker = int(told.read_text())
    assert alive(worker)
    parent.kill()
    parent.wait()
    until(lambda: not alive(worker), 5)


def until(condition, seconds: float) -> None:
    begun = time.monotonic()
    while not condition():
        assert time.monotonic() - begun < seconds
        time.sleep(0.01)


def alive(process: int) -> bool:
    """Whether a process runs; one that nobody has asked for its end does not."""
    try:
        with open(f"/proc/{process}/stat") as file:
            return file.read().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_a_long_wait_is_told_once_where_nobody_listens(monkeypatch, caplog):
    clock = iter([0, 0, 9, 12, 12])
    monkeypatch.setattr(compiling.time, "monotonic", lambda: next(clock))
    with caplog.at_level(logging.WARNING, "pica"):
        compilation = compiling.Compilation(4)
        compilation.tell(1)
        assert caplog.messages == []
        compilation.tell(2)
    (message,) = caplog.messages
    assert "2 of 4 programs after 12 s, about 12 s more if nothing else runs" in message and "pica prepare" in message


def test_a_long_wait_for_the_first_of_many_is_no_forecast(monkeypatch, caplog):
    clock = iter([0, 0, 12, 12])
    monkeypatch.setattr(compiling.time, "monotonic", lambda: next(clock))
    with caplog.at_level(logging.WARNING, "pica"):
        compiling.Compilation(55).tell(1)
    (message,) = caplog.messages
    assert "1 of 55 programs after 12 s, the slowest first. Later" in message


def test_the_forecast_is_rather_too_long_than_too_short():
    """Seconds at which the n-th of 35 programs of the scene cornell was there, with an empty cache and two workers."""
    measured = {4: 1.8, 8: 3.0, 11: 6.8, 18: 7.8, 23: 9.2, 28: 10.2, 32: 11.2, 35: 11.9}
    for done, elapsed in measured.items():
        left = measured[35] - elapsed
        assert 0.95 * left <= compiling.seconds_left(elapsed, done, 35) <= 3 * left + 0.1

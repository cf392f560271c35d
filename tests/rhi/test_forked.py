"""What a process can do that was forked from one with a device: nothing, and it says so."""

import os
import subprocess
import sys

import pytest

FORKED = """
import os, sys, time, warnings
import pica
from pica.rhi.device import Device, open_device
from tests.building import CAMERA, still_life

raster = pica.Settings.preset("raster")
scene = still_life()
renderer = pica.Renderer(scene, size=(16, 16), settings=raster)
frame = renderer.render(1, camera=CAMERA)

def read(): frame.color
def render(): renderer.render(1, camera=CAMERA)
def advance(): renderer.advance(CAMERA)
def resize(): renderer.resize((8, 8))
def close(): renderer.close()
def another(): pica.Renderer(scene, size=(16, 16), settings=raster)
def path_tracer(): pica.PathTracer(scene, size=(16, 16))
def end():
    global renderer, frame
    del renderer, frame

for call in (read, render, advance, resize, close, another, path_tracer, open_device, Device, end):
    sys.stdout.flush()
    child = os.fork()
    if not child:
        try:
            call()
            print(call.__name__, "worked", flush=True)
        except pica.errors.DeviceError as error:
            print(call.__name__, error, flush=True)
        sys.exit(3)  # as a process ends that knows of nothing
    for _ in range(300):
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            break
        time.sleep(0.05)
    else:
        os.kill(child, 9)
        sys.exit(f"{call.__name__} hangs")
    assert os.waitstatus_to_exitcode(status) == 3, (call.__name__, status)
render()
print(frame.color.shape)
"""
SPAWNED = """
import multiprocessing
from pica.rhi.device import open_device

def work(queue):
    queue.put(bool(open_device().compute("path_tracer/average.slang")))

if __name__ == "__main__":
    open_device()
    spawn = multiprocessing.get_context("spawn")
    queue = spawn.Queue()
    process = spawn.Process(target=work, args=(queue,))
    process.start()
    assert queue.get(timeout=100)
    process.join(30)
    print(process.exitcode)
"""


@pytest.mark.device
@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork here")
@pytest.mark.skipif(
    bool(os.environ.get("PICA_VALIDATE")), reason="SlangPy frees a logger that was asked for after Python"
)
def test_a_forked_process_gets_one_error_and_ends():
    done = subprocess.run([sys.executable, "-c", FORKED], capture_output=True, text=True, timeout=280)
    assert done.returncode == 0, done.stderr
    *said, last = done.stdout.splitlines()
    assert last == "(16, 16, 3)", "the parent goes on"
    assert len(said) == 10 and said[-1] == "end worked"
    assert all("was forked from one that had a graphics device open" in line and "spawn" in line for line in said[:-1])


@pytest.mark.device
def test_a_spawned_process_has_a_device_of_its_own(tmp_path):
    script = tmp_path / "spawned.py"
    script.write_text(SPAWNED)
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, timeout=200)
    assert done.stdout == "0\n", done.stderr

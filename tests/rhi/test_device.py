"""What a device keeps: caches on disk, and a count of its memory."""

import os
import subprocess
import sys
import time

import numpy as np
import pytest
import slangpy as spy

from pica.rhi.device import cache_folder

COMPILE = """
from pica.rhi.device import Device
import slangpy as spy
device = Device()
compute = device.compute("path_tracer/average.slang")
print("made", bool(compute.pipeline))
"""


def compile_in(folder):
    """Compile one shader in a process of its own; the files that are in the cache afterwards, with their ages."""
    done = subprocess.run(
        [sys.executable, "-c", COMPILE],
        env={**os.environ, "PICA_CACHE": str(folder)},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.stdout.strip() == "made True", done.stderr
    return {path: path.stat().st_mtime_ns for path in folder.rglob("*") if path.is_file()} if folder.is_dir() else {}


@pytest.mark.device
def test_compiled_shaders_are_kept_and_used_again(tmp_path):
    first = compile_in(tmp_path / "cache")
    assert any("shaders" in path.parts for path in first) and any("modules" in path.parts for path in first)
    modules = {path: age for path, age in first.items() if path.suffix == ".slang-module"}
    assert any("average" in path.name for path in modules)
    time.sleep(0.05)
    second = compile_in(tmp_path / "cache")
    assert {path: second[path] for path in modules} == modules, "nothing was compiled anew"


@pytest.mark.device
def test_a_folder_that_cannot_be_written_is_no_obstacle(tmp_path):
    (tmp_path / "file").write_text("in the way")
    assert compile_in(tmp_path / "file" / "cache") == {}


def test_environment_variable_names_the_folder(monkeypatch, tmp_path):
    monkeypatch.setenv("PICA_CACHE", str(tmp_path / "here"))
    assert cache_folder() == tmp_path / "here"
    monkeypatch.delenv("PICA_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "there"))
    if sys.platform.startswith("linux"):
        assert cache_folder() == tmp_path / "there" / "pica"


def test_memory_is_counted(device):
    before = device.memory
    device.buffer("kilobyte", size=1024)
    device.structured("numbers", np.zeros((100, 3), np.float32))
    assert device.memory == before + 1024 + 1200
    device.texture("picture", spy.Format.rgba32_float, (64, 64))
    assert device.memory >= before + 1024 + 1200 + 64 * 64 * 16
    device.count_memory(-1024)
    assert device.memory < device.peak_memory


def test_empty_data_still_makes_a_buffer(device):
    assert device.structured("nothing", np.zeros((0, 3), np.float32)).size >= 12

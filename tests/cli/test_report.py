"""What commands say while they work."""

import json
import os
import pty
import sys
import time

import numpy as np
import pytest

from pica.cli import report
from pica.cli.report import progress
from pica.compiling import Compilation
from pica.images.pictures import encoded_png
from pica.scene.loading import load
from pica.texture_space import unwrap_progress
from tests.scene.gltf_files import GltfFile


def test_a_bar_of_its_own_says_how_many_shaders_are_compiled(capsys):
    with progress("Rendering") as advance:
        Compilation(17).tell(7)
        advance(1, 2)
    rendering, compiled = capsys.readouterr().err.splitlines()
    assert rendering.startswith("Rendering ") and "1/2" in rendering
    assert compiled.startswith("Compiling shaders ") and " 7/17" in compiled


def test_a_bar_of_its_own_says_how_many_triangles_are_unwrapped(capsys):
    with progress("Rendering") as advance:
        unwrap_progress.REPORTS.listener(120, 480)
        advance(1, 2)
    _, unwrapped = capsys.readouterr().err.splitlines()
    assert unwrapped.startswith("Unwrapping triangles ") and " 120/480" in unwrapped


def test_nothing_is_said_of_shaders_where_none_are_compiled(capsys):
    with progress("Rendering") as advance:
        advance(1, 2)
    Compilation(2).tell(1)
    assert "Compiling" not in capsys.readouterr().err


def test_with_json_progress_is_lines_of_it(capsys):
    with progress("Rendering", json=True) as advance:
        Compilation(17).tell(7)
        advance(1, 2)
    said = capsys.readouterr()
    assert said.out == ""
    assert [json.loads(line) for line in said.err.splitlines()] == [
        {"progress": "Compiling shaders", "done": 0, "total": 17},
        {"progress": "Compiling shaders", "done": 7, "total": 17},
        {"progress": "Rendering", "done": 1, "total": 2},
    ]


def said_by_a_load(monkeypatch, tmp_path, late, seconds):
    """What a terminal shows of a load with two large pictures, and of so many further seconds."""
    terminal, ours = pty.openpty()
    monkeypatch.setattr(report, "_LATE", late)
    monkeypatch.setenv("TERM", "xterm")
    with os.fdopen(ours, "w") as stderr, monkeypatch.context() as patched:
        patched.setattr(sys, "stderr", stderr)
        with report.load_progress("Loading model.gltf"):
            time.sleep(seconds)
            load(large_pictures(tmp_path))
            time.sleep(seconds)
        stderr.write("end")
        stderr.flush()
        shown = b""
        while not shown.endswith(b"end"):
            shown += os.read(terminal, 1 << 16)
    os.close(terminal)
    return shown.decode()


def large_pictures(folder):
    file = GltfFile()
    noise = np.random.default_rng(0).integers(0, 255, (2, 256, 256, 4), np.uint8)
    for pixels in noise:
        texture = file.add("textures", source=file.add("images", bufferView=file.view(encoded_png(pixels))))
        file.mesh(material=file.add("materials", pbrMetallicRoughness={"baseColorTexture": {"index": texture}}))
    return file.write(folder)


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_a_bar_for_loads_that_take_long(monkeypatch, tmp_path, capfd):
    assert "Loading model.gltf" in said_by_a_load(monkeypatch, tmp_path, 0.1, 0.3)
    assert said_by_a_load(monkeypatch, tmp_path, 60, 0) == "end"
    with report.load_progress("Loading model.gltf"):
        time.sleep(0.2)
    assert capfd.readouterr() == ("", "")

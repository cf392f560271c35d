import subprocess
import sys
import warnings

import numpy as np
import pytest

import pica
from pica.errors import SceneError
from tests.cli.conftest import FakeRenderer


@pytest.fixture
def render(run, calls, tmp_path):
    return lambda: run("render", "model.glb", "-o", tmp_path / "out.png", "--size", "8x4")


@pytest.mark.parametrize(
    ("error", "code", "says"),
    [
        (SceneError("model.glb: broken"), 2, "pica: model.glb: broken"),
        (SceneError("model\n\x1b[2J.glb: broken"), 2, "pica: model\\n\\x1b[2J.glb: broken"),
        (SceneError("x" * 10**6 + ": broken"), 2, f"pica: {'x' * 497} ... {'x' * 489}: broken"),
        (SceneError(f"eye {(np.float64(1),)}"), 2, "pica: eye (1.0,)"),
        (SceneError(""), 2, "pica: SceneError"),
        (PermissionError(13, "Permission denied", "x.png"), 2, "pica: x.png: Permission denied"),
        (PermissionError(13, "Permission denied", b"\xff\n"), 2, "pica: \\udcff\\n: Permission denied"),
        (OSError("no place"), 2, "pica: no place"),
        (UserWarning("raised"), 2, "pica: raised"),
        (MemoryError("unable to allocate 9 EiB"), 2, "pica: not enough memory (unable to allocate 9 EiB)"),
        (RuntimeError("\nof C++\nmore"), 1, "pica: internal error, RuntimeError: of C++ (PICA_DEBUG=1 shows where)"),
        (KeyError("lost"), 1, "pica: internal error, KeyError: 'lost' (PICA_DEBUG=1 shows where)"),
        (KeyboardInterrupt(), 130, ""),
    ],
)
def test_every_error_is_one_line_and_an_exit_code(render, monkeypatch, error, code, says):
    monkeypatch.delenv("PICA_DEBUG", raising=False)
    monkeypatch.setattr(FakeRenderer, "error", error)
    assert render() == (code, "", f"{says}\n" if says else "")


def test_debug_lets_the_traceback_through(render, monkeypatch):
    monkeypatch.setenv("PICA_DEBUG", "1")
    monkeypatch.setattr(FakeRenderer, "error", SceneError("broken"))
    with pytest.raises(SceneError):
        render()


def test_warnings_are_one_line(run, calls, tmp_path, monkeypatch):
    def load(path, environment=None, **_):
        warnings.warn("model.glb: extension X is ignored", stacklevel=2)
        return pica.Scene()

    monkeypatch.setitem(vars(pica), "load", load)
    code, _, err = run("render", "model.glb", "-o", tmp_path / "out.png")
    assert code == 0
    assert "pica: warning: model.glb: extension X is ignored" in err.splitlines()


def test_warnings_before_an_error_are_marked_safe_to_print_and_not_without_end(render, monkeypatch):
    def load(path, environment=None, **_):
        for number in range(200):
            warnings.warn(f"mesh '\x1b[31m\n{'x' * 10_000}': {number}", stacklevel=2)
        raise SceneError("broken")

    monkeypatch.setitem(vars(pica), "load", load)
    code, _, err = render()
    *before, last = err.splitlines()
    assert (code, last) == (2, "pica: broken")
    assert all(line.startswith("pica: warning: ") and line.isprintable() and len(line) < 1100 for line in before)
    assert 100 <= len(before) <= 101 and "more warnings" in before[-1]


@pytest.mark.parametrize(
    "arguments",
    [
        ["nonsense"],
        ["render"],
        ["render", "cornell"],
        ["render", "cornell", "-o"],
        ["render", "cornell", "-o", "x.png", "--frames", "0"],
        ["render", "cornell", "-o", "x.png", "--frames", "many"],
        ["render", "cornell", "-o", "x.png", "--frames=99999999999999999999"],
        ["render", "cornell", "-o", "x.png", "--frames=-1"],
        ["render", "cornell", "-o", "x.png", "--frames="],
        ["render", "cornell", "-o", "x.png", "--frames", "9" * 10_000],
        ["render", "cornell", "-o", "x.png", "--samples=99999999999999999999", "--path-traced"],
        ["render", "cornell", "-o", "x.png", "--fov", "\udcff\x1b"],
        ["render", "cornell", "-o", "x.png", "\x1b[31m\n"],
        ["render", "cornell", "-o", "x.png", "--json=yes"],
        ["bench", "cornell", "--frames=1000001"],
        ["bench", "cornell", "--warm-up=99999999999999999999"],
        ["bench", "cornell", "--warm-up=-1"],
        ["compare", "cornell", "--samples=99999999999999999999"],
        ["compare", "cornell", "--max-depth=99999999999999999999"],
        ["doctor", "--json"],
        ["\x1b[31m\n\udcff"],
        ["x" * 1_000_000],
        ["render", "cornell", "-o", "x.png", "--nope"],
    ],
)
def test_usage_errors_are_one_line_and_code_2(run, arguments):
    code, out, err = run(*arguments)
    assert (code, out) == (2, "")
    assert err.startswith("pica: ") and err.endswith(" --help)\n") and err[:-1].isprintable() and len(err) < 1100


def test_help_is_quick_and_needs_no_device():
    code = (
        "import sys; from pica.cli.main import main\n"
        "main(['render', '--help'])\n"
        "slow = {'slangpy', 'numpy', 'llvmlite', 'PIL', 'av', 'flip_evaluator', 'rich'} & set(sys.modules)\n"
        "assert not slow, slow"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=30)
    assert run.returncode == 0, run.stderr
    assert "--path-traced" in run.stdout


def test_without_a_command_it_shows_the_help(run):
    code, out, err = run()
    assert code == 2 and "Usage: pica" in out and err == ""
    assert run("--help") == (0, out, "")


@pytest.mark.parametrize("columns", ["1", "0", "wide", "999999999"])
def test_help_is_whole_in_any_terminal(run, monkeypatch, columns):
    monkeypatch.setenv("COLUMNS", columns)
    out = run("--help")[1]
    assert "how far the hybrid picture of SCENE is from the path traced one" in " ".join(out.split())
    assert len(out) < 2000 and out.isascii()


def test_libraries_that_print_leave_stdout_alone():
    code = (
        "import os, sys, typer; from pica.cli import app as a, main as m\n"
        "@a.app.command()\n"
        "def noisy():\n"
        "    os.write(1, b'noise\\n'); print('result')\n"
        "sys.exit(m.main(['noisy']))"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=30)
    assert (run.returncode, run.stdout, run.stderr) == (0, "result\n", "noise\n")

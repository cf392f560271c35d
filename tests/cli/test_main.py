import subprocess
import sys
import warnings

import pytest

from pica.errors import SceneError
from tests.cli.conftest import FakeRenderer


@pytest.fixture
def render(run, calls, tmp_path):
    return lambda: run("render", "model.glb", "-o", tmp_path / "out.png", "--size", "8x4")


@pytest.mark.parametrize(
    ("error", "code", "says"),
    [
        (SceneError("model.glb: broken"), 2, "pica: model.glb: broken"),
        (SceneError("model.glb: broken\nmore"), 2, "pica: model.glb: broken (PICA_DEBUG=1 shows the rest)"),
        (PermissionError(13, "Permission denied", "x.png"), 2, "pica: x.png: Permission denied"),
        (KeyError("lost"), 1, "pica: internal error, KeyError: 'lost' (PICA_DEBUG=1 shows where)"),
        (KeyboardInterrupt(), 130, ""),
    ],
)
def test_every_error_is_one_line_and_an_exit_code(render, monkeypatch, error, code, says):
    monkeypatch.delenv("PICA_DEBUG", raising=False)
    monkeypatch.setattr(FakeRenderer, "error", error)
    got, out, err = render()
    last = [line for line in err.splitlines() if line.startswith("pica:")]
    assert (got, out, last) == (code, "", [says] if says else [])
    assert "Traceback" not in err


def test_debug_lets_the_traceback_through(render, monkeypatch):
    monkeypatch.setenv("PICA_DEBUG", "1")
    monkeypatch.setattr(FakeRenderer, "error", SceneError("broken"))
    with pytest.raises(SceneError):
        render()


def test_warnings_are_one_line(run, calls, tmp_path, monkeypatch):
    import pica

    def load(path, environment=None, **_):
        warnings.warn("model.glb: extension X is ignored", stacklevel=2)
        return pica.Scene()

    monkeypatch.setitem(vars(pica), "load", load)
    code, _, err = run("render", "model.glb", "-o", tmp_path / "out.png")
    assert code == 0
    assert "pica: warning: model.glb: extension X is ignored" in err.splitlines()


@pytest.mark.parametrize(
    "arguments",
    [
        ["nonsense"],
        ["render"],
        ["render", "cornell"],
        ["render", "cornell", "-o"],
        ["render", "cornell", "-o", "x.png", "--frames", "0"],
        ["render", "cornell", "-o", "x.png", "--frames", "many"],
        ["render", "cornell", "-o", "x.png", "--nope"],
    ],
)
def test_usage_errors_are_one_line_and_code_2(run, arguments):
    code, out, err = run(*arguments)
    assert (code, out) == (2, "")
    assert err.startswith("pica: ") and err.count("\n") == 1 and "--help" in err


def test_help_is_quick_and_needs_no_device():
    code = "import sys; from pica.cli.main import main; main(['render', '--help']); assert 'slangpy' not in sys.modules"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=30)
    assert run.returncode == 0, run.stderr
    assert "--path-traced" in run.stdout


def test_libraries_that_print_leave_stdout_alone():
    code = (
        "import os, sys, typer; from pica.cli import main as m\n"
        "@m.app.command()\n"
        "def noisy():\n"
        "    os.write(1, b'noise\\n'); print('result')\n"
        "sys.exit(m.main(['noisy']))"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=30)
    assert (run.returncode, run.stdout, run.stderr) == (0, "result\n", "noise\n")

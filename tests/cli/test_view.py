"""`pica view`: starts, shows, ends. What pages get is in tests/viewer."""

import json
import signal
import subprocess
import sys

import numpy as np
import pytest

import pica

pytest.importorskip("viser", reason="the extra pica[view] is not installed")

from tests.viewer.page import Page

HEARD = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
"""Who starts the tests in the background ignores Ctrl-C for them, and for the processes that they start."""


@pytest.mark.device
def test_it_prints_its_address_and_ends_with_ctrl_c():
    command = [
        "view",
        "cornell",
        "--preset",
        "raster",
        "--set",
        "global_illumination.mode=off",
        "--size",
        "64x36",
        "--frames",
        "2",
        "--port",
        "0",
        "--json",
    ]
    code = f"{HEARD}import sys; sys.argv = ['pica', *{command}]; from pica.cli.main import main; sys.exit(main())"
    started = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        lines = [started.stdout.readline()]
        while lines[-1] not in ("}\n", ""):
            lines.append(started.stdout.readline())
        page = Page(json.loads("".join(lines))["address"])
        page.look(pica.Camera.look_at((0, 1, 4), (0, 1, 0), vertical_fov=np.radians(40)), (64, 36))
        page.picture(lambda pixels: pixels.shape == (36, 64, 3), 200.0)
        started.send_signal(signal.SIGINT)
        out, errors = started.communicate(timeout=60)
    finally:
        started.kill()
    assert (started.returncode, out) == (130, "")
    assert "Traceback" not in errors and "pica:" not in errors


def test_without_viser_one_line_names_the_extra(run, monkeypatch):
    monkeypatch.setitem(sys.modules, "viser", None)
    code, out, errors = run("view", "cornell")
    assert (code, out) == (2, "") and "pip install pica[view]" in errors and errors.count("\n") == 1


def test_wrong_arguments_are_said_before_anything_is_loaded(run):
    for arguments, fault in [(("--size", "big"), "--size 'big'"), (("--set", "post.exposure=x"), "post.exposure")]:
        code, _, errors = run("view", "cornell", *arguments)
        assert code == 2 and fault in errors

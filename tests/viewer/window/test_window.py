"""The window on a virtual display: it is used, looked at, and looked into for what stays behind."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from pica.errors import DeviceError
from pica.viewer.window.presenter import Presenter

ROOT = Path(__file__).resolve().parents[3]
on_display = pytest.mark.skipif(shutil.which("Xvfb") is None, reason="no Xvfb, which is a display without a screen")
pytestmark = pytest.mark.device
PANEL = 490
"""Columns of the window that the panel hides."""


@pytest.fixture(scope="module")
def display():
    """The name of a display."""
    read, write = os.pipe()
    command = ["Xvfb", "-displayfd", str(write), "-screen", "0", "800x600x24", "-nolisten", "tcp"]
    server = subprocess.Popen(command, pass_fds=[write], stderr=subprocess.DEVNULL)
    os.close(write)
    with os.fdopen(read) as name:
        yield f":{name.readline().strip()}"
    server.terminate()
    server.wait(10)


def python(tmp_path, display, *command, **more):
    environment = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
    environment["PYTHONPATH"] = os.pathsep.join([str(ROOT / "src"), str(ROOT)])
    if display is not None:
        environment["DISPLAY"] = display
    return subprocess.run(
        [sys.executable, "-m", *command], cwd=tmp_path, env=environment, capture_output=True, text=True, **more
    )


def driven(tmp_path, display, *command, timeout):
    done = python(tmp_path, display, "tests.viewer.window.driving", *command, timeout=timeout)
    assert done.returncode == 0, done.stderr[-3000:]
    return json.loads(done.stdout)


def check_actions(tmp_path, display, count, timeout):
    folder = tmp_path / "folder"
    folder.mkdir()
    result = driven(folder, display, "actions", str(count), str(tmp_path / "window.png"), timeout=timeout)
    assert result["errors"] == [] and result["used"] == count
    assert "cameras.json" in result["saved"] and any(name.endswith(".png") for name in result["saved"])
    return result, np.asarray(Image.open(tmp_path / "window.png").convert("RGB")).astype(int)


@on_display
def test_every_control_is_used_and_the_window_shows_scene_and_panel(tmp_path, display):
    result, picture = check_actions(tmp_path, display, 50, 240)
    assert result["controls"] >= 30
    beside = picture[:240, PANEL:600]
    assert beside[20:60].min() > 100 > beside[180:].max() > 30, "the sky above the floor"
    assert (picture[35:230, 15:480] < 40).mean() > 0.5, "the dark panel"
    assert picture[240:].max() == 0, "the display has nothing else"


@on_display
@pytest.mark.skipif(shutil.which("xdotool") is None, reason="no xdotool, which moves the mouse")
def test_the_mouse_and_the_keys_of_the_display(tmp_path, display):
    result = driven(tmp_path, display, "drag", timeout=240)
    assert result["moved"] == [False, True], "on the panel nothing, beside it the camera"
    assert result["flown"] == pytest.approx(0.1, rel=1e-3) and result["panel"] is False


@on_display
@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_a_thousand_actions_end_in_no_error(tmp_path, display):
    result, _ = check_actions(tmp_path, display, 1000, 3500)
    assert result["controls"] >= 90


@on_display
@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_sizes_presets_and_scenes_leave_nothing_behind(tmp_path, display):
    result = driven(tmp_path, display, "cycles", "300", timeout=3500)
    assert result["message"] == "" and result["scenes"] <= 2
    resident, on_device = np.array(result["memory"]).T
    assert on_device[-10:].max() <= on_device[5:15].max() * 1.02
    assert resident[-10:].max() < resident[5:15].max() + 40e6


def test_without_a_display_one_line_names_the_browser(tmp_path):
    done = python(tmp_path, None, "pica", "view", "cornell", "--window", timeout=60)
    assert done.returncode == 2 and not done.stdout
    [line] = done.stderr.strip().splitlines()
    assert "--window needs a display" in line and "browser" in line


def test_a_device_that_presents_nothing_is_one_line():
    def refused(window):
        raise RuntimeError("no surface\nat line 1")

    device = SimpleNamespace(name="card", handle=SimpleNamespace(create_surface=refused))
    with pytest.raises(DeviceError, match=r"^device 'card' can present to no window \(no surface\); .*browser$"):
        Presenter(device, None)

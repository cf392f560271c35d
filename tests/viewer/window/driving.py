"""Uses a window as a person does, in a process of its own: a fault of its libraries ends no test run.

    python -m tests.viewer.window.driving actions COUNT PICTURE
    python -m tests.viewer.window.driving cycles COUNT
    python -m tests.viewer.window.driving drag

Prints a JSON object.
"""

import gc
import json
import random
import resource
import subprocess
import sys
import time
import weakref
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import slangpy as spy
from PIL import ImageGrab
from slangpy import ui

import pica
from pica.scene.light import PointLight
from pica.scene.model import Node
from pica.viewer.viewer import Viewer
from pica.viewer.window.window_viewer import WindowViewer
from tests.viewer.scenes import CAMERA, scene

SIZE = (600, 240)
SETTLED = 400
"""Turns at most until the picture is complete."""


def made(name: str = "lit") -> pica.Scene:
    result = scene()
    result.add(Node(name, light=PointLight(intensity=50.0)))
    return result


def opened(size: tuple[int, int] = SIZE) -> WindowViewer:
    viewer = Viewer(made(), settings=pica.Settings.preset("raster"), frames=2)
    return WindowViewer(viewer, size=size, camera=CAMERA, load=made)


def settle(window: WindowViewer) -> None:
    for _ in range(SETTLED):
        window.step(0.01)
        if window.viewer.is_complete(window.view):
            return
    raise AssertionError(f"never complete: {window.message}")


def controls(parent: ui.Widget, path: str = "") -> Iterator[tuple[str, Any]]:
    """All widgets that a user may change, by their place, as they are now."""
    for widget in parent.children:
        label = f"{path}/{getattr(widget, 'label', '')}"
        if isinstance(widget, ui.Group):
            yield from controls(widget, label)
        elif hasattr(widget, "_get_callback") and widget.enabled:
            yield label, widget


def use(widget: Any, chance: random.Random, value: Any = None) -> None:
    """Set a value, or press a button, as ImGui does."""
    if isinstance(widget, ui.Button):
        widget._get_callback()()
        return
    if value is None:
        value = some_value(widget, chance)
    widget.value = value
    if (callback := widget._get_callback()) is not None:
        callback(value)


def some_value(widget: Any, chance: random.Random) -> Any:
    match widget:
        case ui.CheckBox():
            return not widget.value
        case ui.ComboBox() | ui.ListBox():
            return chance.randrange(len(widget.items))
        case ui.InputText():
            return chance.choice(["one", "another"])
        case ui.SliderInt3():
            return spy.int3(*(chance.randrange(256) for _ in range(3)))
        case ui.DragFloat3():
            return spy.float3(*(chance.uniform(0.5, 1) for _ in range(3)))
        case ui.SliderInt() | ui.DragInt():
            return widget.min  # the largest maps take gigabytes
        case _:
            return chance.uniform(widget.min, min(widget.max, widget.min + 1))


def act(count: int, picture: Path) -> dict[str, Any]:
    """Use each control in turn, `count` times in all. Settings go back after each, as combinations compile for long."""
    window, chance = opened(), random.Random(1)
    settle(window)
    ImageGrab.grab(xdisplay="").save(picture)
    base, used, errors = window.viewer.settings, [], []
    while len(used) < count:
        window.viewer.select(chance.choice([None, *window.viewer.scene.nodes()]))
        window.change(lambda: None)  # the panel follows
        window.step(0.01)
        for path in [path for path, _ in controls(window.panel)]:
            widget = dict(controls(window.panel)).get(path)
            is_setting = path.startswith("/Settings/")
            if widget is None or len(used) >= count or (is_setting and count < 500 and chance.random() < 0.97):
                continue
            use(widget, chance)
            used.append(path)
            for _ in range(3):
                window.step(0.02)
            if is_setting and window.viewer.settings != base:
                window.choose_settings(lambda _: base)
                window.step(0.01)
            if window.message and not window.message.startswith("Saved"):
                errors.append(f"{path}: {window.message}")
    saved = sorted(path.name for path in Path().iterdir())
    window.close()
    return {"used": len(used), "controls": len(set(used)), "errors": errors, "saved": saved}


def drag() -> dict[str, Any]:
    """Drag beside the panel and on it, each time in one go while the window does not look."""
    window = opened()
    settle(window)
    moved = []
    for start in (470, 550):
        subprocess.run(["xdotool", "mousemove", "100", "100"], check=True)
        for _ in range(5):
            window.step(0.01)
        before = window.view.control.camera
        there = "mousemove {0} 120 mousedown 1 mousemove {1} 120 mousemove {2} 120 mouseup 1"
        subprocess.run(["xdotool", *there.format(start, start + 5, start + 10).split()], check=True)
        time.sleep(0.2)
        for _ in range(5):
            window.step(0.01)
        moved.append(window.view.control.camera is not before)
    subprocess.run(["xdotool", "keydown", "w"], check=True)
    before, distance = window.view.control.camera.transform[:3, 3], window.view.control.distance
    time.sleep(0.2)
    window.step(60.0)
    flown = float(np.linalg.norm(window.view.control.camera.transform[:3, 3] - before)) / distance
    subprocess.run(["xdotool", "keyup", "w", "key", "F1"], check=True)
    time.sleep(0.2)
    window.step(0.01)
    return {"moved": moved, "flown": flown, "panel": window.panel.visible}


def cycle(count: int) -> dict[str, Any]:
    """Resize, choose presets and open scenes, over and over."""
    window, memory, scenes = opened((96, 64)), [], []
    for number in range(count):
        scenes.append(weakref.ref(window.viewer.scene))
        window._window.resize(96 + 16 * (number % 3), 64 + 8 * (number % 2))
        window.choose_settings(lambda _, name=("raster", "performance")[number % 2]: pica.Settings.preset(name))
        window.open(f"scene {number % 2}")
        for _ in range(4):
            window.step(0.05)
        if number % 10 == 9:
            gc.collect()
            resident = int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()
            memory.append((resident, window.viewer.device.memory))
    alive = sum(each() is not None for each in scenes)
    message = window.message
    window.close()
    return {"memory": memory, "scenes": alive, "message": message}


if __name__ == "__main__":
    match sys.argv[1:]:
        case "actions", count, picture:
            result = act(int(count), Path(picture))
        case "cycles", count:
            result = cycle(int(count))
        case _:
            result = drag()
    print(json.dumps(result))

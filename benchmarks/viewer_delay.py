"""Delays of `pica view`, as a page sees them: from a camera to its picture, and between pictures while it is dragged.

python benchmarks/viewer_delay.py cornell [quality] [--size 640x360]
"""

import argparse
import io
import json
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
from PIL import Image

import pica
from pica.frame.context import Size
from pica.scene.orbit import orbited, pivot, turned
from tests.viewer.page import Page

QUIET = 2.0
"""Seconds without a picture after which there will be no more."""
SECONDS = 8.0
"""That the camera is dragged for."""
JUMPS, TURN = 40, 0.05
"""Turns of the camera whose delay is measured; radians, each way in turn."""


def served(scene: str, preset: str, size: Size) -> tuple[subprocess.Popen, str]:
    """A server in a process of its own, and its address."""
    command = ["view", scene, "--preset", preset, "--size", f"{size[0]}x{size[1]}", "--port", "0", "--json"]
    server = subprocess.Popen([sys.executable, "-m", "pica", *command], stdout=subprocess.PIPE, text=True)
    lines = iter(server.stdout.readline, "}\n")
    return server, json.loads("".join(lines) + "}")["address"]


def settled(page: Page, camera: pica.Camera, size: Size) -> np.ndarray:
    """The newest picture, small, once no more come."""
    page.look(camera, size)
    newest = page.wait(_picture)
    while True:
        try:
            newest = page.wait(_picture, seconds=QUIET)
        except TimeoutError:
            return newest[0]


def dragged(page: Page, scene: pica.Scene, camera: pica.Camera, size: Size) -> tuple[np.ndarray, Size]:
    """Seconds between the pictures that arrive while the camera orbits, 30 positions a second; the last one's size."""
    center, stopped = pivot(scene, camera), threading.Event()

    def drag() -> None:
        for step in range(10**6):
            if stopped.wait(1 / 30):
                return
            page.look(orbited(camera, center, 0.005 * (step + 1)), size)

    mover = threading.Thread(target=drag)
    mover.start()
    arrivals, end = [], time.perf_counter() + SECONDS
    while time.perf_counter() < end:
        _, last = page.wait(_picture)
        arrivals.append(time.perf_counter())
    stopped.set()
    mover.join()
    return np.diff(arrivals), last


def delays(page: Page, camera: pica.Camera, size: Size) -> np.ndarray:
    """Seconds from a camera that is turned to the first picture that shows it, in motion."""
    views = [camera, turned(camera, TURN)]
    looks = [settled(page, view, size) for view in views]
    found = []
    for jump in range(JUMPS):
        read_for(page, 0.03 + 0.002 * jump)
        began = time.perf_counter()
        page.look(views[jump % 2], size)
        page.wait(_shows(looks[jump % 2], looks[1 - jump % 2]))
        found.append(time.perf_counter() - began)
    return np.array(found)


def read_for(page: Page, seconds: float) -> None:
    """Take what arrives: what is not read would be waited for later."""
    end = time.perf_counter() + seconds
    while (left := end - time.perf_counter()) > 0:
        with suppress(TimeoutError):
            page.read(left)


def _picture(message: dict[str, Any]) -> tuple[np.ndarray, Size] | None:
    """The picture of a message, shrunk, and its size; None: it has none. Decodes an eighth of the size, so that this
    program keeps up as browsers do: pictures that wait to be read would be late."""
    if message["type"] != "BackgroundImageMessage" or message["rgb_data"] is None:
        return None
    picture = Image.open(io.BytesIO(message["rgb_data"]))
    size = picture.size
    picture.draft("RGB", (size[0] // 8, size[1] // 8))
    return np.asarray(picture.convert("RGB").resize((32, 18)), np.float32), size


def _shows(wanted: np.ndarray, other: np.ndarray) -> Callable[[dict[str, Any]], bool]:
    """Whether a message is a picture that is nearer to one than to another."""

    def shows(message: dict[str, Any]) -> bool:
        found = _picture(message)
        return found is not None and bool(np.abs(found[0] - wanted).mean() < np.abs(found[0] - other).mean())

    return shows


def _row(name: str, seconds: np.ndarray) -> None:
    median, many, most = np.percentile(1000 * seconds, (50, 90, 95))
    longest = 1000 * seconds.max()
    print(f"{name}: median {median:.0f} ms, 90% {many:.0f} ms, 95% {most:.0f} ms, longest {longest:.0f} ms")


def main() -> None:
    """Measure one scene."""
    parser = argparse.ArgumentParser()
    parser.add_argument("scene", help="a built-in one")
    parser.add_argument("preset", nargs="?", default="quality")
    parser.add_argument("--size", default="640x360")
    given = parser.parse_args()
    width, height = map(int, given.size.split("x"))
    size = width, height
    scene = getattr(pica.scenes, given.scene)()
    camera = scene.default_camera(width / height)
    began = time.perf_counter()
    server, address = served(given.scene, given.preset, size)
    try:
        page = Page(address)
        page.look(camera, size)
        page.picture(seconds=600.0)
        print(f"first picture: {time.perf_counter() - began:.1f} s after the command")
        page.picture(lambda pixels: pixels.shape[0] >= height, 600.0)
        dragged(page, scene, camera, size)  # finds the size of pictures in motion
        gaps, last = dragged(page, scene, camera, size)
        _row(f"between pictures while dragging, the last of {last[0]}x{last[1]}", gaps)
        _row("from a camera to its picture, in motion", delays(page, camera, size))
        page.close()
        server.send_signal(signal.SIGINT)
        server.wait(30)
    finally:
        server.kill()


if __name__ == "__main__":
    main()

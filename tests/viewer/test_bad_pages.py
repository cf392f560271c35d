"""Pages that send garbage, never read, vanish, or come in crowds stop nobody else; memory does not grow."""

import contextlib
import os
import socket
import time
from pathlib import Path

import numpy as np
import pytest

import pica
from tests.viewer.scenes import CAMERA, CANVAS, is_whole, redness

pytest.importorskip("viser", reason="the extra pica[view] is not installed")

from viser import _messages as messages

from tests.viewer.page import Page
from tests.viewer.serving import serving

pytestmark = pytest.mark.slow
ASIDE = pica.Camera.look_at((-1, 1.5, 4), (-1, 0.5, 0))
BEARABLE = 5.0
"""Seconds until a page that is used has its picture, whatever others do."""


@pytest.fixture(scope="module", params=["127.0.0.1", "0.0.0.0"])
def web(device, request):
    """For this machine, and for others with the token."""
    with serving(device, host=request.param) as served:
        yield served


def opened(web) -> Page:
    gate = web._gate
    if not gate.token:
        return Page(web.address)
    return Page(f"http://127.0.0.1:{gate.port}", f"pica-{gate.port}={gate.token}")


@pytest.fixture
def page(web):
    made = opened(web)
    made.look(CAMERA, CANVAS)
    made.picture(is_whole)
    yield made
    made.close()


def assert_works(page: Page, seconds: float = BEARABLE) -> None:
    """Its camera moves there and back, in time."""
    for camera, low, high in ((ASIDE, 55, 96), (CAMERA, 40, 55)):
        page.look(camera, CANVAS)
        page.picture(lambda pixels: is_whole(pixels) and low < redness(pixels).mean() < high, seconds)  # noqa: B023


def test_garbage_on_the_socket(web, page):
    random = np.random.default_rng(1)
    for length in (0, 1, 10, 1000, 1_000_000):
        bad = opened(web)
        with contextlib.suppress(Exception):
            bad.socket.send(random.bytes(length))
            bad.socket.send("text" * length)
        bad.close()
    for label in ("Node", "Shown", "Seconds", "Speed", "Split", "Exposure", "Beside it", "Preset", "Level", "Path"):
        for value in (None, "x", [], {}, -1e300, float("nan"), float("inf"), b"x", [1, 2], {"a": 1}):
            page.set(label, value)
    page.send(messages.GuiUpdateMessage("no such input", {"value": 1}))
    page.upload("Open .glb", "x" * 100_000, b"")
    assert page.text("must end in .glb")
    web.change(lambda: (web.viewer.configure(pica.Settings.preset("raster")), web.viewer.playback.seek(0.0)))
    fresh = opened(web)
    fresh.look(CAMERA, CANVAS)
    assert_works(fresh)
    fresh.close()


def test_fifty_pages_at_once(web, page):
    crowd = [opened(web) for _ in range(50)]
    for each in crowd:
        each.look(CAMERA, CANVAS)
    assert_works(page, 30.0)  # while all of them get the panel
    crowd[-1].picture(is_whole)
    vanish(crowd)
    assert_works(page)


def test_pages_that_never_read_or_vanish(web, page):
    silent = [opened(web) for _ in range(3)]
    for number in range(300):
        for each in silent:
            with contextlib.suppress(Exception):
                each.look(CAMERA if number % 2 else ASIDE, CANVAS)
        time.sleep(0.01)
    gone = [opened(web) for _ in range(5)]
    for each in gone:
        each.look(ASIDE, CANVAS)
    vanish(gone)
    assert_works(page)
    vanish(silent)


def test_memory_is_flat_over_thousands_of_frames(web, page):
    silent = opened(web)
    silent.look(CAMERA, CANVAS)
    sizes, frames = [], 0
    while frames < 2500:
        page.look(pica.Camera.look_at((0.001 * frames, 1.5, 4), (0, 0.5, 0)), CANVAS)
        page.picture()
        frames += 1
        if frames in (500, 2500):
            sizes.append(resident())
    vanish([silent])
    assert sizes[1] - sizes[0] < 32e6, "bytes in 2,000 frames"


def vanish(pages: list[Page]) -> None:
    """End their connections without a word."""
    for page in pages:
        with contextlib.suppress(OSError):  # those that answer no ping are dropped after a while
            page.socket.socket.shutdown(socket.SHUT_RDWR)


def resident() -> int:
    """Bytes of memory of this process."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE")

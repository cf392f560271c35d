"""A viewer that serves pages while a test runs."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pica
from pica.viewer.viewer import Viewer
from pica.viewer.web.server import WebViewer
from tests.viewer.scenes import CAMERA, CANVAS, scene


@contextmanager
def serving(device: Any, size: tuple[int, int] = CANVAS, **more: Any) -> Iterator[WebViewer]:
    """Of the tests' scene; `size` and `more`: arguments of WebViewer."""
    viewer = Viewer(scene(), settings=pica.Settings.preset("raster"), device=device, frames=2)
    web = WebViewer(viewer, size=size, port=0, camera=CAMERA, **more)
    thread = threading.Thread(target=web.run, daemon=True)
    thread.start()
    try:
        yield web
    finally:
        web.stop()
        thread.join(30)
        web.viewer.close()
    assert not thread.is_alive()

"""`pica.view`: a scene live inside a notebook, or in a browser beside a program."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from types import TracebackType
from typing import Self
from weakref import finalize

import slangpy as spy

from pica.rendering.arguments import check_made_with, checked_count, checked_size
from pica.rhi.device import Device
from pica.scene.camera import Camera
from pica.scene.model import Scene
from pica.settings import Settings
from pica.viewer.resolution import Size
from pica.viewer.viewer import Viewer
from pica.viewer.web.server import WebViewer, import_viser

_SECONDS = 30.0
"""To wait at most for the picture under way when a view is closed."""


class LiveView:
    """A page that shows a scene, by a thread of its own; `pica.view` makes it. A notebook shows the page in the cell.

    It ends with `close`, with a `with` statement, with the next view of the same scene, and with the process.
    """

    def __init__(self, web: WebViewer) -> None:
        self.address = web.address
        """Of the page, for browsers on this machine."""
        self._web = web
        self._thread = threading.Thread(target=web.run, name="pica.view", daemon=True)
        self._thread.start()
        self._close = finalize(self, _end, web, self._thread)

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Change the scene within this block: no picture is rendered meanwhile, and the next one has all of it."""
        with self._web.lock:
            yield

    def close(self) -> None:
        """End the page, and release the device memory. Does nothing the second time."""
        self._close()
        for scene in [scene for scene, shown in _OPEN.items() if shown is self]:
            del _OPEN[scene]

    @property
    def closed(self) -> bool:
        """Whether it has ended."""
        return not self._close.alive

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<pica.view of {self.address}{', closed' if self.closed else ''}>"

    def _repr_html_(self) -> str:
        if self.closed:
            return f"<p>{escape(repr(self))}</p>"
        height = self._web.size[1]
        return f'<iframe src="{escape(self.address)}" width="100%" height="{height}" style="border:0"></iframe>'


def view(
    scene: Scene,
    *,
    size: Size = (960, 540),
    camera: Camera | None = None,
    settings: Settings | None = None,
    device: Device | spy.Device | str | None = None,
    frames: int = 64,
) -> LiveView:
    """Show a scene live: in the cell of a notebook that this call ends, or in a browser at the view's `address`.

    `size`: (width, height) in pixels of pictures at most; their shape is the page's. `camera` None: the scene's own.
    `frames`: of a picture at rest. Change the scene within `view.paused()`.
    Raises PicaError if viser, the extra pica[view], is not installed; else as Renderer.
    """
    import_viser()
    check_made_with("view", scene, settings, device)
    size, frames = checked_size(size), checked_count("view: frames", frames)
    if (earlier := _OPEN.get(scene)) is not None:
        earlier.close()  # the cell runs again
    viewer = Viewer(scene, settings=settings, device=device, frames=frames)
    shown = _OPEN[scene] = LiveView(WebViewer(viewer, size=size, port=0, camera=camera))
    return shown


_OPEN: dict[Scene, LiveView] = {}
"""Views by scene: those that no variable holds stay, as a cell shows them."""


def _end(web: WebViewer, thread: threading.Thread) -> None:
    web.stop()
    thread.join(_SECONDS)
    web.viewer.close()

"""Shows a viewer in browsers: one renderer for all clients, each with a camera of its own."""

import contextlib
import logging
import queue
import socket
import threading
import time
import urllib.request
import warnings
from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import rich

from pica.errors import PicaError, shown
from pica.rhi.fair_lock import FairLock
from pica.scene.camera import Camera
from pica.scene.limits import Limits
from pica.settings import Settings
from pica.text import printable
from pica.viewer.camera_control import CameraControl
from pica.viewer.resolution import Size, fitted
from pica.viewer.uploads import ENVIRONMENTS, uploaded_environment, uploaded_scene
from pica.viewer.view import View
from pica.viewer.viewer import Picture, Viewer
from pica.viewer.waiting import progress_told
from pica.viewer.web.client_camera import ClientPose, show
from pica.viewer.web.downloads import File, send
from pica.viewer.web.dropping import DroppedFiles
from pica.viewer.web.gate import Gate, hidden_address
from pica.viewer.web.panel import Panel
from pica.viewer.web.sender import Sender

if TYPE_CHECKING:
    import viser

_QUALITY = {False: 75, True: 95}
"""JPEG quality of pictures in motion, and of those at rest."""
_TEXTS_EVERY = 0.5
"""Seconds between two updates of the panel's texts."""
_PAGE_SECONDS = 30.0
"""That viser's server on this machine may take for its page."""
_STEP = 1 / 60
"""Seconds to wait for what plays when there is nothing else to render."""
_POLL = 0.1
"""Seconds between two looks for what the program has changed in the scene."""


class _Client:
    """One browser page."""

    def __init__(self, handle: "viser.ClientHandle", view: View) -> None:
        self.handle, self.view = handle, view
        self.active_at = 0.0
        """When its user last did anything."""
        self.poses: deque[ClientPose] = deque(maxlen=1)
        """The newest that has come and is not yet in the view: put in by one thread, taken out by another."""
        self.failed = False
        """Whether its picture could not be rendered; until something changes."""


class WebViewer:
    """Serves a viewer until `stop`. `run` renders in the thread that calls it; all else is safe from any thread.

    Input of the client that was used last comes first: its picture is completed before those of the others.
    """

    def __init__(
        self,
        viewer: Viewer,
        *,
        size: Size,
        host: str = "127.0.0.1",
        port: int = 8080,
        camera: Camera | None = None,
        limits: Limits | None = None,
    ) -> None:
        """Listen on `host` and `port`, 0 for any free one; clients of other machines need the token of `address`.
        `size`: of pictures at most; their shape is the page's. `camera`: where clients begin. `limits`: of files that
        pages send.

        Raises PicaError if viser is not installed, or the address cannot be listened on."""
        viser = import_viser()
        _check_free(host, port)
        self.viewer, self.size, self._limits = viewer, size, limits
        self.lock = FairLock(lambda: None)
        """For `with`: nothing of the viewer or its scene changes, and no picture is rendered."""
        self._clients: dict[int, _Client] = {}
        self._due: queue.SimpleQueue[Callable[[], object]] = queue.SimpleQueue()
        self._wake, self._stopped = threading.Event(), threading.Event()
        self._told_at = float("-inf")
        self._sender = Sender()
        logging.getLogger("websockets.server").setLevel(logging.CRITICAL)  # faults of clients are no concern of users
        with _silent():
            inner = hidden_address()
            self._server = viser.ViserServer(host=inner, port=0, label="pica", verbose=False)
        _share_nothing(self._server)
        behind = inner, self._server.get_port()
        self._gate = Gate(host, port, behind, DroppedFiles(_page(*behind), self.open).answer)
        self.address = f"http://{_in_url(host)}:{self._gate.port}"
        """Of the page."""
        if self._gate.token:
            self.address += f"/?token={self._gate.token}"
        self._server.scene.set_up_direction("+y")
        self._server.gui.configure_theme(show_logo=False, show_share_button=False, control_width="large")
        self._begin(camera)
        self._server.on_client_connect(self._connect)
        self._server.on_client_disconnect(self._disconnect)
        self._server.scene.on_click()(self._clicked)

    def run(self) -> None:
        """Render and show pictures until `stop`. Errors of the user's making are shown on the page."""
        before = time.perf_counter()
        with progress_told(self._panel.say), warnings.catch_warnings(), contextlib.closing(self._sender):
            warnings.filterwarnings("ignore", "Queued a .* on a closed connection")  # a page that has just gone
            while not self._stopped.is_set():
                now = time.perf_counter()
                client = None
                with self.lock, self._errors_shown():
                    if self._stopped.is_set():
                        break
                    self._do_due()
                    self._play(now - before)
                    client = self._next()
                    if client is not None:
                        self._show(client)
                if client is None:
                    playing = self.viewer.playback.playing
                    self._wake.wait(_STEP if playing else _POLL)
                    self._wake.clear()
                    now = now if playing else time.perf_counter()  # no time has passed for what stood still
                before = now

    def stop(self) -> None:
        """End `run`, and the connections."""
        self._stopped.set()
        self._wake.set()
        with self.lock, _silent():  # after the picture under way
            self._gate.close()
            self._server.stop()

    def change(self, act: Callable[[], object]) -> None:
        """As Actions.change."""
        self._due.put(act)
        self._wake.set()

    def move(self, client: int, act: Callable[[CameraControl], object]) -> None:
        """As Actions.move."""

        def moved(found: _Client) -> None:
            act(found.view.control)
            found.poses.clear()
            show(found.view.control, found.handle.camera, "up_direction")

        self._for(client, moved)

    def save(self, client: int, made: Callable[[Viewer, View], File]) -> None:
        """As Actions.save."""
        self._for(client, lambda found: send(found.handle, made(self.viewer, found.view)))

    def choose_settings(self, change: Callable[[Settings], Settings]) -> None:
        """As Actions.choose_settings."""
        self.change(lambda: self.viewer.configure(change(self.viewer.settings)))

    def open(self, name: str, content: bytes) -> None:
        """Show the scene of a file, or light this one by an environment."""
        is_environment = Path(name).suffix.lower() in ENVIRONMENTS
        (self.open_environment if is_environment else self.open_scene)(name, content)

    def open_scene(self, name: str, content: bytes) -> None:
        """As Actions.open_scene; settings stay as they are."""

        def opened() -> None:
            with self._loading(name):
                scene = uploaded_scene(name, content, self._limits)
            self.viewer = self.viewer.replaced(scene)
            self._server.gui.reset()
            self._begin(None)
            for client in self._clients.values():
                client.failed = False
                client.poses.clear()
                client.view = self.viewer.view(client.view.resolution.full)
                show(client.view.control, client.handle.camera, "up_direction")

        self.change(opened)

    def open_environment(self, name: str, content: bytes) -> None:
        """As Actions.open_environment."""

        def opened() -> None:
            with self._loading(name):
                environment = uploaded_environment(name, content, self._limits)
            self.viewer.edits.apply([(self.viewer.scene, "environment", environment)])

        self.change(opened)

    @contextlib.contextmanager
    def _loading(self, name: str) -> Iterator[None]:
        self._panel.say(f"Loading {printable(name)}")
        try:
            yield
        except PicaError:
            self._panel.say("Not loaded")
            raise

    def _begin(self, camera: Camera | None) -> None:
        """Show the viewer, from where clients begin."""
        self._first = CameraControl(self.viewer.scene, self.size[0] / self.size[1], camera)
        self.viewer.interrupted = self._has_input
        show(self._first, self._server.initial_camera, "up")
        self._panel = Panel(self._server.gui, self.viewer, self)

    def _for(self, client: int, act: Callable[[_Client], object]) -> None:
        """Between two pictures, do something for a client, unless it is gone by then."""

        def do() -> None:
            found = self._clients.get(client)
            if found is not None:
                found.active_at = time.perf_counter()
                act(found)

        self.change(do)

    def _has_input(self) -> bool:
        """Whether a client waits for something."""
        moved = any(client.poses for client in list(self._clients.values()))
        return moved or self._stopped.is_set() or not self._due.empty()

    def _do_due(self) -> None:
        """Move cameras to where clients have moved theirs, and do what was asked for."""
        for client in self._clients.values():
            if client.poses:
                pose = client.poses.pop()
                pose.place(client.view.control)
                client.view.resize(fitted(pose.canvas, self.size))
                client.failed = False
        if not self._panel.follow_shaders() and self._due.empty():
            return
        for client in self._clients.values():
            client.failed = False
        try:
            while not self._due.empty():
                self._due.get()()
        except PicaError:
            self._panel.refresh(again=True)
            raise
        self._panel.refresh()

    def _play(self, seconds: float) -> None:
        playback = self.viewer.playback
        was_playing = playback.playing
        playback.advance(seconds)
        if was_playing and not playback.playing:
            self._panel.refresh()

    def _next(self) -> _Client | None:
        """The client whose picture is due; None: all are complete."""
        by_use = sorted(self._clients.values(), key=lambda client: -client.active_at)
        return next(
            (client for client in by_use if not client.failed and not self.viewer.is_complete(client.view)), None
        )

    def _show(self, client: _Client) -> None:
        """Render a client's next picture, and send it."""
        is_first = self.viewer.is_new
        try:
            picture = self.viewer.render(client.view)
        except PicaError:
            client.failed = True  # until something changes
            raise
        rests = picture.is_full and (picture.frames > 1 or self.viewer.is_complete(client.view))
        self._sender.send(client.handle, picture.pixels, _QUALITY[rests])
        if is_first:
            self._panel.refresh()  # now it is known what can be shown
        self._tell_costs(client, picture)

    def _tell_costs(self, client: _Client, picture: Picture) -> None:
        now = time.perf_counter()
        if now - self._told_at < _TEXTS_EVERY and not self.viewer.is_complete(client.view):
            return
        self._told_at = now
        self._panel.show_costs(picture)
        self._panel.show_camera(client.view.control)
        if self.viewer.playback.playing:
            self._panel.show_time()

    @contextlib.contextmanager
    def _errors_shown(self) -> Iterator[None]:
        try:
            yield
        except PicaError as error:
            for client in self._clients.values():
                client.handle.add_notification("pica", str(error), color="red", auto_close_seconds=10.0)

    # What viser calls, in threads of its own.

    def _connect(self, handle: "viser.ClientHandle") -> None:
        def connect() -> None:
            pose = ClientPose.of(handle.camera)
            size = self.size if pose is None else fitted(pose.canvas, self.size)
            client = _Client(handle, self.viewer.view(size, self._first.camera))
            client.active_at = time.perf_counter()
            if pose is not None:
                client.poses.append(pose)
            self._clients[handle.client_id] = client

        async def moved(camera: "viser.CameraHandle") -> None:  # in the order of the messages
            client = self._clients.get(handle.client_id)
            if client is not None:
                client.active_at, pose = time.perf_counter(), ClientPose.of(camera)
                if pose is not None:
                    client.poses.append(pose)
                self._wake.set()

        self.change(connect)
        handle.camera.on_update(moved)

    def _disconnect(self, handle: "viser.ClientHandle") -> None:
        self.change(lambda: self._clients.pop(handle.client_id, None))

    def _clicked(self, event: "viser.SceneClickEvent") -> None:
        x, y = event.screen_pos
        through_glass = bool(self._panel.through_glass.value)
        if 0 <= x <= 1 and 0 <= y <= 1:
            self._for(event.client_id, lambda client: self.viewer.pick(client.view, x, y, through_glass=through_glass))


def import_viser() -> Any:
    """The library. Raises PicaError, with the extra that installs it, if it is missing."""
    try:
        import viser
    except ImportError as error:
        raise PicaError(f"the viewer in the browser needs viser ({error}): pip install pica[view]") from None
    return viser


def _check_free(host: str, port: int) -> None:
    """Raises PicaError unless a server can listen there: viser would take another port, or wait for ever."""
    try:
        if not 0 <= port <= 65535:
            raise OSError(None, "a port is 0 to 65535")
        family, kind, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(address)
    except OSError as error:
        why = error.strerror or str(error)
        raise PicaError(f"cannot listen on {shown(host)}, port {port} ({why}); port 0 takes any free one") from None


def _page(host: str, port: int) -> bytes:
    """The page of viser's server."""
    with urllib.request.urlopen(f"http://{host}:{port}/", timeout=_PAGE_SECONDS) as answer:
        content: bytes = answer.read()
        return content


@contextlib.contextmanager
def _silent() -> Iterator[None]:
    """Without what viser prints by rich, such as its address behind the gate: in notebooks standard output is not where
    that goes."""
    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before


def _share_nothing(server: "viser.ViserServer") -> None:
    """Clients may not ask viser for a tunnel from the internet. It has no public setting for that."""
    from viser import _messages

    for message in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        server._connection.unregister_handler(message)


def _in_url(host: str) -> str:
    """An address as others write it: this machine's name instead of all of its addresses."""
    if host in ("0.0.0.0", "::"):
        return socket.gethostname()
    return f"[{host}]" if ":" in host else host

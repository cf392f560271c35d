"""Shows a viewer in a window: pictures in its whole area, and the panel above them."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import slangpy as spy
from slangpy import ui

from pica.errors import PicaError
from pica.images.pictures import write_png
from pica.images.saving import write_whole
from pica.scene.camera import Camera
from pica.scene.limits import Budget, Limits
from pica.scene.loading import read_environment
from pica.scene.model import Scene
from pica.settings import Settings
from pica.viewer.camera_control import CameraControl
from pica.viewer.resolution import Size, fitted
from pica.viewer.uploads import ENVIRONMENTS
from pica.viewer.viewer import Viewer
from pica.viewer.waiting import progress_told
from pica.viewer.window.camera_input import CameraInput
from pica.viewer.window.panel import Panel
from pica.viewer.window.presenter import Presenter, open_window

_PANEL = (480, 640)
"""(width, height) of the panel in pixels, at first."""
_MARGIN = 10
_LIVELY = 0.5
"""Seconds after an input in which the panel is drawn again, as it answers with animations."""
_IDLE = 0.01
"""Seconds to sleep when there is nothing to render or draw."""
_STRIDE = 0.1
"""Seconds of flight for a picture at most: slow ones are no leaps."""
_TEXTS_EVERY = 0.5
"""Seconds between two updates of the panel's texts."""


class WindowViewer:
    """The window; `run` shows it until it is closed. All calls are of one thread: the main one, as systems demand."""

    def __init__(
        self,
        viewer: Viewer,
        *,
        size: Size,
        camera: Camera | None = None,
        load: Callable[[str], Scene],
        limits: Limits | None = None,
    ) -> None:
        """`size`: of the window, in pixels, and of pictures at most. `camera`: where it begins. `load`: reads another
        scene by its name. `limits`: of environments that the user opens.

        Raises PicaError without a display, DeviceError if the device can present to no window."""
        self.viewer, self._most = viewer, size
        self._load, self._limits = load, limits
        self._window = open_window(size)
        self._presenter = Presenter(viewer.device, self._window)
        self._input = CameraInput()
        self._due: list[Callable[[], object]] = []
        self._failed = False
        """Whether the picture could not be rendered; until something changes."""
        self._content: Any = None
        """Of the newest picture."""
        self._lively_until = self._told_at = float("-inf")
        height = min(_PANEL[1], max(size[1] - 2 * _MARGIN, 1))
        self._frame = ui.Window(
            self._presenter.screen, "pica", spy.float2(_MARGIN, _MARGIN), spy.float2(_PANEL[0], height)
        )
        self._begin(camera)
        self._window.on_mouse_event = self._on_mouse
        self._window.on_keyboard_event = self._on_key
        self._window.on_drop_files = lambda names: self.open(names[0]) if names else None

    def run(self) -> None:
        """Render and show pictures until the window is closed. Errors of the user's making are shown in the panel."""
        before = time.perf_counter()
        with progress_told(self._say_waiting):
            while not self._window.should_close():
                now = time.perf_counter()
                self.step(now - before)
                before = now

    def step(self, seconds: float) -> None:
        """One turn of `run`, this long after the one before: input, a picture if one is due, and what is drawn."""
        try:
            self._window.process_events()
            self._do_due()
            self._input.fly(min(seconds, _STRIDE), self.view.control)
            self._play(seconds)
            rendered = self._render()
        except PicaError as error:
            rendered = False
            self._tell(str(error))
        now = time.perf_counter()
        if rendered or now < self._lively_until:
            self._presenter.present(self._content)
        else:
            time.sleep(_IDLE)

    @property
    def message(self) -> str:
        """What the panel tells, such as an error; "" for nothing."""
        return self._panel.message

    @property
    def panel(self) -> ui.Window:
        """The panel's widgets."""
        return self._frame

    def close(self) -> None:
        """Release the window and the device memory of the viewer."""
        self._frame.remove_all_children()
        self._presenter.close()
        self._window.on_mouse_event = self._window.on_keyboard_event = self._window.on_drop_files = None
        self._window.close()
        self.viewer.close()

    def change(self, act: Callable[[], object]) -> None:
        """As Actions.change."""
        self._due.append(act)

    def move(self, act: Callable[[CameraControl], object]) -> None:
        """As Actions.move."""
        self.change(lambda: act(self.view.control))

    def save(self) -> None:
        """As Actions.save, in the current folder."""
        self.change(
            lambda: self._write(
                f"{self.viewer.shown}.png", lambda path: write_png(path, self.viewer.render_full(self.view).pixels)
            )
        )

    def save_frame(self) -> None:
        """As Actions.save_frame, in the current folder."""
        self.change(lambda: self._write("frame.exr", lambda path: self.viewer.frame(self.view).save(path)))

    def save_path(self) -> None:
        """As Actions.save_path, in the current folder."""
        self.change(lambda: self._write("cameras.json", self._write_path))

    def choose_settings(self, change: Callable[[Settings], Settings]) -> None:
        """As Actions.choose_settings."""
        self.change(lambda: self.viewer.configure(change(self.viewer.settings)))

    def open(self, name: str) -> None:
        """As Actions.open: settings stay as they are."""

        def opened() -> None:
            self._panel.say(f"Loading {name}")
            self._presenter.present(self._content)
            if Path(name).suffix.lower() in ENVIRONMENTS:
                environment = read_environment(Path(name), Budget(self._limits))
                self.viewer.edits.apply([(self.viewer.scene, "environment", environment)])
                return
            self.viewer = self.viewer.replaced(self._load(name))
            self._frame.remove_all_children()
            self._begin(None)

        self.change(opened)

    def _begin(self, camera: Camera | None) -> None:
        """Show the viewer, from where it begins."""
        self.view = self.viewer.view(fitted(self._size, self._most), camera)
        self.viewer.interrupted = self._has_input
        self._panel = Panel(self._frame, self.viewer, self)

    @property
    def _size(self) -> Size:
        """Of the window; of one without an area, a pixel."""
        return max(self._window.width, 1), max(self._window.height, 1)

    def _do_due(self) -> None:
        """Do what was asked for since the last turn."""
        size = fitted(self._size, self._most)
        if size != self.view.resolution.full:
            self.view.resize(size)
            self._failed = False
        if not self._panel.follow_shaders() and not self._due:
            return
        due, self._due = self._due, []
        self._failed = False
        self._tell("")
        try:
            for act in due:
                act()
        finally:
            self._panel.refresh()

    def _play(self, seconds: float) -> None:
        playback = self.viewer.playback
        if playback.playing:
            playback.advance(seconds)
            self._failed = False
            self._panel.show_time()

    def _render(self) -> bool:
        """Render the next picture if one is due; whether there is one."""
        if self._failed or self.viewer.is_complete(self.view):
            return False
        is_first = self.viewer.is_new
        try:
            picture = self.viewer.render(self.view, on_device=True)
        except PicaError:
            self._failed = True
            raise
        self._content = picture.content
        if is_first:
            self._panel.refresh()  # now it is known what can be shown
        now = time.perf_counter()
        if now - self._told_at >= _TEXTS_EVERY or self.viewer.is_complete(self.view):
            self._told_at = now
            self._panel.show_costs(picture)
            self._panel.show_camera(self.view.control)
        return True

    def _write(self, name: str, write: Callable[[Path], object]) -> None:
        path = _free(Path(name))
        write(path)
        self._tell(f"Saved {path}")

    def _write_path(self, path: Path) -> None:
        write_whole(path, lambda whole: whole.write_bytes(self.viewer.path.file()))

    def _tell(self, message: str) -> None:
        self._panel.tell(message)
        self._live()

    def _live(self) -> None:
        self._lively_until = time.perf_counter() + _LIVELY

    def _say_waiting(self, text: str) -> None:
        self._panel.say(text)
        self._window.process_events()
        self._presenter.present(None)

    def _has_input(self) -> bool:
        """Whether the user waits for something."""
        self._window.process_events()
        return bool(self._due) or self._input.is_active or self._window.should_close()

    # What the window calls, within `process_events`.

    def _on_mouse(self, event: spy.MouseEvent) -> None:
        self._live()
        if event.is_button_down() or event.is_scroll():
            self._presenter.present(self._content)  # ImGui knows what is below the mouse once it has drawn
        if self._presenter.takes_mouse(event) and not self._input.is_active:
            return
        clicked = self._input.mouse(event, self._size, self.view.control)
        if clicked is not None:
            x, y = clicked
            through_glass = self._panel.through_glass
            self.change(lambda: self.viewer.pick(self.view, x, y, through_glass=through_glass))

    def _on_key(self, event: spy.KeyboardEvent) -> None:
        self._live()
        if event.is_key_release():
            self._input.release(event.key)
        if event.key == spy.KeyCode.f1 and event.is_key_press():
            self._frame.visible = not self._frame.visible
        elif not self._presenter.takes_key(event) and event.is_key_press():
            self._input.press(event.key)


def _free(path: Path) -> Path:
    """The path, or with a number if there is a file already."""
    number, free = 2, path
    while free.exists():
        number, free = number + 1, path.with_stem(f"{path.stem}-{number}")
    return free

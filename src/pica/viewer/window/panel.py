"""The panel of the window, in three parts: the view with cameras, time and costs; the scene; settings."""

from collections.abc import Callable
from functools import partial
from typing import Any, Protocol

from slangpy import ui

from pica.errors import PicaError
from pica.settings import Settings
from pica.viewer.camera_control import CameraControl
from pica.viewer.camera_moves import NARROWEST, WIDEST, CameraNumbers, camera_moves, camera_numbers
from pica.viewer.camera_path import SECONDS
from pica.viewer.comparison import PATH_TRACED
from pica.viewer.costs import Costs
from pica.viewer.playback import FASTEST
from pica.viewer.setting_controls import presets
from pica.viewer.texts import camera_names, memory, picked_rows, ray_lines, span, status
from pica.viewer.viewer import DISPLAY, Picture, Viewer
from pica.viewer.window.fields import Field, checkbox, combo, explain, number, slider, vector, wrapped
from pica.viewer.window.scene_section import SceneActions, SceneSection
from pica.viewer.window.settings_section import SettingsSection

_ALL = "(all together)"
_NONE = "(none)"
_BAR = 16
"""Letters of the longest bar."""
_PARTS = ("View", "Scene", "Settings")


class Actions(SceneActions, Protocol):
    """What the panel asks the window for, as SceneActions."""

    def move(self, act: Callable[[CameraControl], object]) -> None:
        """Do something to the camera."""

    def save(self) -> None:
        """Write the picture to a file."""

    def save_frame(self) -> None:
        """Write radiance and all AOVs to a file."""

    def save_path(self) -> None:
        """Write the recorded path to a file."""

    def choose_settings(self, change: Callable[[Settings], Settings]) -> None:
        """Render with other settings."""


class Panel:
    """All widgets, below a line that says what goes on."""

    def __init__(self, parent: ui.Widget, viewer: Viewer, actions: Actions) -> None:
        self._viewer, self._actions = viewer, actions
        self._status = ui.Text(parent, "Starting")
        self._message = ui.Text(parent)
        self._part = combo(parent, "Panel", _PARTS, self._open)
        self._places = {part: ui.Group(parent, part) for part in _PARTS}
        self._playing: Field | None = None
        self._time: Field | None = None
        self._history = Costs()
        self._numbers: list[tuple[CameraNumbers, Field]] = []
        self._add_view(self._places["View"])
        self._scene = SceneSection(self._places["Scene"], viewer, actions)
        self._settings = SettingsSection(self._places["Settings"], actions.choose_settings)
        self._open(_PARTS[0])
        self.tell("")
        self.refresh()

    def say(self, text: str) -> None:
        """Show a line on top."""
        self._status.text = text

    def tell(self, message: str) -> None:
        """Show what has happened, such as an error, until something else is told; "" for nothing."""
        self._message.text = wrapped(message)
        self._message.visible = bool(message)

    @property
    def message(self) -> str:
        """What was told last."""
        return self._message.text

    def follow_shaders(self) -> bool:
        """As Viewer.follow_shaders."""
        try:
            return self._viewer.follow_shaders()
        except PicaError:
            self.say("Shaders as before")
            raise

    def refresh(self) -> None:
        """Show the viewer as it is."""
        viewer = self._viewer
        self._shown.offer(viewer.showable)
        self._shown.show(viewer.shown)
        self._compared.show(viewer.compared_with or _NONE)
        self._split.show(viewer.split)
        self._recorded.text = f"Cameras: {len(viewer.path)}"
        picked = [] if viewer.picked is None else picked_rows(viewer.picked)
        self._picked.text = "\n".join(f"{name}: {value}" for name, value in picked) or "Click a surface."
        self._pixel.text = "\n".join(f"{name}: {value}" for name, value in viewer.pixel)
        self._scene.refresh()
        self._settings.refresh(viewer.settings)
        self.show_time()

    def show_time(self) -> None:
        """Show where the animation is."""
        playback = self._viewer.playback
        if self._time is not None and self._playing is not None:
            self._playing.show(playback.playing)
            self._time.show(min(max(playback.time, 0.0), playback.longest))

    def show_costs(self, picture: Picture) -> None:
        """Show the size and the costs of a picture."""
        self.say(status(picture))
        self._history.note(self._viewer.milliseconds)
        rows = self._history.rows
        longest = rows[0][1] if rows else 1.0
        bars = [f"{time:6.2f} ms {'#' * round(_BAR * time / longest):{_BAR}} {name}" for name, time in rows]
        rays = ray_lines(self._viewer.rays)
        lines = ["Rays of a frame at rest:", *rays] if rays else []
        self._costs.text = "\n".join([*bars, span(self._history), memory(self._viewer.device), *lines])

    def show_camera(self, control: CameraControl) -> None:
        """Show the camera's numbers."""
        for numbers, field in self._numbers:
            field.show(numbers.get(control))

    @property
    def through_glass(self) -> bool:
        """Whether clicks find what lies behind glass."""
        return bool(self._through_glass.value)

    def _open(self, part: str) -> None:
        self._part.show(part)
        for each, place in self._places.items():
            place.visible = each == part

    def _add_view(self, parent: ui.Widget) -> None:
        viewer = self._viewer
        self._shown = combo(parent, "Shown", (DISPLAY,), self._changing(viewer.show))
        self._add_camera(ui.Group(parent, "Camera"))
        if viewer.scene.animations:
            self._add_time(ui.Group(parent, "Animation"))
        comparison = ui.Group(parent, "Comparison")
        names = (_NONE, PATH_TRACED, *presets())
        compare = self._changing(lambda name: viewer.compare(None if name == _NONE else name))
        self._compared = combo(comparison, "Beside it", names, compare)
        self._split = slider(comparison, "Split", 0.0, 1.0, self._changing(partial(setattr, viewer, "split")))
        picked = ui.Group(parent, "Picked")
        self._through_glass = ui.CheckBox(picked, "Through glass")
        self._picked = ui.Text(picked)
        self._pixel = ui.Text(ui.Group(parent, "Pixel"))
        self._costs = ui.Text(ui.Group(parent, "Time of the device"))

    def _add_camera(self, parent: ui.Widget) -> None:
        actions, cameras = self._actions, self._viewer.scene.cameras()
        if cameras:
            names = camera_names(cameras)
            self._cameras = combo(parent, "Of the scene", names, lambda name: self._take(names.index(name)))
        for label, act in camera_moves(self._viewer).items():
            ui.Button(parent, label, partial(actions.move, act))
        for numbers in camera_numbers():
            self._numbers.append((numbers, self._entry(parent, numbers)))
        ui.Button(parent, "Save picture", actions.save)
        ui.Button(parent, "Save .exr", actions.save_frame)
        path = ui.Group(parent, "Path")
        ui.Button(path, "Add", lambda: actions.move(self._viewer.path.add))
        ui.Button(path, "Save", actions.save_path)
        ui.Button(path, "Clear", lambda: actions.change(self._viewer.path.clear))
        self._recorded = ui.Text(path)
        explain(path, f"For pica render --camera-path; {SECONDS:g} s between two cameras.")

    def _entry(self, parent: ui.Widget, numbers: CameraNumbers) -> Field:
        def changed(value: Any) -> None:
            self._actions.move(lambda control: numbers.set(control, value))

        if numbers.label == "Field of view":
            return number(parent, numbers.label, NARROWEST, WIDEST, changed)
        return vector(parent, numbers.label, changed)

    def _add_time(self, parent: ui.Widget) -> None:
        playback = self._viewer.playback
        self._playing = checkbox(parent, "Play", self._changing(partial(setattr, playback, "playing")))
        self._time = slider(parent, "Seconds", 0.0, playback.longest, self._changing(playback.seek))
        speed = slider(parent, "Speed", -FASTEST, FASTEST, self._changing(partial(setattr, playback, "speed")))
        speed.show(playback.speed)
        checkbox(parent, "Loop", self._changing(partial(setattr, playback, "loop"))).show(playback.loop)
        choose = self._changing(lambda name: playback.choose(None if name == _ALL else playback.names.index(name)))
        combo(parent, "Which", (_ALL, *playback.names), choose).show(_ALL)

    def _changing(self, change: Callable[[Any], object]) -> Callable[[Any], object]:
        """Calls `change` between two pictures, with each value that the user sets."""
        return lambda value: self._actions.change(lambda: change(value))

    def _take(self, number: int) -> None:
        self._actions.move(lambda control: control.take(self._viewer.scene.cameras()[number]))

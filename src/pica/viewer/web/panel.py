"""The panel of the page, in tabs: the view with cameras, time, what was picked and costs; the scene; settings."""

from collections.abc import Callable, Iterable
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

from pica.errors import PicaError
from pica.renderer import Picked
from pica.settings import Settings
from pica.viewer.camera_control import CameraControl
from pica.viewer.camera_moves import NARROWEST, WIDEST, CameraNumbers, camera_moves, camera_numbers
from pica.viewer.camera_path import SECONDS
from pica.viewer.comparison import PATH_TRACED
from pica.viewer.costs import Costs
from pica.viewer.playback import FASTEST
from pica.viewer.setting_controls import presets
from pica.viewer.texts import camera_names, memory, picked_rows, ray_lines, status
from pica.viewer.view import View
from pica.viewer.viewer import DISPLAY, Picture, Viewer
from pica.viewer.web.cost_chart import cost_chart
from pica.viewer.web.downloads import File, frame_file, path_file, picture_file
from pica.viewer.web.inputs import ClientInput, Input
from pica.viewer.web.scene_panel import SceneActions, ScenePanel
from pica.viewer.web.settings_panel import SettingsPanel

if TYPE_CHECKING:
    import viser

_ALL = "(all together)"
_NONE = "(none)"


class Actions(SceneActions, Protocol):
    """What the panel asks the server for, as of SceneActions."""

    def move(self, client: int, act: Callable[[Any], object]) -> None:
        """Do something to the camera control of a client."""

    def save(self, client: int, made: Callable[[Viewer, View], File]) -> None:
        """Send a client a file of what it sees."""

    def choose_settings(self, change: Callable[[Settings], Settings]) -> None:
        """Render with other settings."""


class Panel:
    """All inputs, and the texts below them."""

    def __init__(self, gui: "viser.GuiApi", viewer: Viewer, actions: Actions) -> None:
        self._gui, self._viewer, self._actions = gui, viewer, actions
        self._status = gui.add_markdown("Starting")
        tabs = gui.add_tab_group()
        self._playing: Input | None = None
        self._time: Input | None = None
        self._costs = Costs()
        self._numbers: list[tuple[CameraNumbers, ClientInput]] = []
        with tabs.add_tab("View"):
            self._add_view()
        with tabs.add_tab("Scene"):
            self._scene = ScenePanel(gui, viewer, actions)
        with tabs.add_tab("Settings"):
            self._settings = SettingsPanel(gui, viewer.settings, actions.choose_settings)

    def say(self, text: str) -> None:
        """Show a line on top."""
        self._status.content = text

    def follow_shaders(self) -> bool:
        """As Viewer.follow_shaders; a fault is shown on top until the next picture."""
        try:
            return self._viewer.follow_shaders()
        except PicaError as error:
            self.say(_plain(str(error)))
            raise

    def refresh(self, again: bool = False) -> None:
        """Show the viewer as it is; `again` as Input.show."""
        viewer = self._viewer
        if tuple(viewer.showable) != self._shown.handle.options:
            self._shown.handle.options = tuple(viewer.showable)
        self._shown.show(viewer.shown, again)
        self._compared.show(viewer.compared_with or _NONE, again)
        self._settings.refresh(viewer.settings, again)
        self._recorded.content = f"Cameras: {len(viewer.path)}" if len(viewer.path) else ""
        self._scene.refresh(again)
        self._picked.content = described(viewer.picked)
        if viewer.pixel:
            self._pixel.content = _table(viewer.pixel)
        if self._playing is not None:
            self._playing.show(viewer.playback.playing, again)
        self.show_time()

    def show_time(self) -> None:
        """Move the slider to where the animation is."""
        if self._time is not None:
            self._time.show(min(max(self._viewer.playback.time, 0.0), self._time.handle.max))

    def show_costs(self, picture: Picture) -> None:
        """Show the size and the costs of a picture."""
        self.say(status(picture))
        self._costs.note(self._viewer.milliseconds)
        self._times.content = cost_chart(self._costs)
        rays = ray_lines(self._viewer.rays)
        lines = ["Rays of a frame at rest:", *rays] if rays else []
        self._memory.content = "  \n".join([memory(self._viewer.device), *lines])

    def show_camera(self, control: CameraControl) -> None:
        """Show the numbers of the camera that was used last."""
        for numbers, shown in self._numbers:
            shown.show(numbers.get(control))

    def _add_view(self) -> None:
        gui, viewer = self._gui, self._viewer
        shown = gui.add_dropdown("Shown", (DISPLAY,), initial_value=DISPLAY, hint="The picture, or an AOV")
        self._shown = self._listening(shown, viewer.show)
        self._add_camera()
        if viewer.scene.animations:
            self._add_time()
        with gui.add_folder("Comparison", expand_by_default=False):
            self._add_comparison()
        with gui.add_folder("Picked"):
            self.through_glass = gui.add_checkbox(
                "Through glass", False, hint="Whether clicks find what lies behind transmissive and blended surfaces"
            )
            self._picked = gui.add_markdown("")
        with gui.add_folder("Pixel", expand_by_default=False):
            self._pixel = gui.add_markdown("Click a pixel.")
        with gui.add_folder("Time of the device", expand_by_default=False):
            self._times = gui.add_html("")
            self._memory = gui.add_markdown("")

    def _add_comparison(self) -> None:
        gui, viewer = self._gui, self._viewer
        hint = "The path tracer shows whole pictures, with ever more samples; presets show all pictures."
        other = gui.add_dropdown("Beside it", (_NONE, PATH_TRACED, *presets()), initial_value=_NONE, hint=hint)
        self._compared = self._listening(other, lambda name: viewer.compare(None if name == _NONE else name))
        split = gui.add_slider("Split", 0.0, 1.0, 0.005, viewer.split, hint="Where the other picture begins")
        self._listening(split, lambda value: setattr(viewer, "split", value))

    def _add_camera(self) -> None:
        gui = self._gui
        cameras = self._viewer.scene.cameras()
        with gui.add_folder("Camera"):
            if cameras:
                names = camera_names(cameras)
                chosen = gui.add_dropdown("Of the scene", names)
                chosen.on_update(lambda event: self._take_camera(event, names.index(event.target.value)))
            for label, act in camera_moves(self._viewer).items():
                gui.add_button(label).on_click(partial(self._move, act=act))
            for numbers in camera_numbers():
                self._numbers.append((numbers, self._entry(numbers)))
            gui.add_button("Save picture").on_click(partial(self._save, made=picture_file))
            with_aovs = gui.add_button("Save .exr", hint="Radiance, and all AOVs as named channels")
            with_aovs.on_click(partial(self._save, made=frame_file))
            hint = f"For pica render --camera-path: 'Add' after each move, 'Save' at the end; {SECONDS:g} s between two"
            path = gui.add_button_group("Path", ("Add", "Save", "Clear"), hint=hint)
            path.on_click(self._record)
            self._recorded = gui.add_markdown("")

    def _add_time(self) -> None:
        gui, playback = self._gui, self._viewer.playback
        length = playback.longest
        with gui.add_folder("Animation"):
            playing = gui.add_checkbox("Play", playback.playing)
            seconds = gui.add_slider("Seconds", 0.0, length, length / 1000, min(max(playback.time, 0.0), length))
            speed = gui.add_slider("Speed", -FASTEST, FASTEST, 0.1, playback.speed)
            loop = gui.add_checkbox("Loop", playback.loop)
            which = gui.add_dropdown("Which", (_ALL, *playback.names))
        self._playing = self._listening(playing, lambda value: setattr(playback, "playing", value))
        self._time = self._listening(seconds, playback.seek)
        self._listening(speed, lambda value: setattr(playback, "speed", value))
        self._listening(loop, lambda value: setattr(playback, "loop", value))
        self._listening(which, lambda name: playback.choose(None if name == _ALL else playback.names.index(name)))

    def _listening(self, handle: Any, change: Callable[[Any], object]) -> Input:
        """Call `change` between two pictures, with each value that a client sets."""
        return Input(handle, lambda value: self._actions.change(lambda: change(value)))

    def _take_camera(self, event: "viser.GuiEvent[Any]", number: int) -> None:
        self._move(event, lambda control: control.take(self._viewer.scene.cameras()[number]))

    def _entry(self, numbers: CameraNumbers) -> ClientInput:
        value = numbers.get(CameraControl(self._viewer.scene, 1.0))
        if isinstance(value, tuple):
            handle: Any = self._gui.add_vector3(numbers.label, value, step=0.01, hint=numbers.text)
        else:
            handle = self._gui.add_number(numbers.label, value, min=NARROWEST, max=WIDEST, step=0.1, hint=numbers.text)
        return ClientInput(
            handle, lambda client, typed: self._actions.move(client, lambda control: numbers.set(control, typed))
        )

    def _save(self, event: "viser.GuiEvent[Any]", made: Callable[[Viewer, View], File]) -> None:
        if event.client is not None:
            self._actions.save(event.client.client_id, made)

    async def _record(self, event: "viser.GuiEvent[Any]") -> None:
        path = self._viewer.path
        if event.target.value == "Add":
            self._move(event, path.add)
        elif event.target.value == "Clear":
            self._actions.change(path.clear)
        else:
            self._save(event, path_file)

    def _move(self, event: "viser.GuiEvent[Any]", act: Callable[[Any], object]) -> None:
        if event.client is not None:
            self._actions.move(event.client.client_id, act)


def described(picked: Picked | None) -> str:
    """What was picked, as Markdown; names are shown as they are."""
    if picked is None:
        return "Click a surface."
    return _table(picked_rows(picked))


def _table(rows: Iterable[tuple[str, str]]) -> str:
    return "\n".join(["| | |", "|---|---|", *(f"| {name} | {_plain(value)} |" for name, value in rows)])


def _plain(text: str) -> str:
    """Text of a file without any meaning in Markdown."""
    return "".join(letter if letter.isalnum() or letter in " ,./-()" else f"&#{ord(letter)};" for letter in text)

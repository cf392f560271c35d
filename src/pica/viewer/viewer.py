"""The viewer: one scene and one renderer, looked at by any number of views."""

import time
from dataclasses import dataclass, field

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.errors import PicaError, SceneError, shown
from pica.frame.aovs import at_size
from pica.images.output import preview
from pica.light_map.light_map import LightMap
from pica.renderer import Picked, Renderer
from pica.rhi.device import Device, open_device
from pica.scene.camera import Camera
from pica.scene.extents import whole_box
from pica.scene.material import Material
from pica.scene.model import Scene
from pica.scene.node import Node
from pica.settings import Settings
from pica.settings.setting import Value
from pica.viewer.camera_control import CameraControl
from pica.viewer.edits import Edits
from pica.viewer.outline import outlined
from pica.viewer.playback import Playback
from pica.viewer.resolution import Resolution, Size
from pica.viewer.visibility import Visibility

DISPLAY = "display"
"""What is shown unless told: the picture."""
_REST = 0.3
"""Seconds without any change after which nothing moves."""


@dataclass(frozen=True, eq=False)
class Picture:
    """A picture of a view."""

    pixels: NDArray[np.uint8] = field(repr=False)
    """(height, width, 3) sRGB."""
    is_full: bool
    """Whether it has the size that was asked for."""
    frames: int
    """How many frames of this size it is the mean of."""
    seconds: float
    """That it took."""


class View:
    """One camera, the size of its pictures, and how far the picture of the current state is."""

    def __init__(self, control: CameraControl, size: Size) -> None:
        self.control = control
        self.resolution = Resolution(size)
        self.frames = 0
        """Of the current picture, so far."""
        self.state: object = None
        """Everything that the newest picture depends on."""
        self._changed_at = float("-inf")

    def resize(self, size: Size) -> None:
        """Pictures of another (width, height) in pixels."""
        self.resolution.full = size
        self.control.aspect = size[0] / size[1]

    def follow(self, state: object, now: float) -> None:
        """Choose the size of the next picture, at `now` seconds: that of one in motion after a change of `state`, and
        finer ones at rest. What moves again waits for the picture under way: so each is to take less time than the rest
        has lasted."""
        if state != self.state:
            self.state, self._changed_at, self.frames = state, now, 0
            self.resolution.move()
        elif not self.resolution.is_full and now - self._changed_at > max(_REST, self.resolution.finer_seconds):
            self.resolution.rest()
            self.frames = 0


class Viewer:
    """What is looked at, and how: scene, time, settings, what is shown, what is selected.

    A user interface changes it, asks `render` for the next picture of a view, and shows that; one thread at a time.
    `configure`, `set`, `render` and `pick` raise as Renderer's methods do.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        settings: Settings | None = None,
        device: Device | spy.Device | str | None = None,
        light_map: LightMap | None = None,
        frames: int = 64,
        start: float = 0.0,
        animation: int | str | None = None,
    ) -> None:
        """`frames`: of a picture at rest, after which it is complete. `start`, `animation`: of the playback.

        Compiles nothing before the first picture. Raises DeviceError without a usable device."""
        self.scene = scene
        self.device = open_device(device)
        self.frames = frames
        self.playback = Playback(scene, start, animation)
        self.edits = Edits()
        """Changes of the scene by hand."""
        self.visibility = Visibility()
        self.picked: Picked | None = None
        """What the newest `pick` has found."""
        self.node: Node | None = None
        """What is selected."""
        self.materials: tuple[Material, ...] = ()
        """Of what is selected: of the node's mesh, or of the section that was picked."""
        self._settings = settings or Settings()
        self._light_map = light_map
        self._renderer: Renderer | None = None
        self._shown = DISPLAY
        self._changes = scene.subscribe()
        self._revision = 0
        """Counts changes of everything but cameras."""
        self._last: tuple[View, object, Size] | None = None
        """View, state and size of the renderer's newest frame."""
        self._compiles = True
        """Whether the next picture may have to wait for shaders, which says nothing of its cost."""

    @property
    def settings(self) -> Settings:
        """As they run on the device, once there is a picture."""
        return self._settings if self._renderer is None else self._renderer.settings

    @property
    def shown(self) -> str:
        """The name of what is shown: "display" or an AOV."""
        return self._shown

    @property
    def showable(self) -> list[str]:
        """What can be shown with these settings, once there is a picture: the display, AOVs and debug AOVs."""
        if self._renderer is None:
            return [DISPLAY]
        effects = [name for effect in self._renderer.effects for name in effect.aov_names]
        return [*dict.fromkeys((DISPLAY, *effects, *self._renderer.debug_aovs))]

    @property
    def is_new(self) -> bool:
        """Whether there has been no picture with these settings yet: AOVs are known after it."""
        return self._compiles

    @property
    def milliseconds(self) -> dict[str, float]:
        """Of the device for the newest frame, by effect; empty before."""
        return {} if self._last is None or self._renderer is None else self._renderer.graph.milliseconds

    def show(self, name: str) -> None:
        """Show the display, an AOV, or a debug AOV. Raises PicaError for any other name."""
        if name not in self.showable:
            raise PicaError(f"show: {shown(name)} is not one of {', '.join(self.showable)}")
        self._shown = name
        self._revision += 1

    def select(self, node: Node | None) -> None:
        """Select a node, or nothing: pictures have its outline."""
        parts = () if node is None or node.mesh is None else node.mesh.parts
        self._select(node, tuple(dict.fromkeys(part.material for part in parts)))
        self.picked = None

    @property
    def focus(self) -> NDArray[np.float64] | None:
        """(3,) metres: the point that was picked, or the middle of the selected node; None: nothing is selected."""
        if self.picked is not None:
            return self.picked.position
        if self.node is None:
            return None
        try:
            nodes = list(self.node.walk())
            low, high = whole_box(nodes)
            return (low + high) / 2 if any(node.mesh is not None for node in nodes) else self.node.world[:3, 3]
        except SceneError:
            return None

    def view(self, size: Size, camera: Camera | None = None) -> View:
        """A new view, of (width, height) in pixels. `camera`: where it begins; None: as the scene has it."""
        return View(CameraControl(self.scene, size[0] / size[1], camera), size)

    def configure(self, settings: Settings) -> None:
        """Render with other settings from the next picture on."""
        if self._renderer is not None:
            self._renderer.configure(settings)
        self._settings = settings
        self._revision += 1
        self._compiles = True

    def set(self, path: str, value: Value) -> None:
        """Change one setting, by its dotted name, or a group to a level. Raises SettingsError."""
        self.configure(self.settings.with_values({path: value}))

    def is_complete(self, view: View) -> bool:
        """Whether `render` would only give the same picture again."""
        self._note_changes()
        is_whole = view.resolution.is_full and view.frames >= self.frames
        return is_whole and view.state == self._state_of(view)

    def render(self, view: View, now: float | None = None) -> Picture:
        """The next picture of a view: a small one if something has changed, else a finer one, or one frame more. Waits
        for the device. `now`: seconds of any clock, None for that of the system."""
        self._note_changes()
        view.follow(self._state_of(view), time.perf_counter() if now is None else now)
        return self._next(view)

    def render_full(self, view: View) -> Picture:
        """A picture of the whole size at once, for a screenshot: one frame more of the current one, or the first."""
        self._note_changes()
        view.follow(self._state_of(view), time.perf_counter())
        while not view.resolution.is_full:
            view.resolution.rest()
            view.frames = 0
        return self._next(view, has_outline=False)

    def pick(self, view: View, x: float, y: float, *, through_glass: bool = False) -> Picked | None:
        """Select what a view shows at (x, y), 0 to 1 from the upper left to the lower right corner; None: nothing."""
        self._note_changes()
        if self._last is None or self._last[:2] != (view, self._state_of(view)):
            self.render(view)
        assert self._renderer is not None
        width, height = self._renderer.size
        column, row = (min(max(int(at * length), 0), length - 1) for at, length in ((x, width), (y, height)))
        found = self.picked = self._renderer.pick(column, row, through_glass=through_glass)
        self._select(None if found is None else found.node, () if found is None else (found.material,))
        return found

    def close(self) -> None:
        """Release the renderer's device memory."""
        if self._renderer is not None:
            self._renderer.close()

    def _select(self, node: Node | None, materials: tuple[Material, ...]) -> None:
        if node is not self.node:
            self._revision += 1
        self.node, self.materials = node, materials

    def _next(self, view: View, has_outline: bool = True) -> Picture:
        """The picture of a view's current size and state."""
        size, began = view.resolution.size, time.perf_counter()
        renderer = self._prepared(view, size)
        outline = has_outline and self.node is not None

        def capture() -> set[str]:
            # With some settings there is no such AOV.
            return {self._shown if self._shown in self.showable else DISPLAY, *(["instance"] if outline else ())}

        renderer.advance(view.control.camera, jittered=self._shown == DISPLAY, capture=capture)
        name = self._shown if self._shown in renderer.captured else DISPLAY
        values = renderer.captured[name]()
        pixels = values if name == DISPLAY else preview(name, values)
        if outline:
            pixels = self._outlined(renderer, pixels)
        view.frames += 1
        self._last = view, view.state, size
        seconds = time.perf_counter() - began
        if not self._compiles:
            view.resolution.measure(seconds)
        self._compiles = False
        return Picture(pixels, view.resolution.is_full, view.frames, seconds)

    def _outlined(self, renderer: Renderer, pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
        assert self.node is not None
        height, width = pixels.shape[:2]
        ids = at_size((width, height), {"instance": renderer.captured["instance"]})["instance"]()
        return outlined(pixels, np.isin(ids, renderer.view.numbers_of(self.node.walk())))

    def _prepared(self, view: View, size: Size) -> Renderer:
        """The renderer, at this size, with no history of another view."""
        if self._renderer is None:
            settings, light_map = self._settings, self._light_map
            self._renderer = Renderer(self.scene, size=size, settings=settings, device=self.device, light_map=light_map)
        if self._renderer.size != size:
            self._renderer.resize(size)
        elif self._last is not None and self._last[0] is not view:
            self._renderer.reset()
        return self._renderer

    def _state_of(self, view: View) -> object:
        return view.control.camera, view.resolution.full, self._revision

    def _note_changes(self) -> None:
        if self._changes.take().any():
            self._revision += 1
            if self.node is not None and self.node not in self.scene:
                self.select(None)

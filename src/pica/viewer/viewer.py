"""The viewer: one scene and one renderer, looked at by any number of views."""

import gc
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.errors import PicaError, SceneError, shown
from pica.frame.aovs import at_size
from pica.images.output import Frame, preview
from pica.light_map.light_map import LightMap
from pica.renderer import Picked
from pica.rhi.device import Device, open_device
from pica.rhi.slang_files import compiler_faults
from pica.scene.camera import Camera
from pica.scene.extents import whole_box
from pica.scene.material import Material
from pica.scene.model import Scene
from pica.scene.node import Node
from pica.scene.shape_registry import sources_read_again
from pica.settings import Settings
from pica.settings.setting import Value
from pica.viewer.camera_control import CameraControl
from pica.viewer.camera_path import RecordedPath
from pica.viewer.comparison import Comparison, SplitPicture, compared
from pica.viewer.edits import Edits
from pica.viewer.outline import DeviceOutline, outlined
from pica.viewer.pixel import pixel_rows
from pica.viewer.playback import Playback
from pica.viewer.resolution import Size
from pica.viewer.scene_watch import SceneWatch
from pica.viewer.shader_watch import ShaderWatch
from pica.viewer.view import View
from pica.viewer.view_renderer import Lazy, ViewRenderer
from pica.viewer.visibility import Visibility

DISPLAY = "display"
"""What is shown unless told: the picture."""


@dataclass(frozen=True, eq=False)
class Picture:
    """A picture of a view."""

    content: NDArray[np.uint8] | spy.Texture = field(repr=False)
    """(height, width, 3) sRGB, or a texture of it that the next picture overwrites."""
    is_full: bool
    """Whether it has the size that was asked for."""
    frames: int
    """How many frames of this size it is the mean of."""
    seconds: float
    """That it took, without the other one of a comparison."""

    @property
    def size(self) -> Size:
        """(width, height) in pixels."""
        if isinstance(self.content, spy.Texture):
            return self.content.width, self.content.height
        height, width = self.content.shape[:2]
        return width, height

    @property
    def pixels(self) -> NDArray[np.uint8]:
        """(height, width, 3) sRGB."""
        return self.content.to_numpy()[..., :3] if isinstance(self.content, spy.Texture) else self.content


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
        self.path = RecordedPath()
        """Cameras for a film."""
        self.edits = Edits()
        """Changes of the scene by hand."""
        self.visibility = Visibility()
        self.picked: Picked | None = None
        """What the newest `pick` has found."""
        self.pixel: list[tuple[str, str]] = []
        """What the pixel of the newest `pick` has in the picture and in each AOV: names and values."""
        self.rays: dict[str, int] = {}
        """Of the last frame of the newest complete picture, by pass."""
        self.node: Node | None = None
        """What is selected."""
        self.materials: tuple[Material, ...] = ()
        """Of what is selected: of the node's mesh, or of the section that was picked."""
        self.split = 0.5
        """Where the picture of a comparison begins, as a fraction of the width."""
        self.interrupted: Callable[[], bool] = lambda: False
        """Whether a picture of the path tracer should be given up, as something is to change."""
        self._renderer = ViewRenderer(scene, settings or Settings(), self.device, light_map)
        self._outline = DeviceOutline(self.device)
        self._comparison: Comparison | None = None
        self._shown = DISPLAY
        self._watch, self._shaders = SceneWatch(scene), ShaderWatch()
        self._revision = 0
        """Counts changes of everything but cameras."""
        self._last: tuple[View, object] | None = None
        """View and state of the renderer's newest frame."""
        self._compiles = True
        """Whether the next picture may have to wait for shaders, which says nothing of its cost."""

    @property
    def settings(self) -> Settings:
        """As they run on the device, once there is a picture."""
        return self._renderer.settings

    @property
    def shown(self) -> str:
        """The name of what is shown: "display" or an AOV."""
        return self._shown

    @property
    def showable(self) -> list[str]:
        """What can be shown with these settings, once there is a picture: the display, AOVs and debug AOVs."""
        return [*dict.fromkeys((DISPLAY, *self._renderer.aov_names))]

    @property
    def is_new(self) -> bool:
        """Whether there has been no picture with these settings yet: AOVs are known after it."""
        return self._compiles

    @property
    def milliseconds(self) -> dict[str, float]:
        """Of the device for the newest frame, by effect; empty before."""
        return {} if self._last is None else self._renderer.milliseconds

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
        self._renderer.configure(settings)
        self._begin_again()

    def set(self, path: str, value: Value) -> None:
        """Change one setting, by its dotted name, or a group to a level. Raises SettingsError."""
        self.configure(self.settings.with_values({path: value}))

    def follow_shaders(self) -> bool:
        """Render with the Slang files as they are now, if any has changed since the last call; whether it has. Raises
        PicaError, once for each change, where they have a fault: pictures go on with the shaders of before."""
        if not self._shaders.take():
            return False
        gc.collect()  # programs of the changes before are in cycles
        device = self.device.renewed()
        with sources_read_again(), compiler_faults():
            outline = DeviceOutline(device)
            self._renderer.renew(device)
        self._outline.close()
        self.device, self._outline = device, outline
        self.compare(self.compared_with)
        return True

    @property
    def compared_with(self) -> str | None:
        """What the right part of the picture shows: "path_traced" or a preset; None: there is no comparison."""
        return None if self._comparison is None else self._comparison.name

    def compare(self, name: str | None) -> None:
        """Show the path tracer ("path_traced") or a preset beside the picture, from `split` on; None: nothing. Raises
        PicaError for another name, DeviceError where nothing traces the paths."""
        made = None if name is None else compared(name, self.scene, self.device, self.frames)
        if self._comparison is not None:
            self._comparison.close()
        self._comparison = made
        self._begin_again()

    def is_complete(self, view: View) -> bool:
        """Whether `render` would only give the same picture again."""
        return self._is_gathered(view) and (view.parts is None or view.parts.split == self.split)

    def _is_gathered(self, view: View) -> bool:
        """Whether a view has all of its frames, at whatever place it is split."""
        self._note_changes()
        is_whole = view.resolution.is_full and view.frames >= self.frames
        is_still = is_whole and view.state == self._state_of(view)
        return is_still and (not self._compares or self._comparison is None or self._comparison.is_complete(view))

    def render(self, view: View, now: float | None = None, *, on_device: bool = False) -> Picture:
        """The next picture of a view: a small one if something has changed, else a finer one, or one frame more. Waits
        for the device. `now`: seconds of any clock, None for that of the system. `on_device`: the display stays there
        as a texture, unless it has a comparison, which the host draws."""
        if view.parts is not None and self._is_gathered(view):
            return self._picture(view, view.parts.at(self.split), 0.0)
        view.follow(self._state_of(view), time.perf_counter() if now is None else now)
        return self._next(view, on_device=on_device)

    def render_full(self, view: View) -> Picture:
        """A picture of the whole size at once, for a screenshot: one frame more of the current one, or the first."""
        self._make_whole(view)
        return self._next(view, has_outline=False)

    def frame(self, view: View) -> Frame:
        """The same with all AOVs, whatever is shown. Raises as Renderer.render."""
        self._make_whole(view)
        return self._framed(view)

    def pick(self, view: View, x: float, y: float, *, through_glass: bool = False) -> Picked | None:
        """Select what a view shows at (x, y), 0 to 1 from the upper left to the lower right corner, in one frame more;
        None: nothing."""
        self._note_changes()
        view.follow(self._state_of(view), time.perf_counter())
        frame = self._framed(view)
        column, row = (min(max(int(at * length), 0), length - 1) for at, length in zip((x, y), frame.size, strict=True))
        found = self.picked = self._renderer.newest.pick(column, row, through_glass=through_glass)
        self.pixel = pixel_rows(frame, column, row)
        self._select(None if found is None else found.node, () if found is None else (found.material,))
        return found

    def replaced(self, scene: Scene) -> "Viewer":
        """A viewer of another scene with this one's settings and device; this one is closed."""
        after = Viewer(scene, settings=self.settings, device=self.device, frames=self.frames)
        self.close()
        return after

    def close(self) -> None:
        """Release the renderers' device memory."""
        self._renderer.close()
        self._outline.close()
        if self._comparison is not None:
            self._comparison.close()

    def _select(self, node: Node | None, materials: tuple[Material, ...]) -> None:
        if node is not self.node:
            self._revision += 1
        self.node, self.materials = node, materials

    def _make_whole(self, view: View) -> None:
        """The next picture of a view has its whole size."""
        self._note_changes()
        view.follow(self._state_of(view), time.perf_counter())
        while not view.resolution.is_full:
            view.resolution.rest()
            view.frames = 0

    def _framed(self, view: View) -> Frame:
        """One frame more of a view's current size and state."""
        frame = self._renderer.frame(view)
        self._last, self._compiles = (view, view.state), False
        view.frames += 1
        return frame

    def _next(self, view: View, has_outline: bool = True, on_device: bool = False) -> Picture:
        """The picture of a view's current size and state."""
        began = time.perf_counter()
        outline = has_outline and self.node is not None
        stays = on_device and self._shown == DISPLAY and not self._compares

        # Not of pictures of one frame, each of which in motion is complete.
        completes = view.resolution.is_full and 1 < view.frames + 1 == self.frames

        def capture() -> set[str]:
            names = set(self._renderer.newest.ray_counters) if completes else set()  # to count takes time
            if stays:
                return names
            # With some settings there is no such AOV.
            names.add(self._shown if self._shown in self.showable else DISPLAY)
            return names | {"instance"} if outline else names

        captured = self._renderer.advance(view, self._shown == DISPLAY, capture)
        self._last = view, view.state
        view.frames += 1
        if completes:
            counters = self._renderer.newest.ray_counters
            self.rays = {name.removeprefix("rays."): int(captured[name]()) for name in counters if name in captured}
        if stays:
            return self._on_device(view, outline, began)
        name = self._shown if self._shown in captured else DISPLAY
        values = captured[name]()
        pixels = values if name == DISPLAY else preview(name, values)
        selected = self._selected_pixels(pixels, captured["instance"]) if outline else None
        own, other = time.perf_counter() - began, None
        if self._compares and self._comparison is not None:
            other = self._comparison.picture(view, self.settings, self.interrupted)
        view.parts = None if other is None else SplitPicture(pixels, other, selected)
        if view.parts is not None:
            pixels = view.parts.at(self.split)
        elif selected is not None:
            pixels = outlined(pixels, selected)
        if other is None or view.frames == 1:  # at rest the path tracer takes more
            self._measure(view, time.perf_counter() - began)
        return self._picture(view, pixels, own)

    def _on_device(self, view: View, outline: bool, began: float) -> Picture:
        """The picture of the renderer's newest frame, as a texture."""
        texture = self._renderer.textures["display"]
        if outline and self.node is not None:
            scene = self._renderer.newest.view
            is_selected = np.isin(scene.labels()[:, 0], scene.numbers_of(self.node.walk()))
            texture = self._outline(texture, self._renderer.textures["visibility"], is_selected)
        with self.device.lock:
            self.device.submissions.wait_for_all()
        seconds, view.parts = time.perf_counter() - began, None
        self._measure(view, seconds)
        return self._picture(view, texture, seconds)

    def _measure(self, view: View, seconds: float) -> None:
        """A picture took so long."""
        if not self._compiles:
            view.resolution.measure(seconds, begins=self._renderer.begins)
        self._compiles = False

    @property
    def _compares(self) -> bool:
        """Whether pictures have two parts: AOVs have one."""
        return self._comparison is not None and self._shown == DISPLAY

    def _picture(self, view: View, content: NDArray[np.uint8] | spy.Texture, seconds: float) -> Picture:
        return Picture(content, view.resolution.is_full, view.frames, seconds)

    def _selected_pixels(self, pixels: NDArray[np.uint8], fetch: Lazy) -> NDArray[np.bool_]:
        """(height, width) where what is selected shows. `fetch`: the AOV "instance"."""
        assert self.node is not None
        height, width = pixels.shape[:2]
        ids = at_size((width, height), {"instance": fetch})["instance"]()
        return np.isin(ids, self._renderer.newest.view.numbers_of(self.node.walk()))

    def _begin_again(self) -> None:
        """After a change that may compile programs."""
        self._revision += 1
        self._compiles = True

    def _state_of(self, view: View) -> object:
        return view.control.camera, view.resolution.full, self._revision

    def _note_changes(self) -> None:
        if self._watch.take():
            self._revision += 1
            if self.node is not None and self.node not in self.scene:
                self.select(None)

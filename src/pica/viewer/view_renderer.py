"""A renderer that views use in turns."""

from collections.abc import Callable, Collection, Mapping
from typing import Any
from weakref import ref

import slangpy as spy
from numpy.typing import NDArray

from pica.images.output import Frame
from pica.light_map.light_map import LightMap
from pica.renderer import Renderer
from pica.rhi.device import Device
from pica.scene.model import Scene
from pica.settings import Settings
from pica.viewer.resolution import Size
from pica.viewer.view import View

Lazy = Callable[[], NDArray[Any]]


class ViewRenderer:
    """Renders frames of views: each begins without the history of the others. Made with the first frame."""

    def __init__(self, scene: Scene, settings: Settings, device: Device, light_map: LightMap | None = None) -> None:
        self._scene, self._settings, self._device, self._light_map = scene, settings, device, light_map
        self._renderer: Renderer | None = None
        self.textures: Mapping[str, spy.Texture] = {}
        """Of the newest frame, as of Renderer.advance: the next one overwrites them."""
        self._view: Callable[[], View | None] = lambda: None
        """Of the newest frame."""
        self._is_new = False
        """Whether the newest frame has no history."""
        self.begins = False
        """Whether the newest frame has no history and the one before had: views in turns never have."""

    @property
    def newest(self) -> Renderer:
        """The renderer, after the first frame."""
        assert self._renderer is not None
        return self._renderer

    @property
    def settings(self) -> Settings:
        """As they run on the device, once there is a frame."""
        return self._settings if self._renderer is None else self._renderer.settings

    @property
    def aov_names(self) -> list[str]:
        """AOVs and debug AOVs with these settings, once there is a frame."""
        if self._renderer is None:
            return []
        effects = [name for effect in self._renderer.effects for name in effect.aov_names]
        return [*effects, *self._renderer.debug_aovs]

    @property
    def milliseconds(self) -> dict[str, float]:
        """Of the device for the newest frame, by effect."""
        return self.newest.graph.milliseconds

    def configure(self, settings: Settings) -> None:
        """Render with other settings from the next frame on."""
        if self._renderer is not None:
            self._renderer.configure(settings)
        self._settings = settings

    def renew(self, device: Device) -> None:
        """Render by this device, whose programs are renewed, from the next frame on. Raises as Renderer's methods where
        it cannot: then frames go on as before."""
        if self._renderer is not None:
            renderer = self._made(device, self._renderer.size)
            try:
                renderer.prepare()
            except BaseException:
                renderer.close()
                raise
            self._renderer.close()
            self._renderer, self._view = renderer, lambda: None
        self._device = device

    def advance(self, view: View, jittered: bool, capture: Callable[[], Collection[str]]) -> Mapping[str, Lazy]:
        """The next frame of a view, at its current size: functions that fetch what is captured."""
        renderer = self._turned_to(view)
        self.textures = renderer.advance(view.control.camera, jittered=jittered, capture=capture)
        return renderer.captured

    def frame(self, view: View) -> Frame:
        """The next frame of a view, at its current size, with all AOVs."""
        return self._turned_to(view).render(1, camera=view.control.camera)

    def _turned_to(self, view: View) -> Renderer:
        """The renderer, of the view's current size, without the history of another view."""
        size, was_new = view.resolution.size, self._is_new
        self._is_new = True
        if self._renderer is None:
            self._renderer = self._made(self._device, size)
        if self._renderer.size != size:
            self._renderer.resize(size)
        elif self._view() is not view:
            self._renderer.reset()
        else:
            self._is_new = False
        self.begins = self._is_new and not was_new
        self._view = ref(view)
        return self._renderer

    def _made(self, device: Device, size: Size) -> Renderer:
        return Renderer(self._scene, size=size, settings=self._settings, device=device, light_map=self._light_map)

    def close(self) -> None:
        """Release its device memory."""
        if self._renderer is not None:
            self._renderer.close()

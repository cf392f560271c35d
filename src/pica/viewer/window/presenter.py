"""Puts pictures and the panel above them onto a window, without reading anything back from the device."""

import numpy as np
import slangpy as spy
from numpy.typing import NDArray
from slangpy import ui

from pica.errors import DeviceError, PicaError
from pica.rhi.device import Device
from pica.text import first_line
from pica.viewer.resolution import Size

_FORMATS = (spy.Format.bgra8_unorm, spy.Format.rgba8_unorm)
"""Of swapchains whose values are sRGB as they are: pictures are encoded already."""
_HELP = "without --window, pica view shows the scene in a browser"


def open_window(size: Size) -> spy.Window:
    """A window of (width, height) in pixels. Raises PicaError without a display."""
    try:
        return spy.Window(*size, title="pica")
    except RuntimeError as error:
        raise PicaError(f"--window needs a display ({first_line(error)}); {_HELP}") from None


class Presenter:
    """The swapchain of a window, and the ImGui context whose `screen` is drawn above the pictures."""

    def __init__(self, device: Device, window: spy.Window) -> None:
        """Raises DeviceError if the device has no swapchains."""
        self._device, self._window = device, window
        try:
            self._surface = device.handle.create_surface(window)
            formats = [each for each in _FORMATS if each in self._surface.info.formats]
        except RuntimeError as error:
            fault = f"device {device.name!r} can present to no window ({first_line(error)})"
            raise DeviceError(f"{fault}; {_HELP}") from None
        if not formats:
            raise DeviceError(f"device {device.name!r} presents no pictures of 8 bits a channel; {_HELP}")
        self._format = formats[0]
        self._context = ui.Context(device.handle)
        self._uploaded: spy.Texture | None = None
        """A picture that the host has made."""
        self._configured: Size | None = None
        """The size of the swapchain's images."""

    @property
    def screen(self) -> ui.Screen:
        """The parent of all windows of ImGui."""
        return self._context.screen

    def takes_key(self, event: spy.KeyboardEvent) -> bool:
        """Give the panel an event; whether it was for the panel alone."""
        return self._context.handle_keyboard_event(event)

    def takes_mouse(self, event: spy.MouseEvent) -> bool:
        """As `takes_key`."""
        return self._context.handle_mouse_event(event)

    def present(self, content: spy.Texture | NDArray[np.uint8] | None) -> None:
        """Show a picture, (height, width, 3) sRGB or a texture of it, stretched over the window, with the panel above
        it. None: the panel alone."""
        size = self._window.width, self._window.height
        if min(size) == 0:  # minimized
            return
        with self._device.lock:
            image = self._next_image(size)
            if image is None:
                return
            if isinstance(content, np.ndarray):
                content = self._upload(content)
            encoder = self._device.handle.create_command_encoder()
            if content is None:
                encoder.clear_texture_float(image, clear_value=[0.0, 0.0, 0.0, 1.0])
            else:
                encoder.blit(image, content)
            self._context.begin_frame(*size, self._window)
            self._context.end_frame(image, encoder)
            self._device.handle.submit_command_buffer(encoder.finish())
            self._surface.present()

    def close(self) -> None:
        """Release the swapchain."""
        with self._device.lock:
            self._device.handle.wait_for_idle()
            self._surface.unconfigure()
            self._release_upload()

    def _next_image(self, size: Size) -> spy.Texture | None:
        """The swapchain's next image; None: the window is just changing, and gets none."""
        if size != self._configured:
            self._device.handle.wait_for_idle()
            self._surface.configure(*size, format=self._format)
            self._configured = size
        image: spy.Texture | None = self._surface.acquire_next_image()
        if image is None:
            self._configured = None
        return image

    def _upload(self, pixels: NDArray[np.uint8]) -> spy.Texture:
        height, width = pixels.shape[:2]
        kept = self._uploaded
        if kept is None or (kept.width, kept.height) != (width, height):
            self._release_upload()
            kept = self._device.texture("picture of the window", spy.Format.rgba8_unorm, (width, height))
            self._uploaded = kept
        kept.copy_from_numpy(np.dstack([pixels, np.full((height, width), 255, np.uint8)]))
        return kept

    def _release_upload(self) -> None:
        if self._uploaded is not None:
            self._device.give_back(self._uploaded)
            self._uploaded = None

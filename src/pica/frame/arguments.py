"""What renderers and path tracers are given, checked before anything is done with it."""

from collections.abc import Callable
from typing import Any

from pica.errors import DeviceError, PicaError, SettingsError, shown
from pica.rhi.device import Device
from pica.scene.camera import Camera
from pica.scene.model import Scene
from pica.scene.values import checked, instance, optional, whole
from pica.settings import Settings

Progress = Callable[[int, int], None]
_MOST = 1 << 31
"""Frames or samples of one call; shaders count them in 32 bits."""


def check_made_with(who: str, scene: Any, settings: Any, device: Any) -> None:
    """Raises PicaError for what no renderer can be made with."""
    checked(f"{who}: scene", instance(Scene), scene)
    checked(f"{who}: settings", optional(instance(Settings)), settings, SettingsError)
    checked(f"{who}: device", optional(instance(Device, str)), device, DeviceError)


def checked_count(what: str, count: Any) -> int:
    """How often to do something, at least once. Raises PicaError for what is not a whole number of at least 1."""
    return checked(what, whole(1, _MOST), count, PicaError)


def checked_camera(who: str, camera: Any) -> Camera:
    """A camera as it is. Raises SceneError for what is none."""
    found: Camera = checked(f"{who}: camera", instance(Camera), camera)
    return found


def check_progress(who: str, progress: Any) -> None:
    """Raises PicaError for what cannot be called."""
    if progress is not None and not callable(progress):
        raise PicaError(f"{who}: progress: {shown(progress)} cannot be called")

"""Checks of the arguments of renderers and path tracers."""

from collections.abc import Callable, Collection, Mapping, Sequence
from operator import index
from typing import Any

import slangpy as spy

from pica.errors import DeviceError, PicaError, SceneError, SettingsError, shown
from pica.frame.context import Size
from pica.rhi.device import Device, open_device
from pica.scene.camera import Camera
from pica.scene.model import Scene
from pica.scene.scene_views import SceneViews
from pica.scene.values import checked, instance, optional, whole
from pica.settings import Settings

Progress = Callable[[int, int], None]
LARGEST = 16384
"""Pixels of a picture, each way."""
_MOST_VIEWS = 4096
_MOST = 1 << 31
"""Frames or samples of one call; shaders count them in 32 bits."""


def check_made_with(caller: str, scene: Any, settings: Any, device: Any) -> None:
    """Raises PicaError for invalid constructor arguments."""
    checked(f"{caller}: scene", instance(Scene), scene)
    checked(f"{caller}: settings", optional(instance(Settings)), settings, SettingsError)
    if not isinstance(device, spy.Device):
        checked(f"{caller}: device", optional(instance(Device, str)), device, DeviceError)


def checked_scenes(caller: str, scene: Any, views: Any) -> list[Any]:
    """The scene of each view: one for all, or a sequence of one for each. Raises PicaError for an impossible number
    of views, SceneError for another number of scenes; whether they are scenes is not checked."""
    count = checked(f"{caller}: views", optional(whole(1, _MOST_VIEWS)), views, PicaError)
    if not isinstance(scene, list | tuple | SceneViews):
        return [scene] * (count or 1)
    if not scene or (count or len(scene)) != len(scene):
        raise SceneError(f"{caller}: scene: {len(scene)} scenes: must be one for each of {count or 'some'} views")
    return list(scene)


def checked_size(size: Size) -> Size:
    """(width, height) as it is, or PicaError when no picture can have it."""
    try:
        width, height = (index(length) for length in size)
    except Exception:  # raised by iteration
        raise PicaError(f"picture size {shown(size)}: must be two whole numbers, width and height") from None
    if not (1 <= width <= LARGEST and 1 <= height <= LARGEST):
        raise PicaError(f"picture size {shown(width)}x{shown(height)}: width and height must be 1 to {LARGEST} pixels")
    return width, height


def checked_pixel(caller: str, pixel: tuple[Any, Any], size: Size) -> tuple[int, int]:
    """(x, y) in a picture of (width, height). Raises PicaError unless they are whole numbers inside of it."""
    x, y = (
        checked(f"{caller}: {name}", whole(0, length - 1), value, PicaError)
        for name, value, length in zip("xy", pixel, size, strict=True)
    )
    return x, y


def checked_count(what: str, count: Any) -> int:
    """A number of repetitions. Raises PicaError unless it is a whole number of at least 1."""
    return checked(what, whole(1, _MOST), count, PicaError)


def checked_camera(caller: str, camera: Any) -> Camera:
    """A camera. Raises SceneError for anything else."""
    if isinstance(camera, list | tuple):
        raise PicaError(f"{caller}: camera: {len(camera)} cameras: this renderer takes one; Renderer(views=...) others")
    result: Camera = checked(f"{caller}: camera", instance(Camera), camera)
    return result


def checked_cameras(caller: str, cameras: Any, views: int) -> list[Camera]:
    """A camera for each of so many views. Raises PicaError for another number, SceneError for anything but cameras."""
    given = list(cameras) if isinstance(cameras, Sequence) else None
    if given is None or len(given) != views:
        count = shown(cameras) if given is None else f"{len(given)} cameras"
        raise PicaError(f"{caller}: camera: {count}: must be a list of {views}, one for each view of the renderer")
    return [checked_camera(caller, camera) for camera in given]


def check_progress(caller: str, progress: Any) -> None:
    """Raises PicaError unless it can be called."""
    if progress is not None and not callable(progress):
        raise PicaError(f"{caller}: progress: {shown(progress)} cannot be called")


def checked_aovs(
    caller: str, aovs: Any, available: Collection[str] | None, off: Mapping[str, str] | None = None
) -> frozenset[str] | None:
    """Names of AOVs; None, for all, stays None. Raises PicaError for a name that is not in `available` (None: all are),
    which it lists, and for an AOV of an effect that is off. `off`: effects by the AOVs that they would have."""
    if aovs is None:
        return None
    try:
        names = () if isinstance(aovs, str) else tuple(aovs)
    except Exception:  # raised by iteration
        names = (None,)
    if isinstance(aovs, str) or not all(isinstance(name, str) for name in names):
        raise PicaError(f'{caller}: aovs: {shown(aovs)}: must be names, such as ("depth", "instance"), or None for all')
    for name in names:
        if off is not None and name in off:
            raise PicaError(
                f"{caller}: AOV {name!r} needs the effect {off[name]}, which is off in the renderer's settings"
            )
        if available is not None and name not in available:
            raise PicaError(f"{caller}: no AOV {shown(name)}; there are {', '.join(available) or 'none'}")
    return frozenset(names)


def open_devices(devices: Sequence[Device | spy.Device | str | int]) -> list[Device]:
    """Several devices, as `open_device` opens each; a number is that of an adapter. Raises DeviceError for none, and
    for one that is named twice."""
    if isinstance(devices, str) or not devices:
        raise DeviceError(f"devices {shown(devices)}: must be a list of one device or more, such as [0, 1]")
    for each in devices:
        if not isinstance(each, Device | spy.Device | str | int) or isinstance(each, bool):
            raise DeviceError(f"devices: {shown(each)} is neither a name nor a number nor an open device")
    opened = [open_device(f"#{each}" if isinstance(each, int) else each) for each in devices]
    if len({id(each) for each in opened}) < len(opened):
        raise DeviceError(f"devices {shown(list(devices))}: one of them is named twice")
    return opened


def primary_and_others(
    caller: str,
    device: Device | spy.Device | str | None,
    devices: Sequence[Device | spy.Device | str | int] | None,
) -> tuple[Device, list[Device]]:
    """The device that makes the pictures, and those that help it. Raises PicaError if both arguments are given, and
    DeviceError as `open_device` and `open_devices`."""
    if devices is None:
        return open_device(device), []
    if device is not None:
        raise PicaError(f"{caller}: device and devices are two ways to say one thing")
    first, *others = open_devices(devices)
    return first, others

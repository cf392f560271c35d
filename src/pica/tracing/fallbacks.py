"""Fallbacks on a device without ray tracing: Embree if it is installed, otherwise each stage's own fallback
(docs/guide/devices.md)."""

import warnings

from pica.errors import DeviceError
from pica.rhi.device import Device
from pica.settings import PRESETS, Settings
from pica.settings.setting import Value
from pica.tracing import embree

WITHOUT_RAYS = PRESETS["raster"].values
"""The fallback of each setting without rays."""


class WarningLog:
    """Warnings that the user of a device has had."""

    def __init__(self, _: Device) -> None:
        self.messages: set[str] = set()


def runnable(device: Device, settings: Settings) -> Settings:
    """The settings as they run on the device: stages that it cannot trace fall back, each with one warning."""
    if device.traces_rays:
        return settings
    changes = _without_rays(settings) if embree.missing() else _by_embree(settings)
    for setting, value in changes.items():
        say_once(device, f"device {device.name!r} has no ray tracing pipelines: {setting} is {value}")
    return settings.with_values(changes)


def traces(device: Device) -> bool:
    """Whether there is a tracer for the device."""
    return device.traces_rays or not embree.missing()


def check_traces(device: Device, what: str) -> None:
    """Raises DeviceError if there is no tracer for the device. `what`: the feature that needs it, for the message."""
    missing = None if device.traces_rays else embree.missing()
    if missing:
        raise DeviceError(f"{what}: device {device.name!r} has no ray tracing pipelines, and {missing}")


def say_once(device: Device, message: str) -> None:
    """A warning, unless the device has given it before."""
    messages = device.shared(WarningLog).messages
    if message not in messages:
        messages.add(message)
        warnings.warn(message, stacklevel=4)


def _by_embree(settings: Settings) -> dict[str, Value]:
    changes: dict[str, Value] = {}
    if settings.rays.scheduler == "pipeline":
        changes["rays.scheduler"] = "buffers"
    if settings.rays.tracer == "device":
        changes["rays.tracer"] = "embree"
    return changes


def _without_rays(settings: Settings) -> dict[str, Value]:
    shadows = settings.shadows.mode != "off" and settings.shadows.method == "rays"
    needed = {
        "visibility.primary": settings.visibility.primary == "rays",
        "shadows.method": shadows,
        "ambient_occlusion.mode": settings.ambient_occlusion.mode == "ray_traced",
        # Shadow maps do not cover the environment.
        "lighting.environment": shadows and settings.lighting.environment == "sampled",
        "reflections.mode": settings.reflections.mode == "ray_traced",
        "translucency.mode": settings.translucency.mode != "off",
        "transparency.mode": settings.transparency.mode == "ray_traced",
        "global_illumination.mode": settings.global_illumination.mode not in ("off", "light_map"),
    }
    return {setting: WITHOUT_RAYS[setting] for setting, traced in needed.items() if traced}

"""The available graphics devices, their abilities, and the choice of one."""

import json
import os
import re
import subprocess
import sys
from dataclasses import asdict, dataclass
from pathlib import Path

import slangpy as spy

from pica.errors import DeviceError, shown

_NEEDED = {
    spy.Feature.bindless: "bindless resources",
    spy.Feature.parameter_block: "parameter blocks",
    spy.Feature.rasterization: "rasterization",
    spy.Feature.timestamp_query: "timestamp queries",
}
HIDE_RAY_TRACING = "PICA_HIDE_RAY_TRACING"
"""Environment variable: if set, every device is treated as one without ray tracing."""
TIERS = {
    0: ("raster only", "ray tracing, where Embree on the processor can stand in"),
    1: (
        "a buffer of rays in, a buffer of hits out",
        "ray generation and hit shaders: effects are compute around a tracer",
    ),
    2: ("ray tracing pipelines", "recursion, which pica does not use"),
    3: ("ray tracing pipelines with recursion", "nothing"),
}
"""What devices of each tier trace, and what they lack (RTG 19, 19.2.2)."""
TRACES = 2
"""The first tier with ray tracing."""
_UUID = re.compile("(?:GPU-)?((?:[0-9a-f]-?){32})", re.IGNORECASE)
HELP = "run `pica doctor` to see what is missing and how to install it"


@dataclass(frozen=True)
class DeviceInfo:
    """One graphics device as found on this machine."""

    name: str
    type: str
    """"hardware" or "software" (a driver that runs on the CPU, such as lavapipe)."""
    driver: str
    """The driver's version if it can be determined, else an empty string."""
    tier: int
    """Ray tracing tier (RTG 19, 19.2.2): 0 none, 1 buffers of rays, 2 ray generation shaders, 3 recursion."""
    missing: list[str]
    """Required features that this device lacks, in words."""
    uuid: str = ""
    """32 hexadecimal digits, the same wherever the card is plugged in; empty if the driver does not open."""


def tier_of(device: spy.Device) -> int:
    """The ray tracing tier of an open device: 3 or 0, as pica traces through pipelines or not at all."""
    features = spy.Feature.acceleration_structure, spy.Feature.ray_tracing
    # Every Vulkan driver with ray tracing pipelines seen so far allows recursion.
    return 3 if HIDE_RAY_TRACING not in os.environ and all(map(device.has_feature, features)) else 0


def _driver_version(adapter: spy.AdapterInfo) -> str:
    nvidia = Path("/proc/driver/nvidia/version")
    if "nvidia" in adapter.name.lower() and nvidia.exists():
        words = nvidia.read_text().split()
        return next((word for word in words if word[:1].isdigit() and "." in word), "")
    # Mesa's software drivers write their version into the device's identifier.
    text = bytes(adapter.luid).split(b"\0")[0].decode("ascii", "ignore")
    return text if text.startswith("mesa") else ""


def describe(device: spy.Device, adapter: spy.AdapterInfo) -> DeviceInfo:
    """Properties of an open device, and features that it lacks."""
    return DeviceInfo(
        name=adapter.name,
        type="software" if device.has_feature(spy.Feature.software_device) else "hardware",
        driver=_driver_version(adapter),
        tier=tier_of(device),
        missing=[words for feature, words in _NEEDED.items() if not device.has_feature(feature)],
        uuid=bytes(adapter.luid).hex(),
    )


def adapters() -> list[spy.AdapterInfo]:
    """Every Vulkan adapter; empty without a Vulkan loader or driver."""
    try:
        return list(spy.Device.enumerate_adapters(spy.DeviceType.vulkan))
    except RuntimeError:
        return []


def list_devices() -> list[DeviceInfo]:
    """Every graphics device. Each is opened in its own process, because a broken driver may crash it."""
    devices = []
    for index, adapter in enumerate(adapters()):
        probe = subprocess.run(
            [sys.executable, "-m", "pica.rhi.adapters", str(index)], capture_output=True, text=True, timeout=120
        )
        if probe.returncode == 0:
            devices.append(DeviceInfo(**json.loads(probe.stdout.splitlines()[-1])))
        else:
            devices.append(DeviceInfo(adapter.name, "unknown", _driver_version(adapter), 0, ["a driver that opens"]))
    return devices


def choose(name: str | None) -> spy.AdapterInfo:
    """The adapter to use: the one whose name contains `name`, else hardware before software. For machines with several
    cards of one name, "#1" is the second of all, and a UUID (32 hexadecimal digits; hyphens and "GPU-" as drivers print
    them may be there) is that card wherever it is plugged in.

    Raises DeviceError if there is none, or none with that name.
    """
    candidates = adapters()
    if not candidates:
        raise DeviceError(f"no Vulkan device on this machine; {HELP}")
    if name is not None and re.fullmatch("#[0-9]{1,3}", name):
        if int(name[1:]) >= len(candidates):
            raise DeviceError(f"no device {name}; there are {len(candidates)}, from #0")
        return candidates[int(name[1:])]
    if name is not None and (digits := _UUID.fullmatch(name)):
        identity = bytes.fromhex(digits[1].replace("-", ""))
        found = next((adapter for adapter in candidates if bytes(adapter.luid) == identity), None)
        if found is None:
            raise DeviceError(f"no device has the UUID {name}; `pica doctor` lists them")
        return found
    if name is not None:
        matching = [adapter for adapter in candidates if name.lower() in adapter.name.lower()]
        if not matching:
            raise DeviceError(f"no device named {shown(name)}; there are: {', '.join(a.name for a in candidates)}")
        candidates = matching
    return min(candidates, key=is_software)


def for_worker(number: int) -> str | None:
    """The device for one of several workers on this machine, in turn where there are several graphics cards; as the
    name of `choose`."""
    cards = [index for index, adapter in enumerate(adapters()) if not is_software(adapter)]
    return f"#{cards[number % len(cards)]}" if len(cards) > 1 else None


def adapter_of(device: spy.Device) -> spy.AdapterInfo:
    """The adapter that an open device is on. Raises DeviceError where it is no Vulkan device."""
    if device.info.type != spy.DeviceType.vulkan:
        raise DeviceError(f"device {device.info.adapter_name!r} is a {device.info.api_name} device: pica needs Vulkan")
    return next(adapter for adapter in adapters() if adapter.name == device.info.adapter_name)


def is_software(adapter: spy.AdapterInfo) -> bool:
    """Whether an adapter is Mesa's software rasterizer, by name: opening it to ask takes seconds."""
    return "llvmpipe" in adapter.name.lower()


if __name__ == "__main__":
    chosen = adapters()[int(sys.argv[1])]
    opened = spy.Device(type=spy.DeviceType.vulkan, adapter_luid=chosen.luid)
    print(json.dumps(asdict(describe(opened, chosen))))

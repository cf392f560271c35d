"""`pica doctor`: the machine's devices, what they lack and what to install."""

import json
import os
import platform
import subprocess
import sys
from typing import Any

import typer

from pica.cli.report import print_columns, print_line
from pica.text import one_line

_PROBE = """
import dataclasses, json
from pica.rhi.adapters import list_devices
print(json.dumps([dataclasses.asdict(device) for device in list_devices()]))
"""
_LAVAPIPE = {
    "debian": "bash scripts/setup_vulkan.sh in pica's source folder, or: sudo apt-get install libatomic1 libx11-6 "
    "libvulkan1 mesa-vulkan-drivers (24.3 or newer; on Debian 12 with -t bookworm-backports)",
    "fedora": "sudo dnf install libatomic vulkan-loader mesa-vulkan-drivers",
    "arch": "sudo pacman -S vulkan-icd-loader vulkan-swrast",
}


def doctor() -> None:
    """List the devices, what each lacks, the cache folders, and what to install.

    The exit code is 2 where there is no device that pica can use.
    """
    devices, fault = probe()
    print_line(f"pica {_version('pica')}, SlangPy {_version('slangpy')}, Python {platform.python_version()}")
    if devices:
        header = "number", "device", "type", "driver", "tier", "UUID", "missing"
        print_columns([header, *((str(number), *_row(device)) for number, device in enumerate(devices))])
        for line in [*tier_lines(devices), *stage_lines(devices)]:
            print_line(line)
    if fault:
        print_line(f"looking for devices failed: {fault}")
    for name, folder in _cache_folders().items():
        print_line(f"{name}: {folder}")
    for line in advice(devices):
        print_line(line)
    if not usable(devices):
        raise typer.Exit(2)


def probe() -> tuple[list[dict[str, Any]], str]:
    """The devices as mappings of DeviceInfo, and the error; in a process of its own, which a driver may crash."""
    try:
        run = subprocess.run(
            [sys.executable, "-c", _PROBE],
            capture_output=True,
            text=True,
            errors="replace",
            timeout=300,
            # The same modules as here, and none of the folder that this runs in.
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path)), "PYTHONSAFEPATH": "1"},
        )
    except subprocess.TimeoutExpired:
        return [], "no answer within 5 minutes; a driver hangs"
    if run.returncode:
        lines = [line for line in run.stderr.splitlines() if line.strip()]
        return [], lines[-1] if lines else f"the process ended with {run.returncode}"
    return json.loads(run.stdout.splitlines()[-1]), ""


def usable(devices: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The devices that lack nothing."""
    return [device for device in devices if not device["missing"]]


def _row(device: dict[str, Any]) -> tuple[str, ...]:
    missing = ", ".join(device["missing"]) or "nothing"
    driver, uuid = device["driver"] or "?", device["uuid"] or "?"
    return one_line(device["name"]), device["type"], driver, str(device["tier"]), uuid, missing


def tier_lines(devices: list[dict[str, Any]]) -> list[str]:
    """For each tier of a device here, what it can trace, what it lacks, and the tracer of ray buffers."""
    from pica.rhi.adapters import TIERS
    from pica.tracing import embree

    lines = [f"tier {n}: {TIERS[n][0]}; lacks {TIERS[n][1]}" for n in sorted({device["tier"] for device in devices})]
    missing = embree.missing()
    state = f"not usable, {missing}" if missing else "ready; the default where pica runs on the processor"
    return [*lines, f"Embree (tier 1 on the processor, on any device with rays.tracer=embree): {state}"]


def stage_lines(devices: list[dict[str, Any]]) -> list[str]:
    """The features of each usable device."""
    return [f"{device['name']} runs {_stages(device['tier'])}" for device in usable(devices)]


def _stages(tier: int) -> str:
    from pica.rhi.adapters import TRACES
    from pica.tracing import embree
    from pica.tracing.fallbacks import WITHOUT_RAYS

    if tier >= TRACES:
        return "every preset and the path tracer"
    if embree.missing() is None:
        return "every preset and the path tracer, whose rays Embree traces; they pass through primitives"
    stages = ", ".join(f"{setting}={value}" for setting, value in WITHOUT_RAYS.items())
    return f"the preset raster, which others become ({stages}); no path tracer: for rays, {embree.INSTALL}"


def advice(devices: list[dict[str, Any]]) -> list[str]:
    """Advice on what to install or to expect, a line each."""
    ready = usable(devices)
    if any(device["type"] == "hardware" for device in ready):
        return ["Ready."]
    if ready:
        return ["Ready, on the processor alone. With a graphics card: install its maker's Vulkan driver."]
    return [
        "No device that pica can use. With a graphics card: install its maker's Vulkan driver.",
        f"Without one, install Mesa's lavapipe, which runs on the processor: {_lavapipe()}",
    ]


def _lavapipe() -> str:
    try:
        release = platform.freedesktop_os_release()
    except OSError:  # not Linux
        return "see mesa3d.org"
    systems = [release.get("ID", ""), *release.get("ID_LIKE", "").split()]
    return next((_LAVAPIPE[name] for name in systems if name in _LAVAPIPE), "your distribution's Mesa, 24.3 or newer")


def _version(package: str) -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(package)
    except PackageNotFoundError:
        return "(not installed)"


def _cache_folders() -> dict[str, str]:
    try:
        from pica.caches.places import caches
    except ImportError:  # SlangPy is not installed
        return {}
    return {"shader cache": str(caches() or "nowhere")}

"""One hybrid frame on one and on several devices: milliseconds of frames, passes and copies, as one JSON object.

    python benchmarks/several_devices.py [--scene machine_world] [--size 1920x1080 ...] [--frames 20] [--device NAME]

The camera orbits what it looks at. Ways: "pipeline", one device as it is by default; "buffers", one device with ray
buffers; "two logical devices", the same adapter opened twice, which shows what sharing costs; "two cards", where there
are two adapters of one name. Rays are shared however slow that is. Medians of the frames after ten; `copies` has the
bytes and milliseconds of a frame by name, `shares` which part of the rays each device traced in the end, `rays` how
many a frame has. A line for each way goes to stderr; `--json FILE` writes the object to a file.
"""

import argparse
import json
import math
import sys
import time
from collections import defaultdict
from pathlib import Path
from statistics import median
from typing import Any

import pica
from pica.rhi.adapters import adapters
from pica.rhi.device import Device, open_device
from pica.scene.orbit import orbited, pivot
from pica.tracing import balance

WARM_UP = 10
PRESETS = {
    "balanced": pica.Settings.preset("balanced"),
    "quality": pica.Settings.preset("quality"),
    "four rays": pica.Settings.preset("quality").with_values(
        {"ambient_occlusion.mode": "ray_traced", "ambient_occlusion.rays": 4, "shadows.max_lights": 8}
    ),
}


def ways(device: Device) -> dict[str, list[Any]]:
    """The devices of each way but "pipeline"."""
    uuid = device.info.uuid
    found: dict[str, list[Any]] = {"buffers": [device], "two logical devices": [device, Device(uuid)]}
    others = [each for each in adapters() if each.name == device.name and bytes(each.luid).hex() != uuid]
    if others:
        found["two cards"] = [device, bytes(others[0].luid).hex()]
    return found


def measured(renderer: pica.Renderer, frames: int) -> dict[str, Any]:
    """A frame's milliseconds by the clock, of the host, by pass and by copy."""
    camera = renderer.scene.default_camera(renderer.size[0] / renderer.size[1])
    center, profiler, host = pivot(renderer.scene, camera), renderer.device.profiler, []
    started = time.perf_counter()
    for number in range(WARM_UP + frames):
        if number == WARM_UP:
            profiler.flush()
            profiler.finished.clear()
            started = time.perf_counter()
        renderer.advance(orbited(camera, center, math.radians(0.5) * number))
        host.append(renderer.host_seconds * 1e3)
    profiler.flush()
    wall = (time.perf_counter() - started) / frames * 1e3
    times = list(profiler.finished)
    passes = {name: median(each.get(name, 0.0) for each in times) for name in times[-1]}
    copies: defaultdict[str, dict[str, float]] = defaultdict(lambda: {"bytes": 0, "ms": 0.0})
    for node in renderer.graph.passes:
        if node.bytes is not None:
            copies[node.name]["bytes"] += node.bytes
            copies[node.name]["ms"] += node.milliseconds or 0.0
    found = {"frame": wall, "host": median(host[WARM_UP:]), "passes": passes, "copies": copies}
    shared = getattr(renderer.tracer, "balance", None)
    if shared is not None:
        found["shares"] = shared.shares.tolist()
    found["rays"] = renderer.count_rays(camera)
    return found


def path_traced(scene: pica.Scene, size: tuple[int, int], devices: list[Any]) -> float:
    """Milliseconds of a path traced sample."""
    with pica.PathTracer(scene, size=size, devices=devices) as tracer:
        tracer.render(4, aovs=())
        started = time.perf_counter()
        tracer.render(32, aovs=())
        return (time.perf_counter() - started) / 32 * 1e3


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", default="machine_world")
    parser.add_argument("--size", nargs="*", default=["1920x1080", "3840x2160"])
    parser.add_argument("--presets", nargs="*", default=list(PRESETS))
    parser.add_argument("--frames", type=int, default=20)
    parser.add_argument("--device")
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    balance.TRIAL = sys.maxsize
    device, scene = open_device(arguments.device), getattr(pica.scenes, arguments.scene)()
    devices = ways(device)
    found: dict[str, Any] = {"device": device.name, "scene": arguments.scene, "frames": {}, "path_traced": {}}
    for text in arguments.size:
        width, height = (int(length) for length in text.split("x"))
        for preset in arguments.presets:
            for way in ("pipeline", *devices):
                buffers = {} if way == "pipeline" else {"rays.scheduler": "buffers", "rays.tracer": "device"}
                settings = PRESETS[preset].with_values(buffers)
                on = devices.get(way, [device])
                with pica.Renderer(scene, size=(width, height), settings=settings, devices=on) as renderer:
                    costs = found["frames"].setdefault(text, {}).setdefault(preset, {})[way] = measured(
                        renderer, arguments.frames
                    )
                print(f"{text}, {preset}, {way}: {costs['frame']:.2f} ms a frame", file=sys.stderr)
        for way, on in devices.items():
            found["path_traced"].setdefault(text, {})[way] = path_traced(scene, (width, height), on)
    text = json.dumps(found, indent=1)
    if arguments.json is None:
        print(text)
    else:
        arguments.json.write_text(text)


if __name__ == "__main__":
    main()

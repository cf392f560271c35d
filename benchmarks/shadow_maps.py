"""Shadow maps of machine_world: what they cost while the camera, or everything, moves.

    python benchmarks/shadow_maps.py [--size 1920x1080] [--frames 200] [--device NAME] [--settings GROUP.NAME=VALUE ...]

Prints one JSON line a case; milliseconds of the GPU. "sun": the directional light alone, with its cascades; "all": as
many lights as have maps. Each with a still camera, with one that flies round the scene in 20 seconds of 60 frames, and
with that and all machines at work, so that all maps are drawn in every frame.
"""

import argparse
import json
import math
from statistics import fmean, median

import numpy as np

import pica
from pica.rhi.device import Device
from pica.scene.light import DirectionalLight
from pica.scene.model import Scene
from pica.scenes.machine_world import machine_world

_PASSES = ("shadow map culling", "shadow maps", "shadow map lookup")
_FRAMES_A_ROUND = 1200


def lit(sun_alone: bool) -> Scene:
    """The scene, with the sun as the only light with a place or a direction where asked for."""
    scene = machine_world()
    for node in scene.nodes():
        if sun_alone and node.light is not None and not isinstance(node.light, DirectionalLight):
            node.light = None
    return scene


def orbit(scene: Scene, aspect: float, frame: int) -> pica.Camera:
    """The scene's camera, turned about the point that it looks at."""
    first = scene.default_camera(aspect)
    target = first.transform[:3, 3] - first.transform[:3, 2] * 6.0
    angle = 2 * math.pi * frame / _FRAMES_A_ROUND
    offset = first.transform[:3, 3] - target
    turned = np.array(
        [
            offset[0] * math.cos(angle) + offset[2] * math.sin(angle),
            offset[1],
            offset[2] * math.cos(angle) - offset[0] * math.sin(angle),
        ]
    )
    return pica.Camera.look_at(target + turned, target, vertical_fov=first.vertical_fov, near=first.near)


def measure(device: Device, size: tuple[int, int], frames: int, case: dict[str, object]) -> dict[str, object]:
    """GPU milliseconds of each pass and of all of them, a frame."""
    scene = lit(case["lights"] == "sun")
    values = {"visibility.primary": "rays", "lighting.environment": "prefiltered", "shadows.method": "maps"}
    settings = pica.Settings().with_values(values | case["settings"])
    renderer = pica.Renderer(scene, size=size, settings=settings, device=device)
    aspect = size[0] / size[1]
    host: list[float] = []
    for frame in range(frames + 20):
        if frame == 20:
            device.profiler.flush()
            device.profiler.finished.clear()
            host.clear()
        if case["machines"]:
            scene.animate(frame / 60)
        renderer.advance(orbit(scene, aspect, frame if case["camera"] else 0))
        host.append(renderer.host_seconds * 1e3)
    device.profiler.flush()
    measured = list(device.profiler.finished)
    totals = [sum(times.get(name, 0.0) for name in _PASSES) for times in measured]
    drawn = [times["shadow maps"] for times in measured if "shadow maps" in times]
    return {
        **case,
        "frames": len(measured),
        "frames_that_drew": len(drawn),
        "all_ms": {"mean": fmean(totals), "median": median(totals), "largest": max(totals)},
        "draw_ms": {"mean": fmean(drawn), "largest": max(drawn)} if drawn else None,
        "lookup_ms": median(times["shadow map lookup"] for times in measured),
        "host_ms": median(host),
    }


def main() -> None:
    """Measure all cases."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", default="1920x1080")
    parser.add_argument("--frames", type=int, default=200)
    parser.add_argument("--device")
    parser.add_argument("--settings", nargs="*", default=[], metavar="GROUP.NAME=VALUE")
    arguments = parser.parse_args()
    width, height = (int(length) for length in arguments.size.split("x"))
    device = Device(arguments.device)
    given = dict(setting.split("=", 1) for setting in arguments.settings)
    for lights in ("sun", "all"):
        for mode in ("soft", "hard"):
            for camera, machines in ((False, False), (True, False), (True, True)):
                case: dict[str, object] = {"lights": lights, "camera": camera, "machines": machines}
                case["settings"] = {"shadows.mode": mode, **given}
                result = measure(device, (width, height), arguments.frames, case)
                print(json.dumps({"device": device.name, "size": [width, height], **result}), flush=True)


if __name__ == "__main__":
    main()

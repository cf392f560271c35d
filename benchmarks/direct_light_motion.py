"""Direct light in motion: how far single frames are from the path tracer, and what a frame costs then.

    python benchmarks/direct_light_motion.py [--size 240x135] [--time 1920x1080] [--samples 1024]
        [--set GROUP.NAME=VALUE]

FLIP of the frames 0, 3 and 15 of three sequences, the first frames of a start or after a cut among them, against path
traced pictures of depth 2; and the GPU milliseconds of the passes while the camera turns round machine_world, when
filters have work that a still picture spares them. `--size none` or `--time none` leaves one of both out.
"""

import argparse
import json
from statistics import median

import numpy as np

import pica
from benchmarks.many_lights import CAMERA, DIRECT, bazaar
from pica.quality.picture_errors import compare
from pica.quality.sequences import Sequence, sequence
from pica.rhi.device import Device, open_device
from pica.scene.model import Scene

SPEEDS = {"orbit": 0.25, "objects": 1 / 60}
"""Degrees and seconds a frame."""
FRAMES = 0, 3, 15
TIMED = 60


def played(name: str, size: tuple[int, int]) -> tuple[Scene, Sequence]:
    """A scene, and what happens in it."""
    if name == "bazaar, 1,000 lights":
        scene = bazaar(1000)
        return scene, sequence("orbit", scene, CAMERA, speed=SPEEDS["orbit"])
    scene = pica.scenes.machine_world()
    return scene, sequence(name, scene, scene.default_camera(size[0] / size[1]), speed=SPEEDS[name])


def errors(device: Device, name: str, size: tuple[int, int], settings: pica.Settings, samples: int) -> list[float]:
    """FLIP of FRAMES."""
    scene, play = played(name, size)
    renderer = pica.Renderer(scene, size=size, settings=settings, device=device)
    pictures = {}
    for frame in range(FRAMES[-1] + 1):
        picture = renderer.advance(play(frame))["color"]
        if frame in FRAMES:
            pictures[frame] = np.ascontiguousarray(picture.to_numpy()[..., :3], np.float32)
    found = []
    for frame, picture in pictures.items():
        with pica.PathTracer(scene, size=size, max_depth=2, device=device) as tracer:
            found.append(round(compare(tracer.render(samples, camera=play(frame)).color, picture).flip, 4))
    return found


def times(device: Device, size: tuple[int, int], settings: pica.Settings) -> dict[str, float]:
    """Median GPU milliseconds by pass while the camera turns."""
    scene, play = played("orbit", size)
    renderer = pica.Renderer(scene, size=size, settings=settings, device=device)
    device.profiler.flush()
    device.profiler.finished.clear()
    for frame in range(TIMED):
        renderer.advance(play(frame))
    device.profiler.flush()
    rows = list(device.profiler.finished)[TIMED // 4 :]
    found = {name: round(median(row[name] for row in rows if name in row), 3) for name in rows[-1]}
    return {**found, "frame": round(median(sum(row.values()) for row in rows), 3)}


def main() -> None:
    """Measure and print, one JSON line a sequence."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", default="240x135")
    parser.add_argument("--time", default="1920x1080")
    parser.add_argument("--samples", type=int, default=1024)
    parser.add_argument("--set", action="append", default=[], metavar="GROUP.NAME=VALUE")
    arguments = parser.parse_args()
    values = dict(value.split("=", 1) for value in arguments.set)
    settings = pica.Settings().with_values({**DIRECT, **values})
    device = open_device()

    def pixels(size: str) -> tuple[int, int]:
        width, height = size.split("x")
        return int(width), int(height)

    for name in ("orbit", "objects", "bazaar, 1,000 lights") if arguments.size != "none" else ():
        flip = errors(device, name, pixels(arguments.size), settings, arguments.samples)
        print(json.dumps({"sequence": name, "flip": dict(zip(FRAMES, flip, strict=True))}), flush=True)
    if arguments.time != "none":
        print(json.dumps({"gpu_ms": times(device, pixels(arguments.time), settings)}), flush=True)


if __name__ == "__main__":
    main()

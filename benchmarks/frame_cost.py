"""What a frame costs at rest and on an orbit: GPU and host milliseconds, memory by effect.

    python benchmarks/frame_cost.py [SCENE ...] [--size 1920x1080] [--degrees 0.5] [--json FILE]

Medians of 100 frames after 60. The camera orbits what it looks at by so many degrees a frame.
"""

import argparse
import json
import math
from pathlib import Path
from statistics import median
from typing import Any

import pica
from pica.scene.camera import Camera
from pica.scene.orbit import orbited, pivot

WARM_UP, FRAMES = 60, 100


def timed(renderer: pica.Renderer, cameras: list[Camera]) -> dict[str, Any]:
    """Milliseconds of the frames after WARM_UP."""
    profiler, host = renderer.device.profiler, []
    for number, camera in enumerate(cameras):
        if number == WARM_UP:
            profiler.flush()
            profiler.finished.clear()
        renderer.advance(camera)
        if number >= WARM_UP:
            host.append(renderer.host_seconds * 1e3)
    profiler.flush()
    measured = list(profiler.finished)
    passes = {name: median(times[name] for times in measured if name in times) for name in measured[-1]}
    return {"gpu": median(sum(times.values()) for times in measured), "host": median(host), "passes": passes}


def cost(name: str, size: tuple[int, int], degrees: float) -> dict[str, Any]:
    """What frames of a built-in scene cost."""
    scene = getattr(pica.scenes, name)()
    camera = scene.default_camera(size[0] / size[1])
    center = pivot(scene, camera)
    with pica.Renderer(scene, size=size) as renderer:
        found: dict[str, Any] = {"device": renderer.device_name}
        for way, step in (("rest", 0.0), ("orbit", math.radians(degrees))):
            found[way] = timed(renderer, [orbited(camera, center, step * i) for i in range(WARM_UP + FRAMES)])
        found["memory"] = renderer.device.memory
        found["memory_by_effect"] = renderer.graph.as_dict()["memory"]
    return found


def main() -> None:
    """Measure, and print a line for each scene."""
    parser = argparse.ArgumentParser()
    parser.add_argument("scenes", nargs="*", default=["machine_world", "corridor", "rooms"])
    parser.add_argument("--size", default="1920x1080")
    parser.add_argument("--degrees", type=float, default=0.5)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    width, height = map(int, arguments.size.split("x"))
    found = {name: cost(name, (width, height), arguments.degrees) for name in arguments.scenes}
    for name, costs in found.items():
        times = ", ".join(
            f"{way}: GPU {costs[way]['gpu']:.2f} ms, host {costs[way]['host']:.2f} ms" for way in ("rest", "orbit")
        )
        print(f"{name} on {costs['device']}: {times}; {costs['memory'] / 1e6:.0f} MB")
    if arguments.json is not None:
        arguments.json.write_text(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()

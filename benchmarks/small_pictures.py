"""Small pictures as data sets have them: many views, each a picture of its own, or labels alone.

    python benchmarks/small_pictures.py
    python benchmarks/small_pictures.py cornell FlightHelmet.gltf --sizes 128 --views 50 --passes

A picture is `reset` and `render(frames=1, aovs=...)` with colours, depth and ids fetched; labels are depth, normals and
ids by `labels`. Milliseconds are medians over the views: by the clock; of the processor in all threads, which says more
on a machine that is busy with other work; of the host until the last of a frame is submitted; of the passes together;
and of Embree.
"""

import argparse
import os
import time
import warnings
from collections import defaultdict
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from statistics import median

import numpy as np

import pica
from pica import Camera, Frame, Renderer, Scene
from pica.scenes.placing import move, rotate

SCENES = "cornell", "sphere_grid"
WARM_UP = 5
SWEEP = 20  # degrees to either side


def picture(renderer: Renderer, view: Camera) -> Frame:
    """A picture as a new renderer's first, with what a data set has of it."""
    renderer.reset()
    frame = renderer.render(frames=1, camera=view, aovs=("depth", "instance"))
    _ = frame.display, frame.aov("depth"), frame.aov("instance")
    return frame


def labels(renderer: Renderer, view: Camera) -> Frame:
    """What is seen and where, without light."""
    frame = renderer.labels(camera=view, aovs=("depth", "normal", "instance"))
    _ = frame.aov("depth"), frame.aov("normal"), frame.aov("instance")
    return frame


WAYS: dict[str, Callable[[Renderer, Camera], Frame]] = {"picture": picture, "labels": labels}


def views(scene: Scene, count: int) -> list[Camera]:
    """Cameras to the left and right of the scene's own, at its middle's distance."""
    first = scene.default_camera(1.0)
    x, y, z = np.mean(scene.bounds(), axis=0)
    angles = SWEEP * np.sin(np.arange(count) * 2.4)
    return [
        replace(first, transform=move(x, y, z) @ rotate("y", float(angle)) @ move(-x, -y, -z) @ first.transform)
        for angle in angles
    ]


def measure(renderer: Renderer, way: str, cameras: list[Camera]) -> tuple[dict[str, float], dict[str, float]]:
    """Median milliseconds of the parts, and of each pass."""
    parts: defaultdict[str, list[float]] = defaultdict(list)
    passes: defaultdict[str, list[float]] = defaultdict(list)
    warm_up = cameras[:WARM_UP]
    for number, camera in enumerate([*warm_up, *cameras]):
        clock, processor = time.perf_counter(), time.process_time()
        timings = dict(WAYS[way](renderer, camera).timings)
        clock, processor = time.perf_counter() - clock, time.process_time() - processor
        if number < len(warm_up):
            continue
        parts["clock"].append(clock * 1e3)
        parts["processor"].append(processor * 1e3)
        parts["host"].append(renderer.host_seconds * 1e3)
        parts["embree"].append(timings.pop("embree", 0.0))
        parts["passes"].append(sum(timings.values()))
        for name, milliseconds in timings.items():
            passes[name].append(milliseconds)
    medians = ({name: median(values) for name, values in found.items()} for found in (parts, passes))
    least = {"least clock": min(parts["clock"])}
    first, second = medians
    return first | least, second


def main() -> None:
    """Print a line for each scene, size and way."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=SCENES, metavar="SCENE", help="built-in names or files")
    parser.add_argument("--sizes", nargs="+", type=int, default=(16, 128))
    parser.add_argument("--views", type=int, default=50)
    parser.add_argument("--set", action="append", default=[], metavar="SETTING=VALUE")
    parser.add_argument("--passes", action="store_true", help="each pass too")
    given = parser.parse_args()
    settings = pica.Settings().with_values(dict(pair.split("=", 1) for pair in given.set))
    warnings.simplefilter("ignore")
    for name in given.scenes:
        scene = pica.load(name) if os.path.exists(name) else getattr(pica.scenes, name)()
        cameras = views(scene, given.views)
        for size in given.sizes:
            with Renderer(scene, size=(size, size), settings=settings) as renderer:
                for way in WAYS:
                    parts, passes = measure(renderer, way, cameras)
                    text = ", ".join(f"{part} {milliseconds:.1f}" for part, milliseconds in parts.items())
                    rate = 1e3 / parts["clock"]
                    load = os.getloadavg()[0]
                    print(
                        f"{Path(name).stem} {size}x{size} {way}: {rate:.1f} a second; ms: {text}; load {load:.1f}",
                        flush=True,
                    )
                    if given.passes:
                        for each, milliseconds in sorted(passes.items(), key=lambda item: -item[1]):
                            print(f"    {each} {milliseconds:.2f}")


if __name__ == "__main__":
    main()

"""pica beside Cycles and Mitsuba 3: seconds a picture against FLIP, all in one go on one machine.

    PYTHONPATH=. python benchmarks/peers.py FlightHelmet.gltf --env courtyard.hdr --peers DIR [--peer-python PYTHON]
        [--size 640x360] [--frames 5] [--reference 1024] [--out out/peers] [--only pica]

FlightHelmet on a 10 m plane under the sun and an environment. DIR has cycles_bench.py and mitsuba_bench.py, which
PYTHON runs: it needs bpy, mitsuba and pyoidn; Matplotlib draws here. Paths have at most 5 edges in all three. The
camera stands elsewhere for each picture. pica's hybrid frames come twice, with all light, of paths without a limit, and
with direct light alone. Seconds are the median of all pictures but the first; FLIP is against many samples of the
renderer itself, since each has materials of its own. Open Image Denoise: "fast" is its small network
with features as they come, else the large one with prefiltered features (Mitsuba's script: with features of 8 samples).
Writes peers.json and peers.png into --out.
"""

import argparse
import json
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

import pica
from benchmarks.flight_helmet import helmet_on_plane
from benchmarks.many_lights import DIRECT as WITHOUT_OTHERS
from pica.images.pictures import read_radiance
from pica.quality import compare

DEPTH = 5
ALL = "all light, 5 edges"
DIRECT = "direct light (2 edges)"
VIEW = "--cam-pos 0.7,0.6,1.2 --cam-target 0,0.34,0 --vfov 35 --ground 10 --sun-dir 0.5,0.8,0.4 --sun-angle 5"
SHARED = [*VIEW.split(), "--sun-irradiance", "3,3,3", "--max-depth", str(DEPTH), "--spp", "1,4"]
WAYS = {"none": "", "oidn": " + OIDN", "oidn-fast": " + OIDN fast"}


@dataclass
class Point:
    """One way to a picture."""

    renderer: str
    way: str
    light: str
    seconds: float
    flip: float


def orbit(number: int) -> pica.Camera:
    """The peers' camera, a degree about the helmet further with each picture."""
    turn = np.radians(number)
    x, z = 0.7 * np.cos(turn) + 1.2 * np.sin(turn), -0.7 * np.sin(turn) + 1.2 * np.cos(turn)
    return pica.Camera.look_at((x, 0.6, z), (0.0, 0.34, 0.0), vertical_fov=np.radians(35.0))


def times(shoot: Any, frames: int) -> tuple[NDArray[np.float32], float]:
    """The last picture, at the place of the reference, and the median seconds of all but the first."""
    seconds = []
    for number in reversed(range(frames)):
        started = time.perf_counter()
        picture = shoot(orbit(number)).color
        seconds.append(time.perf_counter() - started)
    return picture, median(seconds[1:])


def ours(arguments: argparse.Namespace, size: tuple[int, int]) -> list[Point]:
    """pica's points."""
    scene, _ = helmet_on_plane(arguments.path, arguments.env)
    points = []

    def add(renderer: str, way: str, light: str, found: tuple[NDArray[np.float32], float]) -> None:
        points.append(Point(renderer, way, light, found[1], compare(truths[light], found[0]).flip))
        print(points[-1], flush=True)

    other = pica.Settings().with_values({"seed": "77"})
    truths = {}
    for light, depth in ((DIRECT, 2), (ALL, DEPTH)):
        with pica.PathTracer(scene, size=size, max_depth=depth, settings=other) as tracer:
            truths[light] = tracer.render(arguments.reference, camera=orbit(0)).color
    for light, settings in ((DIRECT, pica.Settings().with_values(WITHOUT_OTHERS)), (ALL, pica.Settings())):
        for frames in (1, 4):
            with pica.Renderer(scene, size=size, settings=settings) as renderer:
                found = times(lambda camera, n=frames, by=renderer: by.render(n, camera=camera), arguments.frames)
                add("pica, hybrid", f"{frames} frame{'s' * (frames > 1)}", light, found)
    with pica.PathTracer(scene, size=size, max_depth=DEPTH) as tracer:
        for samples in (1, 4):
            for denoise, mark in ((False, ""), ("fast", " + OIDN fast"), (True, " + OIDN")):

                def shoot(camera: pica.Camera, samples: int = samples, denoise: Any = denoise) -> pica.Frame:
                    return tracer.render(samples, camera=camera, denoise=denoise)

                add("pica, path traced", f"{samples}{mark}", ALL, times(shoot, arguments.frames))
    return points


def theirs(name: str, arguments: argparse.Namespace) -> list[Point]:
    """A peer's points, by its script."""
    out = arguments.out / name
    command = [arguments.peer_python, str(Path(arguments.peers) / f"{name}_bench.py"), arguments.path, *SHARED]
    command += ["--env", arguments.env, "--size", arguments.size, "--frames", str(arguments.frames)]
    command += ["--denoise", "none,oidn-fast,oidn", "--reference", str(arguments.reference), "--out", str(out)]
    said = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout
    results = [json.loads(line) for line in said.splitlines() if line.startswith("{")]
    for result in results:
        if "error" in result:
            raise SystemExit(f"{name}: {result['error']}")
    truth = next(read_radiance(Path(result["exr"])) for result in results if result["kind"] == "ref")[..., :3]
    points = []
    for result in results:
        if result["kind"] != "ref":
            flip = compare(truth, read_radiance(Path(result["exr"]))[..., :3]).flip
            way = f"{result['spp']}{WAYS[result['denoise']]}"
            points.append(Point(name.capitalize(), way, ALL, result["wall_s_per_further_frame"], flip))
            print(points[-1], flush=True)
    return points


def plot(points: list[Point], title: str, file: Path) -> None:
    """Seconds against FLIP; a line for each renderer and light."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(9, 6))
    for name, light in dict.fromkeys((point.renderer, point.light) for point in points):
        own = [point for point in points if (point.renderer, point.light) == (name, light)]
        marker = "s--" if light == DIRECT else "o"
        axes.plot([point.seconds for point in own], [point.flip for point in own], marker, label=f"{name}: {light}")
        for point in own:
            axes.annotate(point.way, (point.seconds, point.flip), (4, 4), textcoords="offset points", fontsize=7)
    axes.set(xscale="log", yscale="log", title=title)
    axes.set(xlabel="seconds a picture", ylabel="mean FLIP against many samples of the same light")
    axes.grid(True, which="both", alpha=0.3)
    axes.legend()
    figure.savefig(file, dpi=110, bbox_inches="tight")


def main() -> None:
    """Run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("path")
    parser.add_argument("--env", required=True)
    parser.add_argument("--peers", required=True)
    parser.add_argument("--peer-python", default=sys.executable)
    parser.add_argument("--size", default="640x360")
    parser.add_argument("--frames", type=int, default=5)
    parser.add_argument("--reference", type=int, default=1024)
    parser.add_argument("--out", type=Path, default=Path("out/peers"))
    parser.add_argument("--only", choices=["pica", "cycles", "mitsuba"])
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    width, height = (int(length) for length in arguments.size.split("x"))
    points = []
    for name in ("pica", "cycles", "mitsuba"):
        if arguments.only in (None, name):
            points += ours(arguments, (width, height)) if name == "pica" else theirs(name, arguments)
    result = {"size": arguments.size, "reference": arguments.reference, "points": [vars(point) for point in points]}
    (arguments.out / "peers.json").write_text(json.dumps(result, indent=2))
    plot(points, f"FlightHelmet on its plane, {arguments.size}", arguments.out / "peers.png")


if __name__ == "__main__":
    main()

"""Time against error in motion of every preset, as a table and a plot: docs/measurements/presets.md.

    PYTHONPATH=. python benchmarks/presets.py [SCENE ...] [--size 480x270] [--samples 2048] [--timed 1920x1080]
        [--presets NAME,NAME] [--plot FILE.svg]

FLIP and mean are of the 24th frame of a camera that turns by a degree a frame, as benchmarks/motion.py has them, in
pictures of --size; milliseconds are of a frame of the same motion in pictures of --timed: of the GPU, on a processor of
the host.
"""

import argparse
from pathlib import Path
from statistics import median
from time import perf_counter

import pica
from benchmarks.motion import MOVING, Bench, errors, made, played
from pica.frame.context import Size
from pica.quality.benchmark import benchmark
from pica.quality.sequences import sequence
from pica.rhi.device import open_device

SCENES = "machine_world", "corridor", "rooms"
FRAMES, WARM_UP, SOFTWARE_FRAMES = 60, 20, 8
COLORS = "#0969da", "#cf222e", "#1a7f37", "#8250df", "#9a6700"
WIDTH, HEIGHT, MARGIN = 640, 400, 56
"""Pixels of the plot."""

Row = tuple[str, str, float, float, float]
"""Scene, preset, milliseconds, FLIP, mean."""


def milliseconds(bench: Bench, name: str, size: Size) -> float:
    """The median of a moving frame."""
    scene = made(name)
    camera = scene.default_camera(size[0] / size[1])
    play = sequence("orbit", scene, camera, speed=1.0)
    with pica.Renderer(scene, size=size, settings=bench.settings, device=bench.device) as renderer:
        if not bench.device.is_software:
            return float(benchmark(renderer, frames=FRAMES, warm_up=WARM_UP, play=play)["gpu_ms"]["frame"])
        times = []
        for frame in range(SOFTWARE_FRAMES + 3):
            start = perf_counter()
            renderer.render(1, camera=play(frame), aovs=())
            times.append(1e3 * (perf_counter() - start))
    return median(times[3:])


def measured(bench: Bench, name: str, preset: str, timed: Size) -> Row:
    """One preset in one scene."""
    scene = made(name)
    camera = scene.default_camera(bench.size[0] / bench.size[1])
    halves = bench.reference(name, scene, camera, bench.size)
    orbit = sequence("orbit", scene, camera, speed=1.0)
    with pica.Renderer(scene, size=bench.size, settings=bench.settings, device=bench.device) as renderer:
        found = errors(halves, played(renderer, orbit, range(1 - MOVING, 1)))
    return name, preset, milliseconds(bench, name, timed), found["flip"], found["mean"]


def plot(rows: list[Row], device: str) -> str:
    """An SVG picture: milliseconds to the right, FLIP upwards, a line for each scene, presets by their initials.

    Without raster, which has no indirect light here.
    """
    rows = [row for row in rows if row[1] != "raster"]
    most_time, most_error = 1.1 * max(row[2] for row in rows), 1.1 * max(row[3] for row in rows)
    across, up = WIDTH - 2 * MARGIN, HEIGHT - 2 * MARGIN
    names = ", ".join(dict.fromkeys(row[1] for row in rows))
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" font-family="sans-serif"'
        ' font-size="11">',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
        f'<path d="M{MARGIN} {MARGIN}V{HEIGHT - MARGIN}H{WIDTH - MARGIN}" fill="none" stroke="#57606a"/>',
        f'<text x="{MARGIN}" y="{MARGIN - 12}">FLIP in motion, {device}: {names}</text>',
        f'<text x="{WIDTH - MARGIN}" y="{HEIGHT - 16}" text-anchor="end">milliseconds a frame</text>',
    ]
    for step in range(1, 5):
        x, y = MARGIN + across * step / 4, HEIGHT - MARGIN - up * step / 4
        lines.append(
            f'<text x="{x:.0f}" y="{HEIGHT - MARGIN + 16}" text-anchor="middle">{most_time * step / 4:.1f}</text>'
        )
        lines.append(f'<text x="{MARGIN - 6}" y="{y + 4:.0f}" text-anchor="end">{most_error * step / 4:.3f}</text>')
    for number, scene in enumerate(dict.fromkeys(row[0] for row in rows)):
        color = COLORS[number % len(COLORS)]
        points = [
            (MARGIN + across * time / most_time, HEIGHT - MARGIN - up * error / most_error, preset)
            for name, preset, time, error, _ in rows
            if name == scene
        ]
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y, _ in sorted(points))
        lines.append(f'<polyline points="{path}" fill="none" stroke="{color}"/>')
        lines.append(f'<text x="{MARGIN + 12}" y="{HEIGHT - MARGIN - 12 - 14 * number}" fill="{color}">{scene}</text>')
        for x, y, preset in points:
            lines.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{color}"/>')
            lines.append(f'<text x="{x + 5:.1f}" y="{y - 5:.1f}">{preset[0]}</text>')
    return "\n".join([*lines, "</svg>", ""])


def main() -> None:
    """Measure, print, and draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", metavar="SCENE")
    parser.add_argument("--size", default="480x270")
    parser.add_argument("--samples", type=int, default=2048)
    parser.add_argument("--timed", default="1920x1080")
    parser.add_argument("--presets", default=",".join(pica.settings.PRESETS))
    parser.add_argument("--references", type=Path, metavar="DIR")
    parser.add_argument("--plot", type=Path, metavar="FILE.svg")
    given = parser.parse_args()
    size, timed = (tuple(int(length) for length in text.split("x")) for text in (given.size, given.timed))
    device, rows = open_device(), []
    print(f"{device.name}: milliseconds at {given.timed}, FLIP and mean at {given.size}")
    for name in given.scenes or SCENES:
        for preset in given.presets.split(","):
            bench = Bench(device, size, given.samples, pica.Settings.preset(preset), given.references)
            rows.append(measured(bench, name, preset, timed))
            print("{:14} {:12} {:8.2f} {:8.4f} {:7.3f}".format(*rows[-1]), flush=True)
    if given.plot:
        given.plot.write_text(plot(rows, device.name), encoding="utf-8")


if __name__ == "__main__":
    main()

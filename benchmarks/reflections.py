"""Reflections by roughness: PSNR of what surfaces mirror against many rays from the same G-buffer.

    python benchmarks/reflections.py [--size 480x270] [--frames 64] [--samples 4096] [--motion still] [--set NAME=VALUE]
        [--bound] [--out FOLDER]

The spheres of pica.scenes.sphere_sweep, GGX's alpha from 0 to 1 in 9 steps, metal and dielectric: dB over the pixels
of each, of the newest frame of a still picture or the mean of the last 20 frames of a sequence (`pica compare --help`),
without jitter; light is exposed as the whole picture is and sRGB encoded (docs/how-it-works/architecture.md). JSON, and
with --out a sheet. --bound adds what the exact light of the frame before would reach, moved to this frame by whichever
shift is best for each tile of 8x8 pixels, in half pixels with linear weights: no history that is found by motion
vectors, however exact, could be closer than that with one frame.
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import pica
from pica.images.pictures import write_png
from pica.quality.effects import MeasuredEffect
from pica.quality.picture_errors import exposed, exposure_for
from pica.quality.sequences import sequence
from pica.quality.sheet import sheet

MEASURED = 20
SPEEDS = {"orbit": 0.25, "objects": 1 / 60}
"""Degrees and seconds a frame."""
TILE, FARTHEST = 8, 6
"""Of --bound: pixels a side, and pixels of the longest shift each way."""
STEPS = 9


def moved_squares(before: NDArray[np.float32], now: NDArray[np.float32]) -> NDArray[np.float32]:
    """(height, width) squared errors of the frame before, each tile of it moved as suits it best."""
    height, width = now.shape[:2]
    tiles = -(-height // TILE), -(-width // TILE)
    least = np.full(tiles, np.inf, np.float32)
    best = np.zeros((height, width), np.float32)
    padded = np.pad(before, [(FARTHEST + 1, FARTHEST + 1)] * 2 + [(0, 0)], mode="edge")
    between = {(0.0, 0.0): padded}
    for down, right in ((0.5, 0.0), (0.0, 0.5), (0.5, 0.5)):
        steps = [(0, 0)] + [(int(2 * down), 0)] * (down > 0) + [(0, int(2 * right))] * (right > 0)
        steps += [(1, 1)] if down and right else []
        between[down, right] = np.mean([np.roll(padded, (-y, -x), (0, 1)) for y, x in steps], 0)
    for twice in np.ndindex(4 * FARTHEST + 1, 4 * FARTHEST + 1):
        y, x = (length // 2 + 1 for length in twice)
        source = between[twice[0] % 2 / 2, twice[1] % 2 / 2]
        square = ((source[y : y + height, x : x + width] - now) ** 2).mean(-1)
        whole = np.pad(square, [(0, tiles[0] * TILE - height), (0, tiles[1] * TILE - width)])
        sums = whole.reshape(tiles[0], TILE, tiles[1], TILE).sum((1, 3))
        better = (sums < least).repeat(TILE, 0).repeat(TILE, 1)[:height, :width]
        least = np.minimum(sums, least)
        best = np.where(better, square, best)
    return best


def decibels(squares: list[float]) -> float:
    """Of a peak of 1."""
    return round(-10 * float(np.log10(np.mean(squares))), 1)


def main() -> None:
    """Run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", default="480x270")
    parser.add_argument("--frames", type=int, default=64)
    parser.add_argument("--samples", type=int, default=4096)
    parser.add_argument("--motion", default="still")
    parser.add_argument("--set", action="append", default=[], dest="values")
    parser.add_argument("--bound", action="store_true")
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    width, height = (int(length) for length in arguments.size.split("x"))
    scene = pica.scenes.sphere_sweep()
    play = sequence(arguments.motion, scene, scene.default_camera(width / height), speed=SPEEDS.get(arguments.motion))
    settings = pica.Settings().with_values(dict(value.split("=") for value in arguments.values))
    renderer = pica.Renderer(scene, size=(width, height), settings=settings)
    measured = MeasuredEffect(renderer, "reflections")
    frames = range(arguments.frames)
    compared = frames[-1:] if arguments.motion == "still" else frames[-MEASURED:]
    squares: dict[str, list[float]] = {}
    exposure, before, changes = 0.0, None, []
    earlier, bounds = None, dict[str, list[float]]()
    for frame in frames:
        color = renderer.advance(play(frame), jittered=False, capture=lambda: {"instance", *measured.offers()})["color"]
        if frame not in compared:
            continue
        found, truth = measured.result()["reflections"], measured.reference(arguments.samples)["reflections"]
        exposure = exposure or exposure_for(np.asarray(color.to_numpy())[..., :3])
        shown, expected = exposed(found, exposure), exposed(np.nan_to_num(truth), exposure)
        there = np.isfinite(truth).all(-1)
        numbers = renderer.captured["instance"]()
        names = [node.name for node in scene.nodes()]
        square = ((shown - expected) ** 2).mean(-1)
        for number in np.unique(numbers[there]):
            squares.setdefault(names[number - 1], []).append(float(square[there & (numbers == number)].mean()))
        squares.setdefault("all", []).append(float(square[there].mean()))
        if arguments.bound and earlier is not None:
            square = moved_squares(earlier, expected)
            for number in np.unique(numbers[there]):
                bounds.setdefault(names[number - 1], []).append(float(square[there & (numbers == number)].mean()))
        earlier = expected
        if before is not None:
            changes.append(float(np.abs(shown - before)[there].mean()))
        before = shown
    result: dict[str, Any] = {name: decibels(values) for name, values in squares.items()}
    if bounds:
        result["bound"] = {name: decibels(values) for name, values in bounds.items()}
    mean = float(np.nansum(found) / np.nansum(truth))
    print(
        json.dumps(
            {"device": renderer.device_name, "mean": round(mean, 4), "flicker": np.mean(changes or [0.0]), **result}
        )
    )
    if arguments.out is not None:
        error = np.clip(5 * np.abs(shown - expected).mean(-1), 0, 1)
        page = sheet({"reflections": shown, "many rays": expected, "error x 5": error})
        arguments.out.mkdir(parents=True, exist_ok=True)
        write_png(arguments.out / f"reflections-{arguments.motion}.png", page)


if __name__ == "__main__":
    main()

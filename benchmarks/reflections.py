"""Reflections by roughness: PSNR of what surfaces mirror against many rays from the same G-buffer.

    python benchmarks/reflections.py [--size 480x270] [--frames 64] [--samples 4096] [--motion still] [--set NAME=VALUE]
        [--out FOLDER]

The spheres of pica.scenes.sphere_sweep, GGX's alpha from 0 to 1 in 9 steps, metal and dielectric: dB over the pixels
of each, of the newest frame of a still picture or the mean of the last 20 frames of a sequence (`pica compare --help`),
without jitter; light is exposed as the whole picture is and sRGB encoded, as docs/architecture.md has it. JSON, and
with --out a sheet.
"""

import argparse
import json
from pathlib import Path

import numpy as np

import pica
from pica.pictures import write_png
from pica.quality.effects import MeasuredEffect
from pica.quality.picture_errors import exposed, exposure_for
from pica.quality.sequences import sequence
from pica.quality.sheet import sheet

MEASURED = 20
STEPS = 9


def main() -> None:
    """Run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", default="480x270")
    parser.add_argument("--frames", type=int, default=64)
    parser.add_argument("--samples", type=int, default=4096)
    parser.add_argument("--motion", default="still")
    parser.add_argument("--set", action="append", default=[], dest="values")
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    width, height = (int(length) for length in arguments.size.split("x"))
    scene = pica.scenes.sphere_sweep()
    play = sequence(arguments.motion, scene, scene.default_camera(width / height))
    settings = pica.Settings().with_values(dict(value.split("=") for value in arguments.values))
    renderer = pica.Renderer(scene, (width, height), settings)
    measured = MeasuredEffect(renderer, "reflections")
    frames = range(arguments.frames)
    compared = frames[-1:] if arguments.motion == "still" else frames[-MEASURED:]
    squares: dict[str, list[float]] = {}
    exposure, before, changes = 0.0, None, []
    for frame in frames:
        color = renderer.advance(play(frame), jittered=False)["color"]
        if frame not in compared:
            continue
        found, truth = measured.result()["reflections"], measured.reference(arguments.samples)["reflections"]
        exposure = exposure or exposure_for(np.asarray(color.to_numpy())[..., :3])
        shown, expected = exposed(found, exposure), exposed(np.nan_to_num(truth), exposure)
        there = np.isfinite(truth).all(-1)
        numbers = renderer.gbuffer.aovs()["instance"].fetch()
        names = [node.name for node in scene.nodes()]
        square = ((shown - expected) ** 2).mean(-1)
        for number in np.unique(numbers[there]):
            squares.setdefault(names[number - 1], []).append(float(square[there & (numbers == number)].mean()))
        squares.setdefault("all", []).append(float(square[there].mean()))
        if before is not None:
            changes.append(float(np.abs(shown - before)[there].mean()))
        before = shown
    result = {name: round(-10 * np.log10(np.mean(values)), 1) for name, values in squares.items()}
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

"""Filtered ambient occlusion of one ray a pixel against 2048 rays: docs/measurements/ambient-occlusion.md.

    python benchmarks/ambient_occlusion_quality.py [--size 640x360] [--frames 120] [--samples 2048] [--sheets FOLDER]

machine_world, rays of 0.6 metres; one JSON line a sequence and way.
"""

import argparse
import json
from pathlib import Path

import numpy as np

import pica
from pica.quality.effects import compare_effect, error_sheet
from pica.quality.sequences import sequence
from pica.rhi.device import Device

SPEEDS = {"still": None, "orbit": 0.25, "objects": 1 / 60}
"""Degrees and seconds a frame."""


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", default="640x360")
    parser.add_argument("--frames", type=int, default=120)
    parser.add_argument("--samples", type=int, default=2048)
    parser.add_argument("--sheets", type=Path)
    arguments = parser.parse_args()
    size = tuple(int(length) for length in arguments.size.split("x"))
    device = Device()
    for mode in ("ray_traced", "ground_truth"):
        values = {"ambient_occlusion.mode": mode, "ambient_occlusion.max_distance": "0.6"}
        for motion, speed in SPEEDS.items():
            scene = pica.scenes.machine_world()
            renderer = pica.Renderer(
                scene,
                size=size,
                settings=pica.Settings().with_values(values | {"shadows.mode": "off"}),
                device=device,
            )
            play = sequence(motion, scene, scene.default_camera(size[0] / size[1]), speed=speed)
            errors = compare_effect(renderer, "ambient_occlusion", play, arguments.frames, arguments.samples)
            found = {"mode": mode, "sequence": motion, "psnr": round(float(np.mean(errors.psnr)), 2)}
            found |= {"first": round(errors.psnr[0], 2), "last": round(errors.psnr[-1], 2)}
            print(json.dumps(found | {"flicker": round(float(np.mean(errors.change)), 5)}), flush=True)
            if arguments.sheets:
                arguments.sheets.mkdir(parents=True, exist_ok=True)
                picture = arguments.sheets / f"occlusion_{mode}_{motion}.png"
                pica.images.pictures.write_png(picture, error_sheet(errors))


if __name__ == "__main__":
    main()

"""What single effects cost: the figures of docs/measurements/performance.md.

    python benchmarks/effects.py [--size 1920x1080] [--frames 200]

machine_world under one sun; one JSON line an effect and setting, with the GPU milliseconds of its passes.
"""

import argparse
import json

import numpy as np

import pica
from benchmarks.shadow_quality import LIGHTS, lit
from pica.quality.benchmark import benchmark
from pica.rhi.device import Device

VARIANTS = {
    "one sun, svgf": {"shadows.denoiser": "svgf"},
    "one sun, anisotropic": {"shadows.denoiser": "anisotropic"},
    "ambient occlusion, rays, 0.5 m": {"ambient_occlusion.mode": "ray_traced", "ambient_occlusion.max_distance": "0.5"},
    "ambient occlusion, rays, 2 m": {"ambient_occlusion.mode": "ray_traced", "ambient_occlusion.max_distance": "2"},
    "ambient occlusion, rays, 20 m": {"ambient_occlusion.mode": "ray_traced", "ambient_occlusion.max_distance": "20"},
    "ambient occlusion, GTAO": {"ambient_occlusion.mode": "ground_truth"},
}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", default="1920x1080")
    parser.add_argument("--frames", type=int, default=200)
    arguments = parser.parse_args()
    size = tuple(int(length) for length in arguments.size.split("x"))
    device = Device()
    for name, values in VARIANTS.items():
        scene = lit(pica.scenes.machine_world(), *LIGHTS["sun 0.5"])
        renderer = pica.Renderer(scene, size=size, settings=pica.Settings().with_values(values), device=device)
        measured = benchmark(renderer, frames=arguments.frames)
        times = {name: round(float(np.round(value, 4)), 4) for name, value in measured["gpu_ms"].items()}
        print(json.dumps({"effect": name, "host_ms": round(measured["host_ms"], 3), "gpu_ms": times}), flush=True)


if __name__ == "__main__":
    main()

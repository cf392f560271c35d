"""Convergence of still pictures with and without the stochastic light's filter: docs/measurements/many-lights.md.

    python benchmarks/still_pictures.py SCENE … [--env FILE] [--size 192x108] [--samples 1024] [--set NAME=VALUE …]

SCENE is a file, the name of a scene in pica.scenes, or `bazaar` with its thousand lights. One JSON line a scene and
setting: FLIP and PSNR in dB after some frames, against the path tracer at depth 2.
"""

import argparse
import json

import pica
from benchmarks.many_lights import DIRECT, bazaar
from pica.quality.metrics import flip, psnr
from pica.quality.picture_errors import exposed, exposure_for
from pica.rhi.device import Device
from pica.scene.model import Scene

FRAMES = (1, 4, 8, 16, 32, 128)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--env")
    parser.add_argument("--size", default="192x108")
    parser.add_argument("--samples", type=int, default=1024)
    parser.add_argument("--set", action="append", default=[], help="NAME=VALUE, a setting")
    arguments = parser.parse_args()
    width, height = (int(length) for length in arguments.size.split("x"))
    device = Device()
    for name in arguments.scenes:
        scene = _scene(name, arguments.env)
        camera = scene.default_camera(width / height)
        reference = (
            pica.PathTracer(scene, size=(width, height), max_depth=2, device=device)
            .render(arguments.samples, camera=camera)
            .color
        )
        exposure = exposure_for(reference)
        truth = exposed(reference, exposure)
        for filtered in ("true", "false"):
            given = dict(value.split("=", 1) for value in arguments.set)
            values = {**DIRECT, **given, "debug.filters": filtered}
            renderer = pica.Renderer(
                scene, size=(width, height), settings=pica.Settings().with_values(values), device=device
            )
            errors = {}
            for frames in FRAMES:
                renderer.reset()
                picture = exposed(renderer.render(frames, camera=camera).color, exposure)
                errors[frames] = [round(flip(truth, picture)[0], 3), round(psnr(truth, picture), 1)]
            print(json.dumps({"scene": name, "filter": filtered == "true", "flip, psnr": errors}), flush=True)


def _scene(name: str, environment: str | None) -> Scene:
    if name == "bazaar":
        return bazaar(1000)
    if hasattr(pica.scenes, name):
        made: Scene = getattr(pica.scenes, name)()
        return made
    return pica.load(name, environment=environment)


if __name__ == "__main__":
    main()

"""Ways to diffuse global illumination side by side: what each costs, and how far it is from many paths.

    python benchmarks/indirect_light.py [SCENE ...] [--modes path_traced,restir,surfels] [--size 480x270]
        [--samples 512] [--time 1920x1080] [--paths 512] [--set NAME=VALUE]

As JSON, a line a scene and mode: `ms`, GPU milliseconds of its passes at the size --time while the camera turns, and of
all of them together; of the light that surfaces reflect diffusely of others, FLIP, the root mean square error over the
mean and the mean over the reference's, after 1, 8 and 64 still frames (`still`) and of the frames 11 and 23 while the
camera or the objects move (`orbit`, `objects`). References are SAMPLES paths a pixel from the same G-buffer.
`--size none` or `--time none` leaves one of both out. MODE+map has a light map, of PATHS paths a probe, as
light_map does.
"""

import argparse
import json
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

import pica
from pica.quality.effects import MeasuredEffect
from pica.quality.picture_errors import compare
from pica.quality.sequences import sequence

_FRAMES = {"still": (0, 7, 63), "orbit": (11, 23), "objects": (11, 23)}
_SPEEDS = {"still": None, "orbit": 0.25, "objects": 1 / 60}
"""Degrees and seconds a frame."""
_TIMED = 80
_PASSES = ("indirect_", "irradiance_", "reuse_", "surfel_", "light_map_")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=["cornell", "machine_world", "rooms", "court"], metavar="SCENE")
    parser.add_argument("--modes", default="path_traced,restir,surfels")
    parser.add_argument("--size", default="480x270")
    parser.add_argument("--samples", type=int, default=512)
    parser.add_argument("--time", default="1920x1080")
    parser.add_argument("--paths", type=int, default=512)
    parser.add_argument("--set", action="append", default=[], dest="values", metavar="NAME=VALUE")
    given = parser.parse_args()
    values = dict(value.split("=", 1) for value in given.values)
    for name in given.scenes:
        references: dict[tuple[str, int], NDArray[np.float32]] = {}
        baked = pica.bake(getattr(pica.scenes, name)(), samples=given.paths) if "map" in given.modes else None
        for mode in given.modes.split(","):
            light_map = baked if mode.endswith("map") else None
            settings = pica.Settings().with_values({"global_illumination.mode": mode.removesuffix("+map"), **values})
            found: dict[str, Any] = {"scene": name, "mode": mode}
            if given.time != "none":
                found["ms"] = _times(name, _pixels(given.time), settings, light_map)
            for motion in _FRAMES if given.size != "none" else ():
                found[motion] = _errors(
                    name, motion, _pixels(given.size), settings, light_map, given.samples, references
                )
            print(json.dumps(found), flush=True)


def _pixels(size: str) -> tuple[int, int]:
    width, height = size.split("x")
    return int(width), int(height)


def _times(
    name: str, size: tuple[int, int], settings: pica.Settings, light_map: pica.LightMap | None
) -> dict[str, float]:
    scene = getattr(pica.scenes, name)()
    play = sequence("orbit", scene, scene.default_camera(size[0] / size[1]), speed=_SPEEDS["orbit"])
    renderer = pica.Renderer(scene, size=size, settings=settings, light_map=light_map)
    for frame in range(_TIMED):
        renderer.advance(play(frame))
    renderer.device.profiler.flush()
    rows = list(renderer.device.profiler.finished)[_TIMED // 4 - _TIMED :]
    own = {key for row in rows for key in row if key.startswith(_PASSES)}
    found = {key: median(row.get(key, 0.0) for row in rows) for key in sorted(own)}
    found["all"] = median(sum(row.get(key, 0.0) for key in own) for row in rows)
    return {key: round(value, 3) for key, value in found.items()}


def _errors(
    name: str,
    motion: str,
    size: tuple[int, int],
    settings: pica.Settings,
    light_map: pica.LightMap | None,
    samples: int,
    references: dict[tuple[str, int], NDArray[np.float32]],
) -> dict[int, list[float]]:
    """[FLIP, relative error, mean] by frame; `references` are kept for other modes."""
    scene = getattr(pica.scenes, name)()
    play = sequence(motion, scene, scene.default_camera(size[0] / size[1]), speed=_SPEEDS[motion])
    renderer = pica.Renderer(scene, size=size, settings=settings, light_map=light_map)
    measured = MeasuredEffect(renderer, "global_illumination")
    found = {}
    for frame in range(_FRAMES[motion][-1] + 1):
        renderer.advance(play(frame), jittered=False, capture=measured.offers)
        if frame not in _FRAMES[motion]:
            continue
        key = motion, 0 if motion == "still" else frame
        if key not in references:
            references[key] = measured.reference(samples)["diffuse_indirect"]
        there = np.isfinite(references[key])
        truth, light = (
            np.where(there, picture, 0).astype(np.float32)
            for picture in (references[key], measured.result()["diffuse_indirect"])
        )
        error = np.sqrt(np.mean((light - truth)[there] ** 2)) / truth[there].mean()
        mean = light[there].mean() / truth[there].mean()
        found[frame] = [round(float(value), 4) for value in (compare(truth, light).flip, error, mean)]
    return found


if __name__ == "__main__":
    main()

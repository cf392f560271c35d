"""Noise of one frame in motion: forty point lights, two emissive objects and a sky on one ray a pixel.

    PYTHONPATH=. python benchmarks/forty_lights.py [--samples 400] [--runs 12] [--set GROUP.NAME=VALUE]

The eighth frame of a moving camera, without antialiasing, against SAMPLES unfiltered frames from there: root mean
square error over the mean, with the shared light's filter and without. Of RUNS with other seeds `error` is the mean,
`range` the least and the largest; `bias` is the error of their mean picture, and `light` its mean over the reference's.
"""

import argparse
import json

import numpy as np
from numpy.typing import NDArray

import pica
from pica.rhi.device import Device, open_device
from pica.scene.camera import Camera
from tests.building import sky
from tests.effects.lighting.test_lighting import lamp, many_lights, stage

SIZE = (160, 120)
FRAME = 7
PLAIN = {
    "reflections.mode": "off",
    "global_illumination.mode": "off",
    "antialiasing.mode": "accumulate",
}


def camera(frame: int) -> Camera:
    """Where the camera is, a centimetre further in each frame."""
    return Camera.look_at((0.3 + 0.01 * frame, 2.2, 3.2), (0, 0.3, 0), vertical_fov=np.radians(40))


def picture(device: Device, cameras: list[Camera], values: dict[str, object]) -> NDArray[np.float32]:
    """The last of some frames."""
    scene = stage(*many_lights(40), *lamp(), environment=sky())
    renderer = pica.Renderer(scene, size=SIZE, settings=pica.Settings().with_values({**PLAIN, **values}), device=device)
    for view in cameras:
        shown = renderer.advance(view, jittered=False)["color"]
    return np.ascontiguousarray(shown.to_numpy()[..., :3], np.float32)


def main() -> None:
    """Measure and print, one JSON line with the filter and one without."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=400)
    parser.add_argument("--runs", type=int, default=12)
    parser.add_argument("--set", action="append", default=[], metavar="GROUP.NAME=VALUE")
    given = parser.parse_args()
    device = open_device()
    reference = picture(device, [camera(FRAME)] * given.samples, {"debug.filters": "false", "seed": given.runs})

    def error(found: NDArray[np.float32]) -> float:
        return float(np.sqrt(((found - reference) ** 2).mean()) / reference.mean())

    values = dict(value.split("=", 1) for value in given.set)
    for filtered in ("true", "false"):
        several = [
            picture(
                device,
                [camera(frame) for frame in range(FRAME + 1)],
                {"debug.filters": filtered, "seed": seed, **values},
            )
            for seed in range(given.runs)
        ]
        errors, mean = [error(one) for one in several], np.mean(several, 0)
        found = {
            "filter": filtered,
            "error": round(float(np.mean(errors)), 3),
            "range": [round(min(errors), 3), round(max(errors), 3)],
            "bias": round(error(mean), 3),
            "light": round(float(mean.mean() / reference.mean()), 4),
        }
        print(json.dumps(found), flush=True)


if __name__ == "__main__":
    main()

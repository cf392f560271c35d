"""Whether what moves keeps the rest of the picture from converging: machine_world with nothing but its fans turning.

    python benchmarks/spinning_fan.py [--size 192x108] [--frames 64] [--samples 1024] [--set NAME=VALUE …]
        [--sheet FILE]

FLIP against the path tracer with all light, over the part of the picture that looks the same however the fans stand,
after so many frames with still and with turning fans. One JSON object; "ratio" is to be at most 1.1.
"""

import argparse
import json

import numpy as np

import pica
from pica.quality.metrics import flip
from pica.quality.picture_errors import exposed, exposure_for
from pica.quality.sheet import sheet
from pica.rhi.device import Device
from pica.scene.model import Scene
from pica.scenes.placing import rotate

DEGREES = 5.0
"""A frame: less than a turn a second at 60 frames a second."""
OPPOSITE = 36.0
"""Degrees after which five blades stand where there were gaps."""
CHANGES = 0.03
"""Of the display's range: what differs by more between the two is not still."""
REACH = 5
"""Pixels a side over which that difference is averaged, against the references' noise."""


def turned(degrees: float) -> Scene:
    """machine_world with its fans turned."""
    scene = pica.scenes.machine_world()
    scene.animations.clear()
    turn_fans(scene, degrees)
    return scene


def turn_fans(scene: Scene, degrees: float) -> None:
    """By so many degrees more."""
    for node in scene.nodes():
        if node.name == "blades":
            node.transform = node.transform @ rotate("z", degrees)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", default="192x108")
    parser.add_argument("--frames", type=int, default=64)
    parser.add_argument("--samples", type=int, default=1024)
    parser.add_argument("--set", action="append", default=[], help="NAME=VALUE, a setting")
    parser.add_argument("--sheet", help="reference, still fans, turning fans and what counts as still, as a picture")
    arguments = parser.parse_args()
    width, height = (int(length) for length in arguments.size.split("x"))
    size = width, height
    settings = pica.Settings().with_values(dict(value.split("=", 1) for value in arguments.set))
    device, camera = Device(), turned(0).default_camera(width / height)
    truths = [
        pica.PathTracer(turned(degrees), size=size, device=device).render(arguments.samples, camera=camera).color
        for degrees in (0, OPPOSITE)
    ]
    exposure = exposure_for(truths[0])
    still = _around(np.abs(exposed(truths[0], exposure) - exposed(truths[1], exposure)).max(-1)) < CHANGES
    truth = exposed((truths[0] + truths[1]) / 2, exposure)
    pictures, errors = {}, {}
    for name, degrees in (("still", 0.0), ("turning", DEGREES)):
        scene = turned(0)
        renderer = pica.Renderer(scene, size=size, settings=settings, device=device)
        for _ in range(arguments.frames):
            if degrees:  # a transform that is set counts as a change
                turn_fans(scene, degrees)
            picture = renderer.render(1, camera=camera).color
        pictures[name] = exposed(picture, exposure)
        errors[name] = float(flip(truth, pictures[name])[1][still].mean())
    if arguments.sheet:
        shown = {"path traced": truth, **pictures, "still part": still.astype(np.float32)}
        pica.images.pictures.write_png(arguments.sheet, sheet(shown))
    print(json.dumps({
        "still part": round(float(still.mean()), 3),
        "flip": {name: round(error, 4) for name, error in errors.items()},
        "ratio": round(errors["turning"] / errors["still"], 3),
    }))  # fmt: skip


def _around(values: np.ndarray) -> np.ndarray:
    padded = np.pad(values, REACH // 2, mode="edge")
    return np.lib.stride_tricks.sliding_window_view(padded, (REACH, REACH)).mean((-1, -2))


if __name__ == "__main__":
    main()

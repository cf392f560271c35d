"""Random scenes, hybrid frames against the path tracer: what no scene of the repository shows.

    PYTHONPATH=. python benchmarks/random_scenes.py FIRST COUNT [--glass] [--textures] [--size 240x135]
        [--samples 512] [--sheets DIR] [--json]

Scenes of `random_scene.py` by seed. A row has FLIP, and the mean luminance over the reference's, clipped at display
white, of the 64th and 2nd frame at rest and of the 24th of a camera that turns by a degree a frame; the noise of the
reference (FLIP between its halves, twice as far apart as it is from the truth); and the nodes that are most off at
rest. --sheets writes a picture a scene: path traced, 64th, 24th moving; below 2nd frame, and errors, too bright in red
and too dark in blue.
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import pica
from benchmarks.random_scene import random_scene
from pica.color import luminance, srgb_encode
from pica.frame.context import Size
from pica.images.pictures import write_png
from pica.quality.picture_errors import compare
from pica.quality.playback import last_frame
from pica.quality.sequences import sequence
from pica.rhi.device import Device, open_device
from pica.scene.model import Scene

Pixels = NDArray[np.float32]

RESTING, MOVING, DEGREES = (2, 64), 24, 1.0
LEAST_SHARE, SHOWN = 0.002, 4
"""Of the picture, from which on a node counts; nodes of a row."""
DARK = 0.05
"""Of the picture's mean, added to what errors of nodes are relative to."""


def measured(device: Device, scene: Scene, seed: int, size: Size, samples: int, sheets: Path | None) -> dict[str, Any]:
    """The row of a scene, which `seed` names."""
    camera = scene.default_camera(size[0] / size[1])
    halves = []
    for noise in range(2):
        settings = pica.Settings().with_values({"seed": noise})
        with pica.PathTracer(scene, size=size, settings=settings, device=device) as tracer:
            halves.append(tracer.render(max(samples // 2, 1), camera=camera).color)
    reference = (halves[0] + halves[1]) / 2
    with pica.Renderer(scene, size=size, device=device) as renderer:
        second = renderer.render(RESTING[0], camera=camera).color
        frame = renderer.render(RESTING[1] - RESTING[0], camera=camera)
        ids = frame.aov("instance")
        names = {number: label.name for number, label in frame.ids.items()}
        renderer.reset()
        turned = last_frame(renderer, sequence("orbit", scene, camera, speed=DEGREES), range(1 - MOVING, 1)).color
    pictures = {"64 still": frame.color, "2 still": second, "moving": turned}
    white = 1 / compare(reference, frame.color).exposure
    light = {name: np.minimum(luminance(picture), white) for name, picture in pictures.items()}
    truth = np.minimum(luminance(reference), white)
    found: dict[str, Any] = {"seed": seed, "scene": scene.name}
    for name, picture in pictures.items():
        flip = compare(reference, picture).flip
        found[name] = {"flip": round(flip, 4), "mean": round(float(light[name].mean() / truth.mean()), 3)}
    found["noise"] = round(compare(*halves).flip, 4)
    found["nodes"] = _nodes(light["64 still"], truth, ids, names)
    if sheets:
        sheets.mkdir(parents=True, exist_ok=True)
        rows = [reference, *(pictures[name] for name in ("64 still", "moving"))], [second]
        errors = [_signed(light[name], truth) for name in ("64 still", "moving")]
        upper, lower = (np.concatenate([srgb_encode(part / white) for part in row], 1) for row in rows)
        sheet = np.concatenate([upper, np.concatenate([lower, *errors], 1)])
        write_png(sheets / f"{seed}.png", (sheet * 255).astype(np.uint8))
    return found


def _nodes(light: Pixels, truth: Pixels, ids: NDArray[np.integer], names: dict[int, str]) -> dict[str, float]:
    off = {}
    for number in np.unique(ids):
        part = ids == number
        if number in names and part.mean() >= LEAST_SHARE:
            off[names[number]] = float(
                (light[part].mean() - truth[part].mean()) / (truth[part].mean() + DARK * truth.mean())
            )
    worst = sorted(off, key=lambda name: -abs(off[name]))[:SHOWN]
    return {name: round(off[name], 2) for name in worst}


def _signed(light: Pixels, truth: Pixels) -> Pixels:
    off = np.clip(1.5 * (light - truth) / (truth + 0.1 * truth.mean()), -1, 1)
    return 1 - np.stack([np.maximum(-off, 0), np.abs(off), np.maximum(off, 0)], -1)


def _row(found: dict[str, Any]) -> str:
    columns = "   ".join(
        f"{found[name]['flip']:.4f} {found[name]['mean']:.3f}" for name in ("64 still", "2 still", "moving")
    )
    nodes = ", ".join(f"{name} {off:+.0%}" for name, off in found["nodes"].items())
    return f"{found['scene']:12} {columns}   {found['noise']:.4f}   {nodes}"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("first", type=int)
    parser.add_argument("count", type=int)
    parser.add_argument("--glass", action="store_true")
    parser.add_argument("--textures", action="store_true")
    parser.add_argument("--size", default="240x135")
    parser.add_argument("--samples", type=int, default=512)
    parser.add_argument("--sheets", type=Path, metavar="DIR")
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    width, height = (int(length) for length in given.size.split("x"))
    device = open_device()
    if not given.json:
        print(f"{device.name}, {given.size}, {given.samples} samples: FLIP, mean over the reference's")
        print(f"{'scene':12} 64 still       2 still        moving         noise    nodes most off at rest")
    for seed in range(given.first, given.first + given.count):
        scene = random_scene(seed, given.glass, given.textures)
        found = measured(device, scene, seed, (width, height), given.samples, given.sheets)
        print(json.dumps(found) if given.json else _row(found), flush=True)


if __name__ == "__main__":
    main()

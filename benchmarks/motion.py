"""What users see at rest and in motion, against the path tracer: docs/measurements/motion.md.

    PYTHONPATH=. python benchmarks/motion.py [SCENE ...] [--env FILE] [--parts camera,objects,both,flicker,ring]
        [--size 480x270] [--samples 1024] [--preset NAME] [--set GROUP.NAME=VALUE] [--references DIR] [--noise] [--json]

SCENE is a name in pica.scenes or in motion_scenes.py: `door`, `metal`, `yard`, `stage`, `textured_room`, or a file,
below --env.
FLIP, and the mean luminance over the reference's, both clipped at display white as FLIP has them, so that a lamp's edge
does not outweigh the room; of

* camera: the 64th and the 2nd frame at rest, and the 24th of a camera that turns by a degree a frame: round what it
  looks at, or in closed rooms about itself. It comes to where the other two stand, all three have one reference;
* objects: the 24th frame of an animation in steps of 1/30 s, the camera at rest; both: the camera goes on as above;
* flicker: the mean absolute change from frame to frame at rest over the mean, both clipped like that, in the left half
  of the picture, while a small ball goes up and down in the right one: without it (`alone`), and with it;
* ring: the fraction of sky pixels, more than two pixels from a thin ring, that are off by over 5 % of the picture's
  mean luminance in the 20th frame of an orbit of 1.5 degrees a frame, 240x135.

--references keeps the references in a folder, and takes those that are there; empty it when scenes change. --noise adds
FLIP between the halves of each reference, twice as far apart as the reference is from the truth. --json prints a line a
measurement.
"""

import argparse
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import pica
from benchmarks import motion_scenes
from pica.color import luminance
from pica.frame.context import Size
from pica.quality.picture_errors import compare, exposure_for
from pica.quality.playback import last_frame
from pica.quality.sequences import Sequence, sequence
from pica.rhi.device import Device, open_device
from pica.scene.camera import Camera
from pica.scene.model import Scene
from pica.scene.orbit import pivot
from pica.scenes.placing import move

Pixels = NDArray[np.float32]

RESTING, MOVING = (64, 2), 24
"""Frames."""
DEGREES, STEP = 1.0, 1 / 30
"""A frame, of the camera; seconds a frame, of the animation."""
CAMERA_SCENES = "machine_world", "corridor", "rooms", "door", "metal"
OBJECT_SCENES = "corridor", "machine_world", "landscape"
FLICKER_FRAMES = range(100, 120)
"""After so many at rest."""
RING_SIZE, RING_FRAMES, RING_DEGREES = (240, 135), 20, 1.5
RING_MARGIN, RING_ERROR = 2, 0.05
"""Pixels round the ring that do not count; of the mean luminance."""


@dataclass(frozen=True)
class Bench:
    """What all measurements share."""

    device: Device
    size: Size
    samples: int
    settings: pica.Settings
    references: Path | None
    environment: str | None = None

    def scene(self, name: str) -> Scene:
        """A new one."""
        return made(name, self.environment)

    def reference(self, name: str, scene: Scene, camera: Camera, size: Size) -> Pixels:
        """(2, height, width, 3): path traced pictures of half the samples each, of different noise."""
        file = self.references and self.references / f"{Path(name).stem}-{size[0]}x{size[1]}-{self.samples}.npy"
        if file and file.exists():
            return np.load(file)
        halves = []
        for seed in range(2):
            settings = pica.Settings().with_values({"seed": seed})
            with pica.PathTracer(scene, size=size, settings=settings, device=self.device) as tracer:
                halves.append(tracer.render(max(self.samples // 2, 1), camera=camera).color)
        if file:
            file.parent.mkdir(parents=True, exist_ok=True)
            np.save(file, np.stack(halves))
        return np.stack(halves)


def made(name: str, environment: str | None = None) -> Scene:
    """A new scene."""
    if Path(name).suffix:
        return pica.load(name, environment=environment)
    make: Callable[[], Scene] = getattr(motion_scenes, name, None) or getattr(pica.scenes, name)
    return make()


def errors(halves: Pixels, picture: Pixels) -> dict[str, float]:
    """FLIP, and the mean luminance over the reference's."""
    reference = halves.mean(0)
    found = compare(reference, picture)
    means = [np.minimum(luminance(each), 1 / found.exposure).mean() for each in (picture, reference)]
    return {"flip": round(found.flip, 4), "mean": round(float(means[0] / means[1]), 4)}


def noise(halves: Pixels) -> float:
    """FLIP between the two."""
    return round(compare(halves[0], halves[1]).flip, 4)


def played(renderer: pica.Renderer, play: Sequence, frames: range) -> Pixels:
    """The last of the frames, after a cut."""
    renderer.reset()
    return last_frame(renderer, play, frames).color


def moving_camera(bench: Bench, name: str) -> dict[str, Any]:
    """At rest, and after MOVING frames of a camera that comes to the same place."""
    scene = bench.scene(name)
    camera = scene.default_camera(bench.size[0] / bench.size[1])
    halves = bench.reference(name, scene, camera, bench.size)
    orbit = sequence("orbit", scene, camera, speed=DEGREES)
    found: dict[str, Any] = {"scene": name, "moves": "camera"}
    with pica.Renderer(scene, size=bench.size, settings=bench.settings, device=bench.device) as renderer:
        for frames in RESTING:
            found[f"{frames} still"] = errors(halves, played(renderer, lambda _: camera, range(frames)))
        found["moving"] = errors(halves, played(renderer, orbit, range(1 - MOVING, 1)))
    return {**found, "noise": noise(halves)}


def moving_objects(bench: Bench, name: str, both: bool = False) -> dict[str, Any]:
    """After MOVING frames of the animation. `both`: and of a camera that comes to the same place."""
    scene = bench.scene(name)
    camera = scene.default_camera(bench.size[0] / bench.size[1])
    play = sequence("objects", scene, camera, speed=STEP)
    play(MOVING - 1)
    halves = bench.reference(f"{Path(name).stem}-objects", scene, camera, bench.size)
    play(0)
    with pica.Renderer(scene, size=bench.size, settings=bench.settings, device=bench.device) as renderer:
        orbit = sequence("orbit", scene, camera, speed=DEGREES)

        def move_both(frame: int) -> Camera:
            play(frame)
            return orbit(frame + 1 - MOVING)

        found = errors(halves, played(renderer, move_both if both else play, range(MOVING)))
    return {"scene": name, "moves": "both" if both else "objects", "moving": found, "noise": noise(halves)}


def flicker(bench: Bench, name: str) -> dict[str, Any]:
    """At rest, in the left half, while something moves in the right half."""
    found: dict[str, Any] = {"scene": name, "moves": "ball"}
    for part, moves in (("alone", False), ("with a ball", True)):
        scene = bench.scene(name)
        camera = scene.default_camera(bench.size[0] / bench.size[1])
        center = pivot(scene, camera)
        right, up = camera.transform[:3, 0], camera.transform[:3, 1]
        reach = float(np.linalg.norm(center - camera.transform[:3, 3]))
        ball = motion_scenes.ball(scene, 0.03 * reach) if moves else None
        frames: list[Pixels] = []
        with pica.Renderer(scene, size=bench.size, settings=bench.settings, device=bench.device) as renderer:
            for frame in range(FLICKER_FRAMES.stop):
                if ball is not None:
                    height = 0.1 * reach * np.sin(0.3 * frame)
                    ball.transform = move(
                        *(0.6 * camera.transform[:3, 3] + 0.4 * center + 0.2 * reach * right + height * up)
                    )
                if frame in FLICKER_FRAMES:
                    frames.append(renderer.render(1, camera=camera, aovs=()).color)
                else:
                    renderer.advance(camera)
        left = np.stack(frames)[:, :, : bench.size[0] // 2]
        light = np.minimum(luminance(left), 1 / exposure_for(left[0]))
        found[part] = round(float(np.abs(np.diff(light, axis=0)).mean() / light.mean()), 5)
    return found


def thin_ring(bench: Bench) -> dict[str, Any]:
    """Sky that a ring which went over it has left wrong."""
    scene = motion_scenes.ring()
    camera = scene.default_camera(RING_SIZE[0] / RING_SIZE[1])
    play = sequence("orbit", scene, camera, speed=RING_DEGREES)
    last = play(RING_FRAMES - 1)
    reference = bench.reference("ring", scene, last, RING_SIZE).mean(0)
    with pica.Renderer(scene, size=RING_SIZE, settings=bench.settings, device=bench.device) as renderer:
        picture = played(renderer, play, range(RING_FRAMES))
        shown = renderer.labels(camera=last, aovs=["instance"]).aov("instance") > 0
    sky = ~_dilated(shown, RING_MARGIN)
    off = np.abs(luminance(picture) - luminance(reference)) > RING_ERROR * luminance(reference).mean()
    return {"scene": "ring", "moves": "camera", "wrong sky": round(float(off[sky].mean()), 5)}


def _dilated(mask: NDArray[np.bool_], reach: int) -> NDArray[np.bool_]:
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(mask, reach), (2 * reach + 1,) * 2)
    return windows.any((-1, -2))


def _row(found: dict[str, Any], with_noise: bool) -> str:
    if "alone" in found:
        changes = f"{found['alone']:.3%} a frame alone, {found['with a ball']:.3%} beside a ball"
        return f"{found['scene']:14} changes by {changes}"
    if "wrong sky" in found:
        return f"{found['scene']:14} {found['wrong sky']:.3%} of the sky is off by over {RING_ERROR:.0%} of the mean"
    columns = [
        f"{found[name]['flip']:7.4f} {found[name]['mean']:6.3f}" if name in found else " " * 14
        for name in ("64 still", "2 still", "moving")
    ]
    noisy = f"   {found['noise']:.4f}" if with_noise else ""
    return f"{found['scene']:14} {found['moves']:8} {'   '.join(columns)}{noisy}"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", metavar="SCENE")
    parser.add_argument("--env")
    parser.add_argument("--parts", default="camera,objects,flicker,ring")
    parser.add_argument("--size", default="480x270")
    parser.add_argument("--samples", type=int, default=1024)
    parser.add_argument("--preset", default="quality")
    parser.add_argument("--set", action="append", default=[], dest="values", metavar="GROUP.NAME=VALUE")
    parser.add_argument("--references", type=Path, metavar="DIR")
    parser.add_argument("--noise", action="store_true")
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    width, height = (int(length) for length in given.size.split("x"))
    settings = pica.Settings.preset(given.preset).with_values(dict(value.split("=", 1) for value in given.values))
    bench = Bench(open_device(), (width, height), given.samples, settings, given.references, given.env)
    parts = given.parts.split(",")
    if not given.json:
        print(f"{bench.device.name}, {given.size}, {given.samples} samples: FLIP, mean over the reference's")
        print(f"{'scene':14} {'moves':8} 64 still         2 still          moving" + "           noise" * given.noise)

    def show(found: dict[str, Any]) -> None:
        if not given.noise:
            found.pop("noise", None)
        print(json.dumps(found) if given.json else _row(found, given.noise), flush=True)

    for name in given.scenes or CAMERA_SCENES if "camera" in parts else ():
        show(moving_camera(bench, name))
    for part in ("objects", "both"):
        for name in given.scenes or OBJECT_SCENES if part in parts else ():
            if bench.scene(name).animations:
                show(moving_objects(bench, name, both=part == "both"))
    for name in given.scenes or CAMERA_SCENES if "flicker" in parts else ():
        show(flicker(bench, name))
    if "ring" in parts:
        show(thin_ring(bench))


if __name__ == "__main__":
    main()

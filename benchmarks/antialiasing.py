"""Temporal antialiasing and upscaling in motion: the figures of docs/measurements/antialiasing.md.

    python benchmarks/antialiasing.py [--size 1920x1080] [--frames 60] [--every 1] [--samples 64] [--strips FOLDER]

Each frame of a sequence against the mean of `samples` jittered, unfiltered frames of the same instant without
antialiasing over time. The camera round machine_world, in the renderer's own direct light: unfiltered, indirect light
and reflections would be noise in the reference, and what their filters lack in motion would count as aliasing
(benchmarks/motion.py measures all light). Then unlit scenes, where all error is aliasing: a grid of thin wires in slow
motion, boxes that pass in front of a board, bright boards before a wall. One JSON line a sequence and setting: mean
FLIP over the frames, and flicker, the mean absolute error of the change from frame to frame in sRGB.
`--every` N compares each Nth frame and its next alone. `--strips` writes frames side by side, above their FLIP maps.
"""

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import pica
from benchmarks.many_lights import DIRECT
from pica.frame.context import Size
from pica.images.pictures import write_png
from pica.quality.metrics import flip
from pica.quality.picture_errors import exposed, exposure_for
from pica.quality.sequences import Sequence, sequence
from pica.quality.sheet import magma
from pica.rhi.device import Device
from pica.scene.camera import Camera
from pica.scene.material import Image, Material, Sampler, Texture
from pica.scene.model import Mesh, Node, Scene
from pica.scenes.basic_meshes import box, plane
from pica.scenes.palette import lamp
from pica.scenes.placing import move, rotate

Pixels = NDArray[np.float32]

VARIANTS = {
    "off": {"antialiasing.mode": "accumulate"},
    "temporal": {},
    "temporal, upscaled 1.5": {"antialiasing.upscale": "1.5"},
    "temporal, upscaled 2": {"antialiasing.upscale": "2"},
}
UNFILTERED = {"antialiasing.mode": "accumulate", "shadows.denoiser": "off", "debug.filters": "false"}
PLAIN = {"shadows.mode": "off", "post.auto_exposure": "false"}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", default="1920x1080")
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--every", type=int, default=1)
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--sequence", action="append", choices=list(SEQUENCES), help="all when left out")
    parser.add_argument("--strips", type=Path)
    arguments = parser.parse_args()
    width, height = (int(length) for length in arguments.size.split("x"))
    device = Device()
    for name in arguments.sequence or SEQUENCES:
        compared = [f for f in range(arguments.frames) if f % arguments.every in (0, 1 % arguments.every)][1:]
        references = reference(device, name, (width, height), compared, arguments.samples)
        # Unlit scenes are made to be shown as they are; by a percentile thin wires would be far too bright.
        exposure = exposure_for(references[compared[0]]) if name == "machine_world" else 1.0
        for variant, values in VARIANTS.items():
            pictures = played(device, name, (width, height), arguments.frames, compared, values)
            print(
                json.dumps({"sequence": name, "antialiasing": variant, **errors(references, pictures, exposure)}),
                flush=True,
            )
            if arguments.strips:
                arguments.strips.mkdir(exist_ok=True, parents=True)
                write_png(arguments.strips / f"{name}, {variant}.png", strip(references, pictures, exposure))


def played(
    device: Device, name: str, size: tuple[int, int], frames: int, compared: list[int], values: dict[str, str]
) -> dict[int, Pixels]:
    """Pictures of the compared frames (height, width, 3), in linear radiance, as a renderer that runs shows them."""
    scene, play, more = SEQUENCES[name](size)
    renderer = pica.Renderer(scene, size=size, settings=pica.Settings().with_values(more | values), device=device)
    pictures = {}
    for frame in range(frames):
        picture = renderer.advance(play(frame))["color"]
        if frame in compared:
            pictures[frame] = np.ascontiguousarray(picture.to_numpy()[..., :3], np.float32)
    return pictures


def reference(device: Device, name: str, size: tuple[int, int], compared: list[int], samples: int) -> dict[int, Pixels]:
    """What the compared frames should be."""
    scene, play, more = SEQUENCES[name](size)
    renderer = pica.Renderer(scene, size=size, settings=pica.Settings().with_values(more | UNFILTERED), device=device)
    pictures = {}
    for frame in compared:
        renderer.reset()
        pictures[frame] = renderer.render(samples, camera=play(frame)).color
    return pictures


def errors(references: dict[int, Pixels], pictures: dict[int, Pixels], exposure: float) -> dict[str, float]:
    """Mean FLIP and flicker."""
    shown = {frame: (exposed(r, exposure), exposed(pictures[frame], exposure)) for frame, r in references.items()}
    changes = [
        float(np.abs((shown[f][1] - shown[f - 1][1]) - (shown[f][0] - shown[f - 1][0])).mean())
        for f in shown
        if f - 1 in shown
    ]
    mean = float(np.mean([flip(*pair)[0] for pair in shown.values()]))
    return {"flip": round(mean, 4), "flicker": round(float(np.mean(changes)), 5)}


def strip(
    references: dict[int, Pixels], pictures: dict[int, Pixels], exposure: float, count: int = 6
) -> NDArray[np.uint8]:
    """The last `count` compared frames left to right: reference, picture, FLIP map."""
    columns = []
    for frame in list(references)[-count:]:
        truth, picture = exposed(references[frame], exposure), exposed(pictures[frame], exposure)
        parts = [(p * 255 + 0.5).astype(np.uint8) for p in (truth, picture)] + [magma(flip(truth, picture)[1])]
        columns.append(np.concatenate(parts))
    return np.concatenate(columns, axis=1)


def _machine_world(size: Size) -> tuple[Scene, Sequence, dict[str, str]]:
    scene = pica.scenes.machine_world()
    return scene, sequence("orbit", scene, scene.default_camera(size[0] / size[1]), speed=0.25), DIRECT


def wire_grid(size: Size) -> tuple[Scene, Sequence, dict[str, str]]:
    """Bright wires of 0.7 pixels before a dark wall; the camera passes by 0.15 pixels a frame."""
    bright, dark = _unlit("wire", (0.9, 0.8, 0.5)), _unlit("wall", (0.02, 0.03, 0.05))
    pixel = 2 * 3 * np.tan(np.radians(35) / 2) / size[1]
    thin = 0.7 * pixel
    wires = [_node(box((4.4, thin, thin), bright), move(0, y, 0)) for y in np.linspace(-1, 1, 11)]
    wires += [_node(box((thin, 2.2, thin), bright), move(x, 0, 0)) for x in np.linspace(-2, 2, 21)]
    wall = _node(plane(12, 8, dark), move(0, 0, -1) @ rotate("x", 90))

    def play(frame: int) -> Camera:
        x, y = 0.15 * pixel * frame, 0.06 * pixel * frame
        return Camera.look_at((0.3 + x, 0.2 + y, 3), (0.1 + x, y, 0), vertical_fov=np.radians(35))

    return _scene(*wires, wall), play, PLAIN


def disocclusion(size: Size) -> tuple[Scene, Sequence, dict[str, str]]:
    """Boxes pass in front of a patterned board."""
    random = np.random.default_rng(3)
    cells = random.uniform(30, 250, (24, 24, 4)).astype(np.uint8).repeat(4, 0).repeat(4, 1)
    cells[..., 3] = 255
    pattern = Material("pattern", unlit=True, base_color_texture=Texture(Image(cells, "pattern"), Sampler()))
    board = _node(plane(8, 8, pattern), move(0, 0, -1) @ rotate("x", 90))
    boxes = [
        (_node(box(size, _unlit("box", color)), np.eye(4)), y, speed)
        for size, color, y, speed in (
            (0.5, (0.9, 0.1, 0.1), 0.5, 0.05),
            (0.35, (0.1, 0.8, 0.9), 0.0, -0.03),
            (0.2, (0.95, 0.95, 0.9), -0.4, 0.012),
        )
    ]

    def play(frame: int) -> Camera:
        for node, y, speed in boxes:
            node.transform = move(speed * (frame - 30), y, 0)
        return Camera.look_at((0, 0, 3), (0, 0, 0), vertical_fov=np.radians(35))

    return _scene(*(node for node, _, _ in boxes), board), play, PLAIN


def bright_boards(size: Size) -> tuple[Scene, Sequence, dict[str, str]]:
    """Boards ten times as bright as white pass slowly in front of a dark wall; what they leave must be dark at once."""
    wall = _node(plane(12, 8, _unlit("wall", (0.02, 0.03, 0.05))), move(0, 0, -1) @ rotate("x", 90))
    pixel = 2 * 3 * np.tan(np.radians(35) / 2) / size[1]
    boards = [
        (_node(box((0.3, 0.4, 0.01), lamp("board", "#ffd0a0", 10.0)), np.eye(4)), y, angle, speed * pixel)
        for y, angle, speed in ((0.6, 0, 1.3), (0.1, 20, -0.7), (-0.5, 0, 0.3))
    ]

    def play(frame: int) -> Camera:
        for node, y, angle, speed in boards:
            node.transform = move(speed * (frame - 30), y, 0) @ rotate("z", angle)
        return Camera.look_at((0, 0, 3), (0, 0, 0), vertical_fov=np.radians(35))

    return _scene(*(node for node, *_ in boards), wall), play, PLAIN


def _unlit(name: str, color: tuple[float, float, float]) -> Material:
    return Material(name, base_color=(*color, 1.0), unlit=True)


def _node(section: Any, transform: NDArray[np.float64]) -> Node:
    node = Node(mesh=Mesh([section], "part"))
    node.transform = transform
    return node


def _scene(*nodes: Node) -> Scene:
    scene = Scene("antialiasing")
    for node in nodes:
        scene.add(node)
    return scene


SEQUENCES: dict[str, Callable[[Size], tuple[Scene, Sequence, dict[str, str]]]] = {
    "machine_world": _machine_world,
    "wire_grid": wire_grid,
    "disocclusion": disocclusion,
    "bright_boards": bright_boards,
}


if __name__ == "__main__":
    main()

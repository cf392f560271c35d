"""Where reflections find their past when the camera moves, by four ways.

As figure 25-16 of Barré-Brisebois et al. 2019, "Hybrid Rendering for Real-Time Ray Tracing", has it: where the surface
was, where the mirrored point was, both weighed by how well they fit the newest frame, and that held to what the newest
frame makes likely; with the errors of the newest frame against many rays, of the flat floor and of the balls.

    python examples/sheets/reprojection_sheet.py sheet.png
"""

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import pica
from pica import quality
from pica.images import pictures
from pica.quality.effects import MeasuredEffect
from pica.rhi.device import Device
from pica.rhi.passes import ComputePass
from pica.rhi.slang_files import SlangFile
from pica.scene.camera import Camera
from pica.scene.environment import Environment
from pica.scene.material import Material
from pica.scene.model import Mesh, Node, Scene
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import at, move

STEP = pica.__file__, "effects/reflections/reflection_history.slang"
CHOICE, HELD = "past = blended(ofSurface, ofMirrored, mean, deviation);", "bool alike ="
FREE = HELD, "bool alike = true ||"
WAYS = {
    "where the surface was": ((CHOICE, "past = ofSurface;"), FREE),
    "where the mirrored point was": ((CHOICE, "past = ofMirrored;"), FREE),
    "both, by their likeness": (FREE,),
    "held to the newest frame": (),
}
"""What the step's text has instead."""


def stage() -> Scene:
    """A floor that mirrors sharply, three metal balls from sharp to rough, and bars that shine on both sides."""
    scene = Scene("reprojection", Environment(np.full((4, 8, 3), 0.2, np.float32)))

    def add(name: str, *sections: object) -> None:
        scene.add(Node(name, mesh=Mesh(list(sections), name)))  # type: ignore[arg-type]

    def metal(alpha: float) -> Material:
        return Material(base_color=(0.9, 0.9, 0.9, 1.0), metallic=1.0, roughness=alpha**0.5)

    add("floor", plane(16, 16, metal(0.01)))
    add("balls", *(at(sphere(0.5, metal(alpha)), move(x, 0.5, 0)) for x, alpha in ((-1.2, 0.01), (0, 0.1), (1.2, 0.3))))
    for i in range(13):
        color = np.random.default_rng(i).uniform(0.1, 2.0, 3)
        light = Material(base_color=(0.0, 0.0, 0.0, 1.0), specular=0.0, emission=tuple(map(float, color)))
        for z in (-2.5, 6.0):  # before the camera and behind it, for floor and balls
            add("bar", at(box((0.3, 2.4, 0.1), light), move(0.6 * (i - 6), 1.2, z)))
    add("wall", at(box((16, 8, 0.1), Material(base_color=(0.0, 0.0, 0.0, 1.0), specular=0.0)), move(0, 4, -2.6)))
    return scene


def history_step(device: Device, changes: tuple[tuple[str, str], ...]) -> ComputePass:
    """reflection_history.slang with some of its text exchanged."""
    path = Path(STEP[0]).parent / STEP[1]
    text = path.read_text()
    for old, new in changes:
        assert text.count(old) == 1, f"{STEP[1]} has changed: {old}"
        text = text.replace(old, new)

    return device.compute(SlangFile(path, text), name="reflection_history")


def main() -> None:
    """Render the sheet."""
    parser = argparse.ArgumentParser(description="Four ways of finding the past of reflections on one sheet.")
    parser.add_argument("output", help="a .png")
    parser.add_argument("--size", default="240x150", help="pixels of each picture")
    parser.add_argument("--frames", type=int, default=24)
    parser.add_argument("--step", type=float, default=0.02, help="metres to the side a frame")
    parser.add_argument("--samples", type=int, default=1024, help="many rays")
    arguments = parser.parse_args()
    width, height = (int(length) for length in arguments.size.split("x"))
    truth, panels = None, {}
    for title, changes in WAYS.items():
        renderer = pica.Renderer(stage(), size=(width, height))
        measured = MeasuredEffect(renderer, "reflections")
        reflections = renderer._stages.reflections
        assert reflections is not None
        reflections._accumulate = history_step(renderer.device, changes)
        for frame in range(arguments.frames):
            x = arguments.step * (frame - arguments.frames)
            camera = Camera.look_at((x, 1.3, 4), (x, 0.5, 0), vertical_fov=np.radians(40.0))
            looked_at = "instance", "reflections"
            color = renderer.advance(camera, jittered=False, capture=looked_at)["color"]
        if truth is None:
            many = measured.reference(arguments.samples)["reflections"]
            exposure = quality.exposure_for(np.asarray(color.to_numpy())[..., :3])
            truth = quality.exposed(np.nan_to_num(many), exposure)
            names = ["", *(node.name for node in renderer.scene.nodes())]
            seen = np.array(names)[renderer.captured["instance"]().astype(int)]
        found = quality.exposed(measured.result()["reflections"], exposure)
        errors = ", ".join(f"{name} {error(found, truth, seen == name):.3f}" for name in ("floor", "balls"))
        panels[f"{title}: {errors}"] = found
        renderer.close()
    assert truth is not None
    print(*panels, sep="\n")
    panels[f"{arguments.samples} rays a pixel"] = truth
    pictures.write_png(arguments.output, quality.sheet(panels))


def error(found: NDArray[np.float32], truth: NDArray[np.float32], where: NDArray[np.bool_]) -> float:
    """Root mean square, of a white of 1."""
    return float(np.sqrt(np.mean((found[where] - truth[where]) ** 2)))


if __name__ == "__main__":
    main()

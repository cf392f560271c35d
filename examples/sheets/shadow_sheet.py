"""A soft shadow while the camera turns: one ray a pixel, filtered, the footprints of the filter, and many rays.

The footprints are drawn as in figure 19-5 of Liu et al. 2019, "Cinematic Rendering in UE4 with Real-Time Ray Tracing
and Denoising"; errors are those against many rays.

    python examples/sheets/shadow_sheet.py sheet.png --size 480x270
"""

import argparse

import numpy as np
from numpy.typing import NDArray

import pica
from pica import quality
from pica.images import pictures
from pica.quality.effects import MeasuredEffect
from pica.quality.sequences import sequence
from pica.scene.light import RectangleLight
from pica.scene.model import Mesh, Node, Scene
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import aim, move, stretch

FRAMES, RAYS = 16, 512
VIEW = pica.Camera.look_at((-0.7, 3.8, 4.0), (-0.45, 0.2, 0.1), vertical_fov=np.radians(26))


def main() -> None:
    """Render the sheet."""
    parser = argparse.ArgumentParser(description="A soft shadow before and after its filter on one sheet.")
    parser.add_argument("output", help="a .png")
    parser.add_argument("--size", default="640x360", help="pixels of each picture")
    arguments = parser.parse_args()
    width, height = (int(length) for length in arguments.size.split("x"))
    scene = still_life()
    renderer = pica.Renderer(scene, size=(width, height))
    renderer.debug = True
    turning = sequence("orbit", scene, VIEW, speed=0.25)
    for moment in range(FRAMES):
        frame = renderer.render(1, camera=turning(moment))
    (reference,) = MeasuredEffect(renderer, "shadows").reference(RAYS).values()
    views = {name: frame.aov(f"debug.shadows.{name}") for name in ("raw", "filtered", "footprint")}
    raw, filtered = (np.where(np.isfinite(reference), views[name][..., 0], np.nan) for name in ("raw", "filtered"))
    footprints = np.where(np.isfinite(reference)[..., None], views["footprint"], 0)
    rows = [
        {
            f"1 ray, {decibels(raw, reference):.1f} dB": grey(raw),
            f"filtered, {decibels(filtered, reference):.1f} dB": grey(filtered),
        },
        {"footprints": footprints, f"{RAYS} rays": grey(reference)},
    ]
    pictures.write_png(arguments.output, np.concatenate([quality.sheet(row) for row in rows]))


def still_life() -> Scene:
    """Three posts, a ball and a board on a floor, under a lamp five times as long as it is wide."""
    scene = Scene("still life")
    matte = pica.Material("matte", base_color=(0.6, 0.6, 0.6, 1), metallic=0)
    things = {
        "floor": (plane(30, 30, matte), np.eye(4)),
        "ball": (sphere(0.35, matte), move(1.0, 0.35, -0.5)),
        "board": (box(1, matte), move(-1.0, 0.8, 0.1) @ stretch(0.8, 0.03, 0.8)),
        **{f"post {i}": (box(1, matte), move(0.7 * i - 0.4, 0.6, 0.8) @ stretch(0.1, 1.2, 0.1)) for i in range(3)},
    }
    for name, (section, transform) in things.items():
        scene.add(Node(name, mesh=Mesh([section]))).transform = transform
    lamp = RectangleLight(radiance=20, width=1.5, height=0.3, name="lamp")
    scene.add(Node("lamp", light=lamp)).transform = aim((2.6, 3.0, 1.6), (0, 0, 0))
    return scene


def grey(shadow: NDArray[np.float32]) -> NDArray[np.float32]:
    """(height, width, 3) of a (height, width) shadow; black where no light can come, which are the NaN."""
    return np.repeat(np.nan_to_num(shadow)[..., None], 3, axis=-1)


def decibels(shadow: NDArray[np.float32], reference: NDArray[np.float32]) -> float:
    """Peak signal to noise ratio for a peak of 1, where the light can come."""
    return float(-10 * np.log10(np.nanmean((shadow - reference) ** 2)))


if __name__ == "__main__":
    main()

"""Mirrors in mirrors: curved armour that shows itself, by how many surfaces a reflection shows lit.

As figure 19-7 of Liu et al. 2019, "Cinematic Rendering in UE4 with Real-Time Ray Tracing and Denoising", has it; with
the error against path tracing of the same light.

    python examples/sheets/interreflections_sheet.py sheet.png
"""

import argparse

import numpy as np

import pica
from pica import quality
from pica.images import pictures
from pica.scene.camera import Camera


def main() -> None:
    """Render the sheet."""
    parser = argparse.ArgumentParser(description="Reflections of one, two and four bounces on one sheet.")
    parser.add_argument("output", help="a .png")
    parser.add_argument("--size", default="320x320", help="pixels of each picture")
    parser.add_argument("--frames", type=int, default=64)
    parser.add_argument("--samples", type=int, default=512, help="of the path tracer")
    arguments = parser.parse_args()
    width, height = (int(length) for length in arguments.size.split("x"))
    scene = pica.scenes.corridor()
    head = next(node for node in scene.nodes() if node.name == "head").world[:3, 3]
    x, y, z = (float(metres) for metres in head)
    camera = Camera.look_at((x + 0.5, y, z + 1.3), (x, y - 0.25, z), vertical_fov=np.radians(35.0))
    truth = pica.PathTracer(scene, size=(width, height)).render(arguments.samples, camera=camera).color
    exposure = quality.exposure_for(truth)
    shown = {"path traced": quality.exposed(truth, exposure)}
    for bounces in (1, 2, 4):
        settings = pica.Settings().with_values({"reflections.bounces": bounces})
        found = (
            pica.Renderer(scene, size=(width, height), settings=settings).render(arguments.frames, camera=camera).color
        )
        picture = quality.exposed(found, exposure)
        error = quality.flip(picture, shown["path traced"])[0]
        shown[f"{bounces} lit, FLIP {error:.3f}, light {found.mean() / np.mean(truth):.3f}"] = picture
    print(*shown, sep="\n")
    pictures.write_png(arguments.output, quality.sheet(shown))


if __name__ == "__main__":
    main()

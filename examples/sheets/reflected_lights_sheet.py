"""What a glossy floor shows of two lights behind an object, by two ways.

As figure 19-13 of Liu et al. 2019, "Cinematic Rendering in UE4 with Real-Time Ray Tracing and Denoising", has it: by
linearly transformed cosines times the filtered shadow, and by reflection rays that meet the lights; with the errors of
both against the path tracer.

    python examples/sheets/reflected_lights_sheet.py sheet.png
"""

import argparse

import numpy as np
from numpy.typing import NDArray

import pica
from pica import quality
from pica.images import pictures
from pica.scene.camera import Camera
from pica.scene.light import RectangleLight
from pica.scene.material import Material
from pica.scene.model import Mesh, Node, Scene
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import at, move, rotate

ALPHA = 0.17
"""The floor's squared roughness."""


def stage() -> Scene:
    """A floor that mirrors and scatters nothing, two upright lights, and a dark body on wheels before them."""
    scene = Scene("two lights")
    floor = Material("floor", base_color=(0.9, 0.9, 0.9, 1.0), metallic=1.0, roughness=ALPHA**0.5)
    paint = Material("paint", base_color=(0.05, 0.06, 0.08, 1.0), metallic=0.0, roughness=0.5)
    body = [
        at(box((2.2, 0.4, 0.9), paint, 0.1, 4), move(0, 0.45, 0)),
        at(box((1.1, 0.35, 0.8), paint, 0.1, 4), move(-0.1, 0.8, 0)),
        *(at(sphere(0.22, paint), move(x, 0.22, z)) for x in (-0.7, 0.7) for z in (-0.4, 0.4)),
    ]
    for name, sections in (("floor", [plane(30, 30, floor)]), ("body", body)):
        scene.add(Node(name, mesh=Mesh(sections, name)))
    for x, color in ((-1.2, (1.0, 0.85, 0.6)), (1.2, (0.6, 0.8, 1.0))):
        light = Node("light", light=RectangleLight(color=color, radiance=6.0, width=1.4, height=1.6))
        light.transform = move(x, 1.0, -1.8) @ rotate("y", 180)
        scene.add(light)
    return scene


def main() -> None:
    """Render the sheet."""
    parser = argparse.ArgumentParser(description="Two lights in a glossy floor, by two ways, on one sheet.")
    parser.add_argument("output", help="a .png")
    parser.add_argument("--size", default="480x270", help="pixels of each picture")
    parser.add_argument("--frames", type=int, default=64)
    parser.add_argument("--samples", type=int, default=1024, help="of the path tracer")
    arguments = parser.parse_args()
    width, height = (int(length) for length in arguments.size.split("x"))
    scene, camera = stage(), Camera.look_at((0.4, 1.5, 4.2), (0, 0.45, 0), vertical_fov=np.radians(42.0))
    truth = pica.PathTracer(scene, size=(width, height), max_depth=3).render(arguments.samples, camera=camera).color
    exposure = quality.exposure_for(truth)
    panels = {"path traced": quality.exposed(truth, exposure)}
    for title, shapes in (("LTC times shadow", "false"), ("rays meet the lights", "true")):
        settings = pica.Settings().with_values({"global_illumination.bounces": "1", "reflections.area_lights": shapes})
        found = (
            pica.Renderer(scene, size=(width, height), settings=settings).render(arguments.frames, camera=camera).color
        )
        shown = quality.exposed(found, exposure)
        panels[f"{title}: {decibels(shown, panels['path traced']):.1f} dB, light {found.mean() / truth.mean():.3f}"] = (
            shown
        )
    print(*panels, sep="\n")
    errors = {
        f"error x 5 of {title.split(':')[0]}": np.clip(5 * np.abs(shown - panels["path traced"]), 0, 1)
        for title, shown in list(panels.items())[1:]
    }
    blank = {"": np.zeros_like(panels["path traced"])}
    pictures.write_png(arguments.output, np.concatenate([quality.sheet(panels), quality.sheet(blank | errors)]))


def decibels(picture: NDArray[np.float32], reference: NDArray[np.float32]) -> float:
    """Peak signal to noise ratio for a peak of 1."""
    return float(-10 * np.log10(np.mean((picture - reference) ** 2)))


if __name__ == "__main__":
    main()

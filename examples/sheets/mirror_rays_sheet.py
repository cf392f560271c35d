"""A glossy floor drawn from the rays of a perfect mirror.

As figures 19-10 to 19-12 of Liu et al. 2019, "Cinematic Rendering in UE4 with Real-Time Ray Tracing and Denoising",
have it: what the rays bring, the lobe drawn from it, many sampled rays; beside rays that are sampled and rebuilt, and
with the FLIP of both.

    python examples/sheets/mirror_rays_sheet.py sheet.png --alpha 0.15 --samples 16384
"""

import argparse

import numpy as np
from numpy.typing import NDArray

import pica
from pica import quality
from pica.images import pictures
from pica.quality.effects import MeasuredEffect
from pica.scene.camera import Camera
from pica.scene.environment import Environment
from pica.scene.material import Material
from pica.scene.model import Mesh, Node, Scene, Section
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import at, move, rotate

RAW = "debug.reflections.raw"


def stage(alpha: float) -> Scene:
    """A metal floor before things that shine and a wide board."""
    sky = Environment(np.broadcast_to(np.float32((0.3, 0.35, 0.4)), (4, 8, 3)).copy())
    scene = Scene("glossy floor", sky)

    def place(sections: list[Section]) -> None:
        scene.add(Node(mesh=Mesh(sections)))

    def lit(*light: float) -> Material:
        return Material(base_color=(0.0, 0.0, 0.0, 1.0), metallic=0.0, specular=0.0, emission=light)

    place([plane(12, 12, Material(base_color=(0.9, 0.9, 0.9, 1.0), metallic=1.0, roughness=alpha**0.5))])
    place([at(box((0.6, 1.2, 0.3), lit(2.0, 0.3, 0.3)), move(-0.7, 0.6, -0.6), rotate("y", 20))])
    place([at(box((0.1, 1.6, 0.1), lit(1.0, 1.0, 0.8)), move(0.1, 0.8, -0.4))])
    place([at(sphere(0.45, lit(0.6, 0.45, 0.2)), move(0.75, 0.45, -0.2))])
    place([at(box((40, 30, 0.1), lit(0.15, 0.2, 0.3)), move(0, 2, -4))])
    return scene


def main() -> None:
    """Render the sheet."""
    parser = argparse.ArgumentParser(description="A lobe from mirror rays on one sheet.")
    parser.add_argument("output", help="a .png")
    parser.add_argument("--alpha", type=float, default=0.15, help="the floor's squared roughness")
    parser.add_argument("--size", default="480x300", help="pixels of each picture")
    parser.add_argument("--frames", type=int, default=16)
    parser.add_argument("--samples", type=int, default=1024, help="many rays")
    arguments = parser.parse_args()
    width, height = (int(length) for length in arguments.size.split("x"))
    camera = Camera.look_at((0, 1.3, 3.6), (0, 0.5, 0), vertical_fov=np.radians(45.0))
    found: dict[str, NDArray[np.float32]] = {}
    for way in ("mirror_rays", "ratio_estimator"):
        settings = pica.Settings().with_values({"reflections.reconstruction": way})
        renderer = pica.Renderer(stage(arguments.alpha), size=(width, height), settings=settings)
        measured = MeasuredEffect(renderer, "reflections")
        for _ in range(arguments.frames):
            color = renderer.advance(camera, jittered=False, capture=("reflections", RAW))["color"]
        found[way] = measured.result()["reflections"]
        if way == "mirror_rays":
            exposure = quality.exposure_for(np.asarray(color.to_numpy())[..., :3])
            raw = renderer.captured[RAW]()
            truth = quality.exposed(np.nan_to_num(measured.reference(arguments.samples)["reflections"]), exposure)
    shown = {way: quality.exposed(light, exposure) for way, light in found.items()}
    errors = {way: quality.flip(picture, truth)[0] for way, picture in shown.items()}
    panels = {
        "mirror rays, 1/4 a pixel": np.kron(quality.exposed(raw, exposure), np.ones((2, 2, 1)))[:height, :width],
        f"lobe drawn from them: FLIP {errors['mirror_rays']:.3f}": shown["mirror_rays"],
        f"{arguments.samples} sampled rays": truth,
        f"sampled rays, rebuilt: FLIP {errors['ratio_estimator']:.3f}": shown["ratio_estimator"],
    }
    print(*panels, sep="\n")
    pictures.write_png(arguments.output, quality.sheet(panels))


if __name__ == "__main__":
    main()

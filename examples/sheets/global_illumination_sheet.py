"""Diffuse global illumination by both ways beside path tracing, on one sheet.

As figures 25-29 (coloured ambient occlusion, surfels, both) and 25-30 (recursive paths beside surfels, whose rays are
one edge long) of Barré-Brisebois et al. 2019, "Hybrid Rendering for Real-Time Ray Tracing", and 19-15 (before and after
the filter) of Liu et al. 2019, "Cinematic Rendering in UE4 with Real-Time Ray Tracing and Denoising", have it.

    python examples/sheets/global_illumination_sheet.py sheet.png [--scene machine_world]
"""

import argparse

import numpy as np
from numpy.typing import NDArray

import pica
from pica import quality
from pica.images import pictures
from pica.images.output import Frame

_SURFELS = {"global_illumination.mode": "surfels", "ambient_occlusion.mode": "off"}
_DETAIL = {"global_illumination.mode": "surfels", "ambient_occlusion.mode": "ground_truth"}


def main() -> None:
    """Render the sheet."""
    parser = argparse.ArgumentParser(description="Indirect light of surfels and of paths on one sheet.")
    parser.add_argument("output", help="a .png")
    parser.add_argument("--scene", default="machine_world")
    parser.add_argument("--size", default="320x180", help="pixels of each picture")
    parser.add_argument("--frames", type=int, default=128)
    parser.add_argument("--samples", type=int, default=512, help="of the path tracer")
    arguments = parser.parse_args()
    width, height = (int(length) for length in arguments.size.split("x"))
    scene = getattr(pica.scenes, arguments.scene)()
    camera = scene.default_camera(width / height)

    def rendered(values: dict[str, str]) -> Frame:
        return pica.Renderer(scene, size=(width, height), settings=pica.Settings().with_values(values)).render(
            arguments.frames, camera=camera
        )

    surfels, detail, paths = rendered(_SURFELS), rendered(_DETAIL), rendered({})
    unfiltered = rendered({"debug.filters": "false"})
    truth = pica.PathTracer(scene, size=(width, height)).render(arguments.samples, camera=camera).color
    light = quality.exposure_for(surfels.aov("diffuse_indirect")) / 2
    whole = quality.exposure_for(truth)

    def indirect(frame: Frame) -> NDArray[np.float32]:
        return quality.exposed(frame.aov("diffuse_indirect"), light)

    def titled(name: str, picture: NDArray[np.float32]) -> dict[str, NDArray[np.float32]]:
        shown = quality.exposed(picture, whole)
        return {f"{name}, FLIP {quality.flip(quality.exposed(truth, whole), shown)[0]:.3f}": shown}

    rows = [
        {
            "25-29: coloured ambient occlusion": coloured(detail.aov("ambient_occlusion"), detail.aov("albedo")),
            "surfels": indirect(surfels),
            "surfels times occlusion": indirect(detail),
        },
        {
            "25-30: path traced": quality.exposed(truth, whole),
            **titled("surfels", surfels.color),
            **titled("paths", paths.color),
        },
        {
            "19-15: light of single paths": indirect(unfiltered),
            "filtered": indirect(paths),
            "surfels": indirect(surfels),
        },
    ]
    pictures.write_png(arguments.output, np.concatenate([quality.sheet(row) for row in rows]))


def coloured(occlusion: NDArray[np.float32], albedo: NDArray[np.float32]) -> NDArray[np.float32]:
    """As shaders/ambient_visibility.slang has it: how much darker closed places are, and in which colour."""
    share, color = occlusion.reshape(*albedo.shape[:2], 1), albedo[..., :3]
    a, b, c = 2.0404 * color - 0.3324, 0.6417 - 4.7951 * color, 2.7552 * color + 0.6903
    return np.clip(np.maximum(share, ((share * a + b) * share + c) * share), 0, 1).astype(np.float32)


if __name__ == "__main__":
    main()

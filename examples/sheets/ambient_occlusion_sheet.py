"""Four ways to ambient occlusion, as figure 25-17 of Barré-Brisebois et al. 2019, "Hybrid Rendering for Real-Time Ray
Tracing", has them: 1000 rays a pixel, one ray, one ray filtered, and GTAO; with the errors against the first.

    python examples/sheets/ambient_occlusion_sheet.py sheet.png --distance 0.6
"""

import argparse
from typing import Literal

import numpy as np
from numpy.typing import NDArray

import pica
from pica import quality
from pica.images import pictures
from pica.quality.effects import MeasuredEffect

FRAMES = 32


def main() -> None:
    """Render the sheet."""
    parser = argparse.ArgumentParser(description="Four ways to ambient occlusion on one sheet.")
    parser.add_argument("output", help="a .png")
    parser.add_argument("--distance", type=float, default=0.6, help="metres that rays go")
    parser.add_argument("--size", default="640x360", help="pixels of each picture")
    arguments = parser.parse_args()
    width, height = (int(length) for length in arguments.size.split("x"))
    scene = pica.scenes.machine_world()

    def rendered(
        mode: Literal["ray_traced", "ground_truth"], filtered: bool
    ) -> tuple[pica.Renderer, NDArray[np.float32]]:
        occlusion = pica.AmbientOcclusionSettings(mode=mode, max_distance=arguments.distance)
        settings = pica.Settings(ambient_occlusion=occlusion, debug=pica.DebugSettings(filters=filtered))
        settings = settings.with_values({"shadows.mode": "off", "lighting.environment": "off"})
        renderer = pica.Renderer(scene, size=(width, height), settings=settings)
        return renderer, renderer.render(FRAMES).aov("ambient_occlusion")

    renderer, one = rendered("ray_traced", filtered=False)
    reference = np.nan_to_num(MeasuredEffect(renderer, "ambient_occlusion").reference(1000)["open"], nan=1)
    panels = {
        "1 ray": one,
        "1 ray, filtered": rendered("ray_traced", filtered=True)[1],
        "GTAO": rendered("ground_truth", filtered=True)[1],
    }
    titled = {f"{name}, {decibels(picture, reference):.1f} dB": picture for name, picture in panels.items()}
    shown = {"1000 rays": reference, **titled}
    grey = [{title: np.repeat(picture[..., None], 3, axis=-1)} for title, picture in shown.items()]
    rows = [quality.sheet(first | second) for first, second in (grey[:2], grey[2:])]
    pictures.write_png(arguments.output, np.concatenate(rows))


def decibels(picture: NDArray[np.float32], reference: NDArray[np.float32]) -> float:
    """Peak signal to noise ratio for a peak of 1."""
    return float(-10 * np.log10(np.mean((picture - reference) ** 2)))


if __name__ == "__main__":
    main()

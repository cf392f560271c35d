"""How reflections come about from a quarter of a ray a pixel, in the first frame, so that no history helps.

As figures 25-13 to 25-15 of Barré-Brisebois et al. 2019, "Hybrid Rendering for Real-Time Ray Tracing", have it: what
the rays bring at half size, that rebuilt at full size, its deviation, what is left after the filters, and many rays.

    python examples/sheets/reflection_stages_sheet.py sheet.png --scene corridor
"""

import argparse

import numpy as np
from numpy.typing import NDArray

import pica
from pica import quality
from pica.images import pictures
from pica.quality.effects import MeasuredEffect


def main() -> None:
    """Render the sheet."""
    parser = argparse.ArgumentParser(description="The stages of reflections on one sheet.")
    parser.add_argument("output", help="a .png")
    parser.add_argument("--scene", default="machine_world", help="one of pica.scenes")
    parser.add_argument("--size", default="480x270", help="pixels of each picture")
    parser.add_argument("--samples", type=int, default=512, help="many rays")
    arguments = parser.parse_args()
    width, height = (int(length) for length in arguments.size.split("x"))
    renderer = pica.Renderer(getattr(pica.scenes, arguments.scene)(), size=(width, height))
    renderer.debug = True
    measured = MeasuredEffect(renderer, "reflections")
    frame = renderer.render(1)
    exposure = quality.exposure_for(frame.color)

    def view(name: str) -> NDArray[np.float32]:
        return quality.exposed(frame.aov(f"debug.reflections.{name}"), exposure)

    variance = np.sqrt(np.maximum(frame.aov("debug.reflections.variance"), 0))
    rows = (
        {
            "1/4 ray a pixel, over albedo": view("raw"),
            "rebuilt": view("reconstructed"),
            "deviation": quality.exposed(np.repeat(variance[..., None], 3, axis=-1), exposure),
        },
        {
            "with albedo, filtered": quality.exposed(frame.aov("reflections"), exposure),
            f"{arguments.samples} rays a pixel": quality.exposed(
                np.nan_to_num(measured.reference(arguments.samples)["reflections"]), exposure
            ),
            "in the picture": quality.exposed(frame.color, exposure),
        },
    )
    pictures.write_png(arguments.output, np.concatenate([quality.sheet(row) for row in rows]))


if __name__ == "__main__":
    main()

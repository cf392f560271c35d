"""Two settings side by side with the path tracer.

The sheet shows where they differ from it, by FLIP; errors and times are printed:

    python examples/compare_settings.py sheet.png
"""

import argparse

import pica
from pica import quality
from pica.images import pictures

SETTINGS = {
    "soft shadows": pica.Settings(),
    "hard shadows": pica.Settings(shadows=pica.ShadowsSettings(mode="hard")),
}


def main() -> None:
    """Write the sheet and print the errors."""
    parser = argparse.ArgumentParser(description="Two settings side by side with the path tracer.")
    parser.add_argument("output", help="a .png")
    parser.add_argument("--size", default="320x180", help="pixels of each picture")
    parser.add_argument("--frames", type=int, default=16)
    parser.add_argument("--samples", type=int, default=256, help="paths a pixel of the reference")
    arguments = parser.parse_args()
    width, height = (int(length) for length in arguments.size.split("x"))

    scene = pica.scenes.machine_world(seed=1)
    with pica.PathTracer(scene, size=(width, height)) as tracer:
        reference = tracer.render(arguments.samples).color
    exposure = quality.exposure_for(reference)  # the same for all, so that they can be compared
    panels = {"path traced": quality.exposed(reference, exposure)}
    for name, settings in SETTINGS.items():
        with pica.Renderer(scene, size=(width, height), settings=settings) as renderer:
            frame = renderer.render(arguments.frames)
        errors = quality.compare(reference, frame.color, exposure)
        milliseconds = sum(frame.timings.values())
        print(f"{name}: FLIP {errors.flip:.4f}, PSNR {errors.psnr:.1f} dB, {milliseconds:.1f} ms for the last frame")
        panels[name] = quality.exposed(frame.color, exposure)
        panels[f"FLIP {errors.flip:.3f}"] = errors.flip_map
    pictures.write_png(arguments.output, quality.sheet(panels))


if __name__ == "__main__":
    main()

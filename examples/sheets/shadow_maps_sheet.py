"""The raster preset with its shadow maps beside the same with ray traced shadows.

python examples/sheets/shadow_maps_sheet.py sheet.png --size 468x263
"""

import argparse
import math

import pica
from pica import quality
from pica.images import pictures

FRAMES = 24
VIEW = pica.Camera.look_at((-3.6, 3.4, 6.4), (-0.7, 0.3, 0.6), vertical_fov=math.radians(26))


def main() -> None:
    """Render the sheet."""
    parser = argparse.ArgumentParser(description="Shadow maps beside ray traced shadows.")
    parser.add_argument("output", help="a .png")
    parser.add_argument("--size", default="640x360", help="pixels of each picture")
    arguments = parser.parse_args()
    width, height = (int(length) for length in arguments.size.split("x"))
    scene = pica.scenes.machine_world()
    shown = {}
    for title, method in (("shadow maps", "maps"), ("rays", "rays")):
        settings = pica.Settings.preset("raster").with_values({"shadows.method": method})
        frame = pica.Renderer(scene, size=(width, height), settings=settings).render(FRAMES, camera=VIEW)
        shown[title] = frame.display / 255
    pictures.write_png(arguments.output, quality.sheet(shown))


if __name__ == "__main__":
    main()

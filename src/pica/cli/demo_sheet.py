"""`pica demo --sheet`: one view of machine_world in four ways, side by side, with their times."""

import time
from collections.abc import Callable
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pica.cli import options
from pica.cli.report import print_json, print_line, progress

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

SIZE = (320, 180)
FRAMES = 16
"""Of the hybrid picture."""
REFERENCE = "demo_reference.png"
"""`pica render demo -o src/pica/cli/demo_reference.png --size 320x180 --path-traced --samples 1024`"""
SAMPLES = 1024
"""Paths per pixel of the reference, which is stored because it takes minutes."""


def write_sheet(output: Path, device: str | None, json: bool) -> None:
    """Render the pictures and write the sheet. Raises PicaError."""
    options.check_output(output, (".png",))
    import numpy as np

    import pica
    from pica.images.pictures import write_png
    from pica.quality.metrics import flip
    from pica.quality.sheet import sheet

    began = time.perf_counter()
    scene = pica.scenes.machine_world()
    reference = stored_reference()
    raster, hybrid = (
        pica.Renderer(scene, size=SIZE, settings=pica.Settings.preset(preset), device=device)
        for preset in ("raster", "quality")
    )
    traced = pica.PathTracer(scene, size=SIZE, device=device)
    ways: dict[str, tuple[Callable[[int], Any], int]] = {
        "raster": (partial(raster.render, aovs=()), 4),
        "path traced": (partial(traced.render, aovs=()), 1),
        "hybrid": (partial(hybrid.render, aovs=()), FRAMES),
    }
    pictures: dict[str, NDArray[np.float32]] = {}
    found: dict[str, Any] = {"device": hybrid.device_name}
    with progress("Rendering", json) as advance:
        for done, (way, (render, count)) in enumerate(ways.items()):
            advance(done, len(ways))
            render(1)  # compiles
            start = time.perf_counter()
            picture = render(count).display / np.float32(255)
            milliseconds = (time.perf_counter() - start) / count * 1000
            error = flip(picture, reference)[0]
            unit = "sample" if way == "path traced" else "frame"
            took = f"{milliseconds:.3g} ms" if milliseconds < 100 else f"{milliseconds:.0f} ms"
            many = f"{count} {unit}s: {took} each" if count > 1 else f"1 {unit}: {took}"
            pictures[f"{way}, {many}, FLIP {error:.3f}"] = picture
            found[way] = {f"{unit}s": count, f"{unit}_ms": milliseconds, "flip": error}
        advance(len(ways), len(ways))
    pictures[f"reference, {SAMPLES} samples (stored)"] = reference
    rows = list(pictures.items())
    write_png(output, np.concatenate([sheet(dict(rows[:2])), sheet(dict(rows[2:]))]))
    found |= {"seconds": time.perf_counter() - began, "files": [str(output)]}
    if json:
        print_json(found)
    else:
        print_line(f"{output}: {found['seconds']:.1f} s on {hybrid.device_name}")


def stored_reference() -> "NDArray[np.float32]":
    """(180, 320, 3) sRGB, 0 to 1: the demo scene at rest at time 0."""
    import numpy as np
    from PIL import Image

    with files("pica.cli").joinpath(REFERENCE).open("rb") as file, Image.open(file) as picture:
        return np.asarray(picture.convert("RGB"), np.float32) / np.float32(255)

"""`pica compare`: the hybrid picture, or one effect's buffer, against the path traced one."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pica.cli import options
from pica.cli.report import print_json, print_table, progress
from pica.errors import PicaError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from pica import Scene, Settings

_EFFECTS = ("shadows", "ambient_occlusion")
_SEQUENCES = ("still", "camera", "objects", "light")


def compare(
    scene: options.SceneName,
    size: options.Size = "640x360",
    frames: options.Frames = 64,
    samples: Annotated[
        int, typer.Option(min=1, metavar="N", help="Paths, or with --effect rays, per pixel of the reference.")
    ] = 256,
    max_depth: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Edges of the reference's paths; 2 is direct light only.")
    ] = None,
    effect: Annotated[
        str | None, typer.Option(metavar="NAME", help=f"Compare one effect's buffer: {' or '.join(_EFFECTS)}.")
    ] = None,
    sequence: Annotated[
        str | None, typer.Option(metavar="NAME", help=f"With --effect, what moves: {', '.join(_SEQUENCES)}.")
    ] = None,
    preset: options.Preset = "hybrid",
    values: options.Values = None,
    json: options.Json = False,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Both pictures and the error, a .png.")
    ] = None,
) -> None:
    """Tell how far the hybrid picture of SCENE is from the path traced one: FLIP, PSNR, relative MSE.

    With --effect, how far each frame's buffer of one effect is from the same by many rays, and how much it flickers.
    """
    if output is not None:
        options.check_output(output, (".png",))
    if effect is None and sequence is not None:
        raise PicaError("--sequence is for --effect")
    _check("--effect", effect, _EFFECTS)
    _check("--sequence", sequence, _SEQUENCES)
    if effect is not None and max_depth is not None:
        raise PicaError("--max-depth is for whole pictures, not for --effect")
    settings = options.parse_settings(preset, values)
    pixels = options.parse_size(size)
    content = options.load_scene(scene)
    result: dict[str, Any] = {"size": list(pixels), "frames": frames, "samples": samples}
    if effect is None:
        device, found, page = _whole(content, pixels, settings, frames, samples, max_depth)
        result["whole"] = found
    else:
        device, found, page = _one_effect(content, pixels, settings, frames, samples, effect, sequence or "still")
        result |= {"effect": effect, "sequence": sequence or "still", **found}
    if output is not None:
        from pica import pictures

        pictures.write_png(output, page)
    result = {"device": device, **result}
    if json:
        print_json(result)
    else:
        print_table(scene, {name: value for name, value in result.items() if not name.endswith("by_frame")})


_Found = tuple[str, dict[str, Any], "NDArray[np.uint8]"]
"""Of a comparison: the device, the numbers, and a sheet to look at."""


def _whole(
    scene: "Scene", size: tuple[int, int], settings: "Settings", frames: int, samples: int, max_depth: int | None
) -> _Found:
    import pica
    from pica import quality

    renderer = pica.Renderer(scene, size=size, settings=settings)
    with progress("Hybrid") as advance:
        hybrid = renderer.render(frames=frames, progress=advance)
    tracer = pica.PathTracer(scene, size=size, max_depth=max_depth)
    with progress("Path traced") as advance:
        reference = tracer.render(samples=samples, progress=advance)
    errors = quality.compare(reference.color, hybrid.color)
    panels = {
        f"hybrid, {frames} frames": quality.exposed(hybrid.color, errors.exposure),
        f"path traced, {samples} samples": quality.exposed(reference.color, errors.exposure),
        f"FLIP {errors.flip:.4f}": errors.flip_map,
    }
    return renderer.device_name, errors.numbers(), quality.sheet(panels)


def _one_effect(
    scene: "Scene", size: tuple[int, int], settings: "Settings", frames: int, samples: int, effect: str, sequence: str
) -> _Found:
    import pica
    from pica.quality.effects import compare_effect, error_sheet

    renderer = pica.Renderer(scene, size=size, settings=settings)
    with progress(effect) as advance:
        errors = compare_effect(renderer, effect, sequence, frames, samples, progress=advance)
    return renderer.device_name, errors.numbers(), error_sheet(errors)


def _check(option: str, name: str | None, known: tuple[str, ...]) -> None:
    if name is not None and name not in known:
        raise PicaError(f"{option} {name!r} is not one of {', '.join(known)}")

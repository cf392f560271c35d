"""`pica compare`: the hybrid picture, or one effect's buffer, against the path traced one."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pica.cli import options
from pica.cli.report import print_json, print_values, progress
from pica.cli.view import View, find_animation, takes_view
from pica.errors import PicaError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from pica import Camera, Renderer

_SEQUENCES = ("still", "camera", "objects", "light")


@takes_view
def compare(
    view: View,
    size: options.Size = "640x360",
    frames: options.Frames = 64,
    samples: Annotated[int, options.count("Paths, or with --effect rays, per pixel of the reference.")] = 256,
    max_depth: Annotated[int | None, options.count("Edges of the reference's paths; 2 is direct light only.")] = None,
    effect: Annotated[
        str | None, typer.Option(metavar="NAME", help="Compare one effect's buffer, such as shadows.")
    ] = None,
    sequence: Annotated[
        str | None, typer.Option(metavar="NAME", help=f"With --effect, what moves: {', '.join(_SEQUENCES)}.")
    ] = None,
    preset: options.Preset = "hybrid",
    values: options.Values = None,
    device: options.Device = None,
    json: options.Json = False,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Both pictures and the error, a .png.")
    ] = None,
) -> None:
    """Tell how far the hybrid picture of SCENE is from the path traced one: FLIP, PSNR, relative MSE.

    With --effect, how far each frame's buffer of one effect is from the same by many rays, and how much it flickers.
    """
    import pica

    if output is not None:
        options.check_output(output, (".png",))
    if effect is None and sequence is not None:
        raise PicaError("--sequence is for --effect")
    if sequence is not None and sequence not in _SEQUENCES:
        raise PicaError(f"--sequence {sequence!r} is not one of {', '.join(_SEQUENCES)}")
    if effect is not None and max_depth is not None:
        raise PicaError("--max-depth is for whole pictures, not for --effect")
    settings = options.parse_settings(preset, values)
    pixels = options.parse_size(size)
    content = view.load()
    # Decided once, so that both pictures look from one place whatever rendering does to the scene.
    camera = view.camera_in(content) or content.default_camera(pixels[0] / pixels[1])
    renderer = pica.Renderer(content, size=pixels, settings=settings, device=device)
    result: dict[str, Any] = {
        "device": renderer.device_name,
        "size": list(pixels),
        "frames": frames,
        "samples": samples,
    }
    if effect is None:
        found, page = _whole(renderer, camera, frames, samples, max_depth, json)
        result["whole"] = found
        if settings.rays.opaque_secondary_shadows:
            result["reference"] = "transparent surfaces are opaque to shadow rays from secondary hits"
    else:
        found, page = _one_effect(renderer, view, camera, frames, samples, effect, sequence or "still", json)
        result |= {"effect": effect, "sequence": sequence or "still", **found}
    if output is not None:
        from pica import pictures

        pictures.write_png(output, page)
    if json:
        print_json(result)
    else:
        print_values(view.scene, {name: value for name, value in result.items() if not name.endswith("by_frame")})


_Found = tuple[dict[str, Any], "NDArray[np.uint8]"]
"""Of a comparison: the numbers, and a sheet to look at."""


def _whole(
    renderer: "Renderer", camera: "Camera", frames: int, samples: int, max_depth: int | None, json: bool
) -> _Found:
    import pica
    from pica import quality

    # First, as it is an error where nothing traces rays.
    tracer = pica.PathTracer(
        renderer.scene, size=renderer.size, max_depth=max_depth, settings=renderer.settings, device=renderer.device
    )
    with progress("Hybrid", json) as advance:
        hybrid = renderer.render(frames, camera=camera, progress=advance)
    with progress("Path traced", json) as advance:
        reference = tracer.render(samples, camera=camera, progress=advance)
    errors = quality.compare(reference.color, hybrid.color)
    panels = {
        f"hybrid, {frames} frames": quality.exposed(hybrid.color, errors.exposure),
        f"path traced, {samples} samples": quality.exposed(reference.color, errors.exposure),
        f"FLIP {errors.flip:.4f}": errors.flip_map,
    }
    return errors.numbers(), quality.sheet(panels)


def _one_effect(
    renderer: "Renderer", view: View, camera: "Camera", frames: int, samples: int, effect: str, motion: str, json: bool
) -> _Found:
    from pica.quality.effects import compare_effect, error_sheet

    animation = find_animation(renderer.scene, view.animation)
    with progress(effect, json) as advance:
        errors = compare_effect(
            renderer, effect, motion, frames, samples, camera, False, advance, view.start or 0.0, animation
        )
    return errors.numbers(), error_sheet(errors)

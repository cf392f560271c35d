"""`pica compare`: the hybrid picture against the path traced one or one with other settings, or one effect's buffer."""

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

    from pica import Camera, Frame, Renderer, Settings

_SAMPLES = 256
_SEQUENCES = ("still", "camera", "objects", "light")


@takes_view
def compare(
    view: View,
    size: options.Size = "640x360",
    frames: options.Frames = 64,
    samples: Annotated[
        int | None, options.count("Paths, or with --effect rays, per pixel of the reference, 256 unless told.")
    ] = None,
    max_depth: Annotated[int | None, options.count("Edges of the reference's paths; 2 is direct light only.")] = None,
    effect: Annotated[
        str | None, typer.Option(metavar="NAME", help="Compare one effect's buffer, such as shadows.")
    ] = None,
    sequence: Annotated[
        str | None, typer.Option(metavar="NAME", help=f"With --effect, what moves: {', '.join(_SEQUENCES)}.")
    ] = None,
    preset: options.Preset = "hybrid",
    values: options.Values = None,
    against: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE",
            help="Take another hybrid picture for the reference, with preset=NAME or a setting as of --set; "
            "all else is as in the first. May be repeated.",
        ),
    ] = None,
    device: options.Device = None,
    json: options.Json = False,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Both pictures and the error, a .png.")
    ] = None,
) -> None:
    """Tell how far the hybrid picture of SCENE is from the path traced one: FLIP, PSNR, relative MSE.

    With --against, how far it is from the one that other settings give. With --effect, how far each frame's buffer of
    one effect is from the same by many rays, and how much it flickers.
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
    if against and not (effect is None and samples is None and max_depth is None):
        raise PicaError("--against takes no --effect, --samples or --max-depth beside it, as nothing is path traced")
    settings = options.parse_settings(preset, values)
    others = _other_settings(preset, values, against) if against else None
    pixels = options.parse_size(size)
    content = view.load()
    # Decided once, so that both pictures have the same camera.
    camera = view.camera_in(content) or content.default_camera(pixels[0] / pixels[1])
    renderer = pica.Renderer(content, size=pixels, settings=settings, device=device)
    result: dict[str, Any] = {
        "device": renderer.device_name,
        "size": list(pixels),
        "frames": frames,
    }
    if against and others:
        result["against"] = against
        result["whole"], page = _settings(renderer, others, ", ".join(against), camera, frames, json)
    elif effect is None:
        result["samples"] = samples = samples or _SAMPLES
        result["whole"], page = _path_traced(renderer, camera, frames, samples, max_depth, json)
    else:
        result["samples"] = samples = samples or _SAMPLES
        errors, page = _one_effect(renderer, view, camera, frames, samples, effect, sequence or "still", json)
        result |= {"effect": effect, "sequence": sequence or "still", **errors}
    if output is not None:
        from pica.images import pictures

        pictures.write_png(output, page)
    if json:
        print_json(result)
    else:
        print_values(view.scene, {name: value for name, value in result.items() if not name.endswith("by_frame")})


_Found = tuple[dict[str, Any], "NDArray[np.uint8]"]
"""The result of a comparison: the numbers, and a sheet for viewing."""


def _other_settings(preset: str, values: list[str] | None, against: list[str]) -> "Settings":
    """The settings of the first picture, changed by those of --against. Raises PicaError."""
    changed = []
    for text in against:
        name, equals, value = text.partition("=")
        if not equals:
            raise PicaError(f"--against {text!r} is neither preset=name nor group.name=value")
        if name.strip() == "preset":
            preset = value.strip()
        else:
            changed.append(text)
    settings = options.parse_settings(preset, values)
    return settings.with_values(
        {name.strip(): value.strip() for name, _, value in (each.partition("=") for each in changed)}
    )


def _settings(
    renderer: "Renderer", settings: "Settings", name: str, camera: "Camera", frames: int, json: bool
) -> _Found:
    import pica

    with progress("Hybrid", json) as advance:
        hybrid = renderer.render(frames, camera=camera, progress=advance)
    other = pica.Renderer(renderer.scene, size=renderer.size, settings=settings, device=renderer.device)
    with progress(name, json) as advance:
        reference = other.render(frames, camera=camera, progress=advance)
    return _errors(hybrid, f"hybrid, {frames} frames", reference, name)


def _errors(picture: "Frame", title: str, reference: "Frame", reference_title: str) -> _Found:
    from pica import quality

    errors = quality.compare(reference.color, picture.color)
    panels = {
        title: quality.exposed(picture.color, errors.exposure),
        reference_title: quality.exposed(reference.color, errors.exposure),
        f"FLIP {errors.flip:.4f}": errors.flip_map,
    }
    return errors.numbers(), quality.sheet(panels)


def _path_traced(
    renderer: "Renderer", camera: "Camera", frames: int, samples: int, max_depth: int | None, json: bool
) -> _Found:
    import pica

    # First, as it is an error where nothing traces rays.
    tracer = pica.PathTracer(
        renderer.scene, size=renderer.size, max_depth=max_depth, settings=renderer.settings, device=renderer.device
    )
    with progress("Hybrid", json) as advance:
        hybrid = renderer.render(frames, camera=camera, progress=advance)
    with progress("Path traced", json) as advance:
        reference = tracer.render(samples, camera=camera, progress=advance)
    return _errors(hybrid, f"hybrid, {frames} frames", reference, f"path traced, {samples} samples")


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

"""`pica compare`: the hybrid picture against the path traced one or one with other settings, or one effect's buffer."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pica.cli import options
from pica.cli.report import print_json, print_values, progress
from pica.cli.subject import View, find_animation, takes_view
from pica.errors import PicaError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from pica import Frame, Renderer, Settings
    from pica.quality.sequences import Motion

_SAMPLES = 256
_SEQUENCES = ("still", "orbit", "turn", "dolly", "objects", "light", "moving_light")


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
        str | None,
        typer.Option(metavar="NAME", help=f"What moves: {', '.join(_SEQUENCES)}; still unless told."),
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(
            metavar="NUMBER",
            help="Of --sequence, a frame: degrees of orbit and turn, 1 unless told; metres of dolly; seconds of "
            "objects, 1/30 unless told.",
        ),
    ] = None,
    preset: options.Preset = "quality",
    values: options.Values = None,
    against: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE",
            help="Take another hybrid picture for the reference, with preset=NAME or a setting as of --set; "
            "all else is as in the first. May be repeated.",
        ),
    ] = None,
    light_map: options.LightMapFile = None,
    device: options.Device = None,
    json: options.Json = False,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Both pictures and the error, a .png.")
    ] = None,
) -> None:
    """Tell how far the hybrid picture of SCENE is from the path traced one: FLIP, PSNR, relative MSE.

    With --sequence, of the last of the frames, when something moves. With --against, how far it is from the one that
    other settings give. With --effect, how far each frame's buffer of one effect is from the same by many rays, and how
    much it flickers.
    """
    import pica
    from pica.quality.sequences import check_sequence
    from pica.quality.sequences import sequence as sequence_of

    if output is not None:
        options.check_output(output, (".png",))
    if speed is not None and sequence is None:
        raise PicaError("--speed is for --sequence")
    check_sequence(sequence or "still", speed)
    if effect is not None and max_depth is not None:
        raise PicaError("--max-depth is for whole pictures, not for --effect")
    if against and not (effect is None and samples is None and max_depth is None):
        raise PicaError("--against takes no --effect, --samples or --max-depth beside it, as nothing is path traced")
    settings = options.parse_settings(preset, values)
    others = _other_settings(preset, values, against) if against else None
    baked = options.load_light_map(light_map, settings)
    pixels = options.parse_size(size)
    content = view.load()
    # Decided once, so that both pictures have the same camera.
    camera = view.camera_for(content, pixels)
    animation = find_animation(content, view.animation)
    motion = sequence_of(sequence or "still", content, camera, view.start or 0.0, animation, speed)
    renderer = pica.Renderer(content, size=pixels, settings=settings, device=device, light_map=baked)
    result: dict[str, Any] = {
        "device": renderer.device_name,
        "size": list(pixels),
        "frames": frames,
        **(motion.numbers() if sequence or effect else {}),
    }
    if against and others:
        result["against"] = against
        with pica.Renderer(content, size=pixels, settings=others, device=renderer.device, light_map=baked) as other:
            result["whole"], page = _hybrids(renderer, other, ", ".join(against), motion, frames, json)
    elif effect is None:
        result["samples"] = samples = samples or _SAMPLES
        result["whole"], page = _path_traced(renderer, motion, frames, samples, max_depth, json)
    else:
        from pica.quality.effects import compare_effect, error_sheet

        result["samples"] = samples = samples or _SAMPLES
        with progress(effect, json) as advance:
            errors = compare_effect(renderer, effect, motion, frames, samples, progress=advance)
        page = error_sheet(errors)
        result |= {"effect": effect, **errors.numbers()}
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
        {name.strip(): value.strip() for name, _, value in (text.partition("=") for text in changed)}
    )


def _hybrid(renderer: "Renderer", motion: "Motion", frames: int, json: bool, title: str = "Hybrid") -> "Frame":
    """The last of the frames."""
    from pica.quality.playback import last_frame

    with progress(title, json) as advance:
        if motion.name == "still":
            return renderer.render(frames, camera=motion(0), progress=advance)
        return last_frame(renderer, motion, range(frames), advance)


def _hybrids(renderer: "Renderer", other: "Renderer", name: str, motion: "Motion", frames: int, json: bool) -> _Found:
    hybrid = _hybrid(renderer, motion, frames, json)
    reference = _hybrid(other, motion, frames, json, name)
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
    renderer: "Renderer", motion: "Motion", frames: int, samples: int, max_depth: int | None, json: bool
) -> _Found:
    import pica

    # First, as it is an error where nothing traces rays.
    tracer = pica.PathTracer(
        renderer.scene, size=renderer.size, max_depth=max_depth, settings=renderer.settings, device=renderer.device
    )
    hybrid = _hybrid(renderer, motion, frames, json)
    with progress("Path traced", json) as advance:
        reference = tracer.render(samples, camera=motion(frames - 1), progress=advance)
    return _errors(hybrid, f"hybrid, {frames} frames", reference, f"path traced, {samples} samples")

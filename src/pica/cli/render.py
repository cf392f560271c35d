"""`pica render`: a picture of a scene, or a sequence of them."""

import math
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from pica.cli import options
from pica.cli.camera_path import read_camera_path
from pica.cli.report import print_json, print_line, progress
from pica.cli.sequence import FILM, PICTURES, Sequence, is_sequence
from pica.cli.subject import View, takes_view
from pica.errors import PicaError

if TYPE_CHECKING:
    from pica import Camera, Frame, PathTracer, Renderer, Scene

_LEAD_IN = 32
"""Frames after which the histories of a resumed sequence differ little from those of an unbroken run."""


@takes_view
def render(
    view: View,
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="The .png, .exr or .mp4 to write; frames/%04d.png or .exr for numbered pictures.",
        ),
    ],
    size: options.Size = "1280x720",
    frames: Annotated[int | None, options.count("Frames to accumulate, 16 unless told.")] = None,
    preset: options.Preset = "quality",
    values: options.Values = None,
    ev: options.Ev = None,
    aov: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="A buffer to write too; may be repeated. Beside a .png as its own picture (out.normal.png); "
            "in an .exr as channels, which holds every buffer when none is named; debug.shadows.raw, .filtered, "
            ".history, .variance and .footprint show the work of the shadow filters.",
        ),
    ] = None,
    transparent: Annotated[bool, typer.Option("--transparent", help="No background: .png and .exr get alpha.")] = False,
    path_traced: Annotated[bool, typer.Option("--path-traced", help="Use the reference path tracer.")] = False,
    samples: Annotated[int | None, options.count("Paths per pixel with --path-traced, 256 unless told.")] = None,
    denoise: Annotated[
        bool, typer.Option("--denoise", help="Take out the noise that is left (pip install pica[denoise]).")
    ] = False,
    denoise_fast: Annotated[
        bool, typer.Option("--denoise-fast", help="The same, less well, in an eighth of the time.")
    ] = False,
    seconds: Annotated[
        float | None, typer.Option(metavar="S", help="Length of a sequence; without it, until the animation ends.")
    ] = None,
    fps: Annotated[
        float | None, typer.Option(metavar="N", help="Pictures a second of a sequence, 30 unless told.")
    ] = None,
    turntable: Annotated[
        bool, typer.Option("--turntable", help="The camera goes once round what it looks at, in 8 s unless told.")
    ] = False,
    camera_path: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help='Cameras, a JSON list of {"time": s, "eye": [x, y, z], "target": [x, y, z], "fov": degrees}.',
        ),
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Keep the pictures that a run cut short has made; render those missing.")
    ] = False,
    light_map: options.LightMapFile = None,
    lut: options.LutFile = None,
    device: options.Device = None,
    json: options.Json = False,
) -> None:
    """Render SCENE to a picture file, or its movement to a film or to numbered pictures."""
    import pica

    pixels = options.parse_size(size)
    sequence = None
    if is_sequence(output):
        if camera_path is not None and (turntable or view.has_camera):
            raise PicaError("--camera-path takes no --turntable, --camera, --eye, --target or --fov beside it")
        path = None if camera_path is None else read_camera_path(camera_path)
        rate = 30.0 if fps is None else fps
        sequence = Sequence(output, pixels, view.start or 0.0, rate, seconds, view.animation, turntable, path)
        if sequence.is_film and (aov or transparent):
            what = "no alpha; --transparent" if transparent else "no buffers; --aov"
            raise PicaError(f"{output}: a film holds {what} needs pictures, such as frames/%04d.exr")
    else:
        options.check_output(output, (*PICTURES, FILM))
        if seconds is not None or fps is not None or resume or turntable or camera_path is not None:
            given = "--seconds, --fps, --turntable, --camera-path and --resume"
            raise PicaError(f"{output}: {given} are for out.mp4 or pictures such as out/%04d.png")
    settings = options.parse_settings(preset, values, ev)
    if transparent:
        settings = settings.with_values({"visibility.background": "transparent"})
    if light_map is not None and path_traced:
        raise PicaError("--light-map is for the hybrid renderer; --path-traced finds all light itself")
    if path_traced:
        options.warn_of_unread(preset, values)
    baked = options.load_light_map(light_map, settings)
    look = None if lut is None else pica.Lut.load(lut)
    if frames is not None and path_traced:
        raise PicaError("--frames is for the hybrid renderer; with --path-traced, use --samples")
    if samples is not None and not path_traced:
        raise PicaError("--samples is for --path-traced; without it, use --frames")
    if denoise and denoise_fast:
        raise PicaError("--denoise and --denoise-fast are two ways to do one thing")
    way: Literal[True, False, "fast"] = "fast" if denoise_fast else denoise
    if way:
        from pica.denoising.open_image_denoise import check_installed

        check_installed()  # rather than once all is rendered

    began = time.perf_counter()
    content = view.load(moving=sequence is not None)
    times = sequence.times(content) if sequence else []
    missing = list(range(len(times)))
    if sequence and resume:
        missing = sequence.missing(len(times), lambda picture: list(files_of(picture, aov).values()))
    camera_of = (
        _moving_camera(view, content, sequence, times) if sequence else lambda _: view.camera_for(content, pixels)
    )
    loaded = time.perf_counter()
    renderer: Renderer | PathTracer
    if path_traced:
        renderer = pica.PathTracer(content, size=pixels, settings=settings, device=device, lut=look)
        kind, count = "samples", samples or 256
    else:
        renderer = pica.Renderer(content, size=pixels, settings=settings, device=device, light_map=baked, lut=look)
        renderer.debug = any(name.startswith("debug.") for name in aov or [])
        kind, count = "frames", frames or 16
    result: dict[str, Any] = {"scene": view.scene, "device": renderer.device_name, "size": list(pixels), kind: count}
    result["denoised"] = way
    summary = f"{'x'.join(map(str, pixels))}, {count} {kind}{', denoised' if way else ''}"
    times_known: dict[str, Any] = {} if path_traced or sequence is None else {"seconds": 1 / sequence.fps}
    if sequence:
        result["timings"] = sequence.render(
            content,
            times,
            missing,
            shoot=lambda number, whole: renderer.render(
                1 if path_traced and not whole else count,
                camera=camera_of(number),
                denoise=way if whole else False,
                aovs=aov or None,
                **times_known,
            ),
            save=lambda frame, file: save(frame, file, aov),
            lead_in=1 if path_traced else math.ceil(_LEAD_IN / count),
            progress=partial(progress, json=json),
        )
        result |= {"fps": sequence.fps, "start": sequence.start, "pictures": len(times), "rendered": len(missing)}
        summary = f"{len(missing)} of {len(times)} pictures rendered, {summary}"
        files = [output]
    else:
        with progress("Rendering", json) as advance:
            frame = renderer.render(count, camera=camera_of(0), progress=advance, denoise=way, aovs=aov or None)
            files = save(frame, output, aov)
        result["timings"] = frame.timings
    done = time.perf_counter()

    result["seconds"] = {"load": loaded - began, "render": done - loaded}
    result["files"] = [str(file) for file in files]
    if json:
        print_json(result)
    else:
        print_line(f"{', '.join(result['files'])}: {summary}, {done - loaded:.1f} s on {renderer.device_name}")


def _moving_camera(view: View, scene: "Scene", sequence: Sequence, times: list[float]) -> Callable[[int], "Camera"]:
    """The camera of each picture of a sequence; called while the scene is in the picture's state."""
    from pica.scene.orbit import orbited

    path, framed = sequence.path, None
    if path is not None:
        return lambda number: view.focused(scene, path.at(times[number]))
    if not view.has_camera and not scene.cameras():
        framed = sequence.framing(scene, times)

    def now() -> "Camera":
        return view.focused(scene, view.camera_in(scene) or framed or scene.cameras()[0])

    if not sequence.turntable:
        return lambda _: now()
    center = view.looked_at(scene, now())
    return lambda number: orbited(now(), center, 2 * math.pi * number / len(times))


def save(frame: "Frame", output: Path, aovs: list[str] | None) -> list[Path]:
    """Write the picture and, with a .png, one picture for each AOV; the files written. Raises PicaError."""
    for name in aovs or []:
        frame.aov(name)  # raises for an unknown name before anything is written
    files = files_of(output, aovs)
    for name, path in files.items():
        if name:
            frame.save_aov(name, path)
    frame.save(output, aovs=aovs)  # last: where it lies, all that belongs to it does
    return list(files.values())


def files_of(output: Path, aovs: list[str] | None) -> dict[str, Path]:
    """The files that `save` writes, by the name of the AOV; the picture's is empty."""
    beside = [] if output.suffix.lower() == ".exr" else aovs or []
    return {"": output, **{name: output.with_name(f"{output.stem}.{name}{output.suffix}") for name in beside}}

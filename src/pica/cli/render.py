"""`pica render`: a picture of a scene, or a sequence of them."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pica.cli import options
from pica.cli.report import print_json, progress
from pica.cli.sequence import FILM, PICTURES, Sequence, find_animation, is_sequence
from pica.errors import PicaError

if TYPE_CHECKING:
    from pica import Camera, Frame, PathTracer, Renderer, Scene


def render(
    scene: options.SceneName,
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
    frames: options.Frames = 16,
    preset: options.Preset = "hybrid",
    values: options.Values = None,
    camera: Annotated[str | None, typer.Option(metavar="NAME", help="A camera of the scene.")] = None,
    eye: Annotated[str | None, typer.Option(metavar="X,Y,Z", help="Where to look from, in metres.")] = None,
    target: Annotated[str | None, typer.Option(metavar="X,Y,Z", help="What to look at, in metres.")] = None,
    fov: Annotated[
        float | None, typer.Option(metavar="DEGREES", help="Vertical field of view, 45 unless told.")
    ] = None,
    env: Annotated[Path | None, typer.Option(metavar="FILE", help="Environment picture, .hdr or .exr.")] = None,
    aov: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="A buffer to write too; may be repeated. Beside a .png as its own picture (out.normal.png); "
            "in an .exr as channels, which holds every buffer when none is named; debug.shadows.raw, .filtered, "
            ".history, .variance and .footprint show the work of the shadow filters.",
        ),
    ] = None,
    path_traced: Annotated[bool, typer.Option("--path-traced", help="Use the reference path tracer.")] = False,
    samples: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Paths per pixel with --path-traced, 256 unless told.")
    ] = None,
    seconds: Annotated[
        float | None, typer.Option(metavar="S", help="Length of a sequence; without it, until the animation ends.")
    ] = None,
    fps: Annotated[
        float | None, typer.Option(metavar="N", help="Pictures a second of a sequence, 30 unless told.")
    ] = None,
    start: Annotated[
        float | None, typer.Option(metavar="S", help="The time of the (first) picture, 0 unless told.")
    ] = None,
    animation: Annotated[
        str | None, typer.Option(metavar="NAME|N", help="The animation to play; without it, all together.")
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Keep the pictures that a run cut short has made; render those missing.")
    ] = False,
    device: Annotated[str | None, typer.Option(metavar="NAME", help="Part of the device's name.")] = None,
    json: options.Json = False,
) -> None:
    """Render SCENE to a picture file, or its movement to a film or to numbered pictures."""
    import pica

    pixels = options.parse_size(size)
    sequence = None
    if is_sequence(output):
        sequence = Sequence(output, pixels, start or 0.0, 30.0 if fps is None else fps, seconds, animation)
        if sequence.is_film and aov:
            raise PicaError(f"{output}: a film holds no buffers; --aov needs pictures, such as frames/%04d.exr")
    else:
        options.check_output(output, (*PICTURES, FILM))
        if seconds is not None or fps is not None or resume:
            raise PicaError(f"{output}: --seconds, --fps and --resume are for out.mp4 or pictures such as out/%04d.png")
    settings = options.parse_settings(preset, values)
    if samples is not None and not path_traced:
        raise PicaError("--samples is for --path-traced; without it, use --frames")

    began = time.perf_counter()
    content = options.load_scene(scene, env)
    if sequence or start is not None or animation is not None:
        content.animate(start or 0.0, find_animation(content, animation))
    times = sequence.times(content) if sequence else []
    missing = sequence.missing(len(times)) if sequence and resume else list(range(len(times)))
    framed = None

    def view() -> "Camera | None":
        """The camera, where the scene has it at this time."""
        return choose_camera(content, camera, eye, target, fov) or framed

    if view() is None and sequence and not content.cameras():
        framed = sequence.framing(content, times)
    loaded = time.perf_counter()
    renderer: Renderer | PathTracer
    if path_traced:
        renderer = pica.PathTracer(content, pixels, settings=settings, device=device)
        kind, count = "samples", samples or 256
    else:
        renderer = pica.Renderer(content, pixels, settings=settings, device=device)
        renderer.debug = any(name.startswith("debug.") for name in aov or [])
        kind, count = "frames", frames
    result: dict[str, Any] = {"scene": scene, "device": renderer.device_name, "size": list(pixels), kind: count}
    said = f"{'x'.join(map(str, pixels))}, {count} {kind}"
    if sequence:
        result["timings"] = sequence.render(
            content,
            times,
            missing,
            shoot=lambda whole: renderer.render(count if whole else 1, camera=view()),
            save=lambda frame, file: save(frame, file, aov),
        )
        result |= {"fps": sequence.fps, "start": sequence.start, "pictures": len(times), "rendered": len(missing)}
        said = f"{len(missing)} of {len(times)} pictures rendered, {said}"
        files = [output]
    else:
        with progress("Rendering") as advance:
            frame = renderer.render(count, camera=view(), progress=advance)
        result["timings"] = frame.timings
        files = save(frame, output, aov)
    done = time.perf_counter()

    result["seconds"] = {"load": loaded - began, "render": done - loaded}
    result["files"] = [str(file) for file in files]
    if json:
        print_json(result)
    else:
        print(f"{', '.join(result['files'])}: {said}, {done - loaded:.1f} s on {renderer.device_name}")


def choose_camera(
    scene: "Scene", name: str | None, eye: str | None, target: str | None, fov: float | None
) -> "Camera | None":
    """The camera that the options ask for, None for the scene's own. Raises PicaError."""
    import pica

    if name is not None:
        if eye or target or fov is not None:
            raise PicaError("--camera takes no --eye, --target or --fov beside it")
        cameras = {camera.name: camera for camera in scene.cameras()}
        if name not in cameras:
            raise PicaError(f"no camera {name!r} in the scene; there are {', '.join(map(repr, cameras)) or 'none'}")
        return cameras[name]
    if eye is None and target is None and fov is None:
        return None
    if eye is None or target is None:
        raise PicaError("--eye and --target go together; --fov needs both")
    return pica.Camera.look_at(_point("--eye", eye), _point("--target", target), 45.0 if fov is None else fov)


def _point(option: str, text: str) -> tuple[float, ...]:
    try:
        point = tuple(float(part) for part in text.split(","))
    except ValueError:
        point = ()
    if len(point) != 3 or not all(abs(part) < 1e9 for part in point):
        raise PicaError(f"{option} {text!r} is not three numbers X,Y,Z in metres")
    return point


def save(frame: "Frame", output: Path, aovs: list[str] | None) -> list[Path]:
    """Write the picture and, beside a .png, one picture for each AOV; the files written. Raises PicaError."""
    for name in aovs or []:
        frame.aov(name)  # an unknown name is an error before anything is written
    if output.suffix.lower() == ".exr":
        frame.save(output, aovs=aovs)
        return [output]
    extra = {name: output.with_name(f"{output.stem}.{name}{output.suffix}") for name in aovs or []}
    for name, path in extra.items():
        frame.save_aov(name, path)
    frame.save(output)  # last: where it lies, all that belongs to it does
    return [output, *extra.values()]

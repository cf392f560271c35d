"""`pica render`: one picture of a scene."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pica.cli import options
from pica.cli.report import print_json, progress
from pica.errors import PicaError

if TYPE_CHECKING:
    from pica import Camera, Frame, Scene


def render(
    scene: options.SceneName,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="The .png or .exr to write.")],
    size: options.Size = "1280x720",
    frames: options.Frames = 16,
    preset: Annotated[str, typer.Option(metavar="NAME", help="Named settings: hybrid or raster.")] = "hybrid",
    values: Annotated[
        list[str] | None, typer.Option("--set", metavar="GROUP.NAME=VALUE", help="One setting; may be repeated.")
    ] = None,
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
            "in an .exr as channels, which holds every buffer when none is named.",
        ),
    ] = None,
    path_traced: Annotated[bool, typer.Option("--path-traced", help="Use the reference path tracer.")] = False,
    samples: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Paths per pixel with --path-traced, 256 unless told.")
    ] = None,
    device: Annotated[str | None, typer.Option(metavar="NAME", help="Part of the device's name.")] = None,
    json: options.Json = False,
) -> None:
    """Render SCENE to a picture file."""
    import pica

    options.check_output(output, (".png", ".exr"))
    width, height = options.parse_size(size)
    settings = pica.Settings.preset(preset).with_values(parse_values(values or []))
    if samples is not None and not path_traced:
        raise PicaError("--samples is for --path-traced; without it, use --frames")

    start = time.perf_counter()
    content = options.load_scene(scene, env)
    view = choose_camera(content, camera, eye, target, fov)
    loaded = time.perf_counter()
    work: Callable[..., Frame]
    if path_traced:
        tracer = pica.PathTracer(content, size=(width, height), settings=settings, device=device)
        counts, work, device_name = {"samples": samples or 256}, tracer.render, tracer.device_name
    else:
        renderer = pica.Renderer(content, size=(width, height), settings=settings, device=device)
        counts, work, device_name = {"frames": frames}, renderer.render, renderer.device_name
    with progress("Rendering") as advance:
        frame = work(**counts, camera=view, progress=advance)
    rendered = time.perf_counter()
    files = save(frame, output, aov)

    count = ", ".join(f"{number} {name}" for name, number in counts.items())
    if json:
        result: dict[str, Any] = {"scene": scene, "device": device_name, "size": [width, height], **counts}
        result["timings"] = frame.timings
        result["seconds"] = {"load": loaded - start, "render": rendered - loaded}
        print_json(result | {"files": [str(file) for file in files]})
    else:
        print(f"{', '.join(map(str, files))}: {width}x{height}, {count}, {rendered - loaded:.1f} s on {device_name}")


def parse_values(texts: list[str]) -> dict[str, str]:
    """{"shadows.mode": "hard"} of ["shadows.mode=hard"]. Raises PicaError."""
    for text in texts:
        if "=" not in text:
            raise PicaError(f"--set {text!r} is not group.name=value")
    return {name.strip(): value.strip() for name, _, value in (text.partition("=") for text in texts)}


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
    frame.save(output)
    extra = {name: output.with_name(f"{output.stem}.{name}{output.suffix}") for name in aovs or []}
    for name, path in extra.items():
        frame.save_aov(name, path)
    return [output, *extra.values()]

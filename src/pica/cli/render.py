"""`pica render`: a picture of a scene, or a sequence of them."""

import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from pica.cli import options
from pica.cli.camera_path import read_camera_path
from pica.cli.render_job import RenderJob, save
from pica.cli.report import print_json, print_line, progress
from pica.cli.sequence import FILM, PICTURES, Sequence, is_sequence
from pica.cli.subject import View, takes_view
from pica.errors import PicaError


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
    cluster: options.Cluster = None,
    light_map: options.LightMapFile = None,
    lut: options.LutFile = None,
    device: options.Device = None,
    devices: options.Devices = None,
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
        for_sequences = (seconds, fps, camera_path, cluster)
        if any(value is not None for value in for_sequences) or resume or turntable:
            given = "--seconds, --fps, --turntable, --camera-path, --cluster and --resume"
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
    if devices is not None and (device is not None or cluster is not None):
        raise PicaError("--devices takes no --device and no --cluster beside it")
    if denoise and denoise_fast:
        raise PicaError("--denoise and --denoise-fast are two ways to do one thing")
    way: Literal[True, False, "fast"] = "fast" if denoise_fast else denoise
    if way:
        from pica.denoising.open_image_denoise import check_installed

        check_installed()  # rather than once all is rendered
    if cluster is not None:
        from pica.distributed.cluster import check_installed as check_ray

        check_ray()
    job = RenderJob(
        view=view,
        size=pixels,
        settings=settings,
        path_traced=path_traced,
        count=(samples or 256) if path_traced else (frames or 16),
        denoise=way,
        aov=aov,
        device=device,
        light_map=baked,
        lut=look,
        devices=options.parse_devices(devices),
        sequence=sequence,
    )
    began = time.perf_counter()
    content = view.load(moving=sequence is not None)
    times = sequence.times(content) if sequence else []
    missing = list(range(len(times)))
    if sequence and resume:
        missing = sequence.missing(len(times), job.files)
    camera_of = job.moving_camera(content, times) if sequence else lambda _: view.camera_for(content, pixels)
    loaded = time.perf_counter()
    show = partial(progress, json=json)
    kind, timings, files = "samples" if path_traced else "frames", {}, [output]
    if cluster is None:
        renderer = job.renderer(content)
        where = renderer.device_name
        if sequence:
            timings = job.render_sequence(content, renderer, camera_of, times, missing, show)
        else:
            with show("Rendering") as advance:
                frame = renderer.render(job.count, camera=camera_of(0), progress=advance, denoise=way, aovs=aov or None)
                files = save(frame, output, aov)
            timings = frame.timings
    else:
        where = f"cluster {cluster}"
        _render_on_cluster(job, missing, cluster, show)
    summary = f"{'x'.join(map(str, pixels))}, {job.count} {kind}{', denoised' if way else ''}"
    result: dict[str, Any] = {"scene": view.scene, "device": where, "size": list(pixels), kind: job.count}
    result |= {"denoised": way, "timings": timings}
    if sequence:
        sequence.finish(len(times))
        result |= {"fps": sequence.fps, "start": sequence.start, "pictures": len(times), "rendered": len(missing)}
        summary = f"{len(missing)} of {len(times)} pictures rendered, {summary}"
    done = time.perf_counter()

    result["seconds"] = {"load": loaded - began, "render": done - loaded}
    result["files"] = [str(file) for file in files]
    if json:
        print_json(result)
    else:
        print_line(f"{', '.join(result['files'])}: {summary}, {done - loaded:.1f} s on {where}")


def _render_on_cluster(
    job: RenderJob,
    missing: list[int],
    address: str,
    show: Callable[[str], AbstractContextManager[Callable[[int, int], None]]],
) -> None:
    """The missing pictures, by the machines of a Ray cluster."""
    from pica.distributed.cluster import do_on_cluster

    assert job.sequence is not None
    for number in missing:  # of another run: workers keep what is there
        for file in job.files(job.sequence.file(number)):
            file.unlink(missing_ok=True)
    work = replace(job, chunks=job.split(missing))
    with show("Rendering") as advance:
        do_on_cluster(work, range(len(work.chunks)), address, advance)

"""`pica demo`: films of built-in scenes."""

import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pica.cli import options
from pica.cli.demo_sheet import write_sheet
from pica.cli.report import print_columns, print_json, print_line, progress
from pica.cli.sequence import Sequence, is_sequence
from pica.errors import PicaError
from pica.names import did_you_mean

if TYPE_CHECKING:
    from pica import Frame

_ON_CARD: dict[str, Any] = {"size": "1920x1080", "preset": "quality", "seconds": None}
_ON_PROCESSOR: dict[str, Any] = {"size": "640x360", "preset": "performance", "seconds": 6.0}
"""Defaults; no seconds: all shots whole."""
_FPS = 30.0
_FIRST = 8
"""Frames of the first picture after a cut, on all devices."""


def demo(
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME]", help="machine_world, showroom or corridor; without it, a list.")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE", help="The .mp4, or frames/%04d.png or .exr for pictures."),
    ] = None,
    size: Annotated[
        str | None,
        typer.Option(metavar="WxH", help="Size in pixels; unless told 1920x1080, without a graphics card 640x360."),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option(
            metavar="S", help="A shorter film has the first part of each shot; without a graphics card 6 unless told."
        ),
    ] = None,
    fps: Annotated[float, typer.Option(metavar="N", help="Pictures a second.")] = _FPS,
    preset: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="As of pica render; quality, without a graphics card performance."),
    ] = None,
    values: options.Values = None,
    sheet: Annotated[
        bool,
        typer.Option("--sheet", help="Instead of a film: raster, path traced, hybrid and reference side by side."),
    ] = False,
    device: options.Device = None,
    json: options.Json = False,
) -> None:
    """Render the film NAME of a built-in scene; without NAME, list them.

    Each picture is one frame, as in real time. Cameras are directed, and cut. With --sheet, one picture of
    machine_world that compares ways to render it.
    """
    from pica.scenes.demos import DEMOS

    if sheet:
        if output is None or values or (name, size, seconds, fps, preset) != (None, None, None, _FPS, None):
            raise PicaError("pica demo --sheet takes -o FILE.png, and no NAME and no options of films")
        write_sheet(output, device, json)
        return
    if name is None:
        _list(json)
        return
    if name not in DEMOS:
        raise PicaError(f"no demo {name!r}; there are {', '.join(DEMOS)}{did_you_mean(name, DEMOS)}")
    if output is None or not is_sequence(output):
        raise PicaError(f"pica demo {name} needs a film to write, such as -o {name}.mp4")

    import pica
    from pica.rhi.adapters import choose, is_software

    usual = _ON_PROCESSOR if is_software(choose(device)) else _ON_CARD
    film = DEMOS[name]
    pixels = options.parse_size(size or usual["size"])
    length = (usual["seconds"] or film.seconds) if seconds is None else seconds
    sequence = Sequence(output, pixels, 0.0, fps, length, None)
    settings = options.parse_settings(preset or usual["preset"], values)
    settings = settings.with_values({"antialiasing.first_samples": max(settings.antialiasing.first_samples, _FIRST)})

    began = time.perf_counter()
    scene = film.make()
    pictures = film.pictures(fps, length)
    renderer = pica.Renderer(scene, size=pixels, settings=settings, device=device)

    def shoot(number: int, _: bool) -> "Frame":
        picture = pictures[number]
        render = partial(renderer.render, 1, camera=picture.camera, aovs=(), seconds=1 / fps)
        if picture.is_cut:  # objects move from where they were in this shot, not in the one before
            scene.animate(picture.time - 1 / fps)
            render(cut=True)
            scene.animate(picture.time)
        return render()

    timings = sequence.render(
        scene,
        [picture.time for picture in pictures],
        list(range(len(pictures))),
        shoot,
        lambda frame, file: frame.save(file, aovs=()),
        restart=lambda number: None,  # its first frame is a new renderer's
        lead_in=0,
        progress=partial(progress, json=json),
    )
    took = time.perf_counter() - began
    summary = f"{len(pictures)} pictures, {'x'.join(map(str, pixels))}, {took:.1f} s on {renderer.device_name}"
    if json:
        print_json({
            "demo": name, "device": renderer.device_name, "size": list(pixels), "fps": fps, "pictures": len(pictures),
            "seconds": took, "timings": timings, "files": [str(output)],
        })  # fmt: skip
    else:
        print_line(f"{output}: {summary}")


def _list(json: bool) -> None:
    from pica.scenes.demos import DEMOS

    if json:
        print_json({name: {"seconds": film.seconds, "about": film.about} for name, film in DEMOS.items()})
    else:
        print_columns([(name, f"{film.seconds:g} s", film.about) for name, film in DEMOS.items()], right={1})

"""`pica view`: a scene live in the browser."""

import sys
from contextlib import redirect_stdout
from typing import Annotated

import typer

from pica.cli import options
from pica.cli.interrupts import cleaning_up_first
from pica.cli.report import print_json, print_line
from pica.cli.subject import View, find_animation, parse_limits, takes_view


@takes_view
def view(
    subject: View,
    size: options.Size = "1280x720",
    frames: Annotated[int, options.count("Frames of a picture at rest, after which it is complete.")] = 64,
    preset: options.Preset = "quality",
    values: options.Values = None,
    ev: options.Ev = None,
    light_map: options.LightMapFile = None,
    host: Annotated[
        str,
        typer.Option(
            metavar="ADDRESS",
            help="Address to listen on, 0.0.0.0 for other machines, too: they need the printed token.",
        ),
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(metavar="N", help="Port to listen on; 0 takes any free one.")] = 8080,
    device: options.Device = None,
    json: options.Json = False,
) -> None:
    """Look at SCENE live in the browser: move the camera, change settings, pick surfaces. Ctrl-C ends it."""
    from pica.viewer.viewer import Viewer
    from pica.viewer.web.server import WebViewer, import_viser

    import_viser()  # rather than once all is loaded
    settings = options.parse_settings(preset, values, ev)
    pixels = options.parse_size(size)
    baked = options.load_light_map(light_map, settings)
    scene = subject.load()
    viewer = Viewer(
        scene,
        settings=settings,
        device=device,
        light_map=baked,
        frames=frames,
        start=subject.start or 0.0,
        animation=find_animation(scene, subject.animation),
    )
    limits, camera = parse_limits(subject.limit), subject.camera_in(scene)
    web = WebViewer(viewer, size=pixels, host=host, port=port, camera=camera, limits=limits)
    if json:
        print_json({"address": web.address})
    else:
        print_line(f"{web.address} (Ctrl-C ends it)")
    sys.stdout.flush()  # whoever started this reads the address now
    with cleaning_up_first(), redirect_stdout(sys.stderr):
        try:
            web.run()
        finally:
            web.stop()
            web.viewer.close()

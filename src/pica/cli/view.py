"""`pica view`: a scene live in the browser, or in a window."""

import sys
from contextlib import redirect_stdout
from typing import TYPE_CHECKING, Annotated

import typer

from pica.cli import options
from pica.cli.interrupts import cleaning_up_first
from pica.cli.report import print_json, print_line
from pica.cli.subject import View, find_animation, parse_limits, takes_view

if TYPE_CHECKING:
    from pica import Camera, Limits, Scene
    from pica.viewer.viewer import Viewer

_TURN = 2e-4
"""Seconds that a thread may keep others waiting for Python's interpreter, which has 5e-3: those that read cameras and
send pictures have little to do, but often."""


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
    window: Annotated[
        bool, typer.Option("--window", help="Show it in a window of this machine instead of a browser.")
    ] = False,
    device: options.Device = None,
    json: options.Json = False,
) -> None:
    """Look at SCENE live, in a browser or a window: move the camera, change settings, pick surfaces. Ctrl-C ends it."""
    from pica.viewer.viewer import Viewer

    if window:
        _check_display()
    else:
        from pica.viewer.web.server import import_viser

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
    if window:
        _show_window(viewer, pixels, camera, limits, subject)
    else:
        _serve(viewer, pixels, camera, limits, host, port, json)


def _check_display() -> None:
    """Raises PicaError without a display, before anything is loaded."""
    from pica.viewer.window.presenter import open_window

    open_window((64, 64)).close()


def _show_window(
    viewer: "Viewer", size: tuple[int, int], camera: "Camera | None", limits: "Limits", subject: View
) -> None:
    from pica.viewer.window.window_viewer import WindowViewer

    def load(name: str) -> "Scene":
        return View(name, allow_outside=subject.allow_outside, limit=subject.limit).load()

    shown = WindowViewer(viewer, size=size, camera=camera, load=load, limits=limits)
    with cleaning_up_first():
        try:
            shown.run()
        finally:
            shown.close()


def _serve(
    viewer: "Viewer",
    size: tuple[int, int],
    camera: "Camera | None",
    limits: "Limits",
    host: str,
    port: int,
    json: bool,
) -> None:
    from pica.viewer.web.server import WebViewer

    web = WebViewer(viewer, size=size, host=host, port=port, camera=camera, limits=limits)
    if json:
        print_json({"address": web.address})
    else:
        print_line(f"{web.address} (Ctrl-C ends it)")
    sys.stdout.flush()  # whoever started this reads the address now
    sys.setswitchinterval(_TURN)
    with cleaning_up_first(), redirect_stdout(sys.stderr):
        try:
            web.run()
        finally:
            web.stop()
            web.viewer.close()

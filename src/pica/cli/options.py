"""Arguments that several commands share."""

import math
import re
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pica.errors import PicaError
from pica.images.saving import check_writable

if TYPE_CHECKING:
    from pica import LightMap, Settings

_SATURATION = math.log2(1.2)
"""Stops from 2^EV100 nits to what is white in a camera: 78 / (100 * 0.65) times that (ISO 12232:2006, saturation based
speed, with a lens that lets 0.65 of the light through; Lagarde and de Rousiers 2014, "Moving Frostbite to Physically
Based Rendering", section 5.1.2)."""

MAX_SIDE = 16384
"""Pixels; the limit of graphics devices for one picture."""

_OF_PATH_TRACING = ("visibility.", "geometry.", "rays.", "shadows.transparent.", "post.", "seed.")
"""Prefixes of the path tracer's settings, with a dot at the end."""

_OF_TIME = ("post.shutter", "post.adaptation_up", "post.adaptation_down")
"""Of these the path tracer, whose pictures have one time, reads none."""

MOST = 1_000_000
"""Upper limit of counts: frames, samples, pictures."""


def count(text: str, least: int = 1) -> Any:
    """An option with a count."""
    return typer.Option(min=least, max=MOST, metavar="N", help=text)


Size = Annotated[str, typer.Option("--size", metavar="WxH", help="Size of the picture in pixels.")]
Frames = Annotated[int, count("Frames to accumulate.")]
Preset = Annotated[
    str,
    typer.Option(
        metavar="NAME",
        help="Named settings: performance, balanced, quality, cinematic or raster; frames of publications: pica_pica,"
        " ue4_reflections, ue4_speed_of_light.",
    ),
]
Values = Annotated[
    list[str] | None, typer.Option("--set", metavar="GROUP.NAME=VALUE", help="One setting; may be repeated.")
]
Device = Annotated[
    str | None, typer.Option(metavar="NAME", help="Part of the device's name; without it, the best there is.")
]
Devices = Annotated[
    str | None,
    typer.Option(
        metavar="LIST",
        help="Several, such as 0,1 (pica doctor), that share the rays of a frame, or the samples of --path-traced.",
    ),
]
AllowOutside = Annotated[
    bool, typer.Option("--allow-outside", help="Also read files outside SCENE's folder, such as textures in ../")
]
LimitsAsForRender = Annotated[
    list[str] | None, typer.Option("--limit", metavar="NAME=N", help="What loading may take, as for render.")
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object; progress as JSON lines on stderr.")]
Cluster = Annotated[
    str | None,
    typer.Option(
        metavar="auto|ADDRESS",
        help="Render on the machines of a Ray cluster, which share this folder (pip install pica[ray]).",
    ),
]


Ev = Annotated[
    float | None,
    typer.Option(
        min=-29,
        max=29,
        metavar="EV100",
        help="Expose by hand instead, as a camera: 15 for sunlight, 8 for rooms, 0 for dusk.",
    ),
]

LutFile = Annotated[
    Path | None,
    typer.Option("--lut", metavar="FILE", help="A .cube file, which changes the colours of the display."),
]

LightMapFile = Annotated[
    Path | None,
    typer.Option(
        "--light-map",
        metavar="FILE",
        help="What pica bake has made of SCENE, for --preset raster, or global_illumination.mode but off and surfels.",
    ),
]


def parse_size(text: str) -> tuple[int, int]:
    """(width, height) of "1280x720". Raises PicaError."""
    match = re.fullmatch(r"([0-9]{1,9})[xX]([0-9]{1,9})", text.strip())
    if not match:
        raise PicaError(f"--size {text!r} is not WIDTHxHEIGHT in pixels, such as 1280x720")
    width, height = int(match[1]), int(match[2])
    if not (1 <= width <= MAX_SIDE and 1 <= height <= MAX_SIDE):
        raise PicaError(f"--size {text}: width and height must be 1 to {MAX_SIDE} pixels")
    return width, height


def parse_devices(text: str | None) -> list[str] | None:
    """Names of devices as `devices=` has them, of "0,1"."""
    if text is None:
        return None
    names = [name.strip() for name in text.split(",")]
    return [f"#{name}" if re.fullmatch("[0-9]{1,3}", name) else name for name in names]


def parse_settings(preset: str, texts: list[str] | None, ev: float | None = None) -> "Settings":
    """A preset with the settings of ["shadows.mode=hard"] changed, exposed at `ev` if given. Raises PicaError."""
    import pica

    for text in texts or []:
        if "=" not in text:
            raise PicaError(f"--set {text!r} is not group.name=value")
    pairs = (text.partition("=") for text in texts or [])
    values: dict[str, str | float | bool] = {name.strip(): value.strip() for name, _, value in pairs}
    if ev is not None:
        if clash := [name for name in values if name in ("post.exposure", "post.auto_exposure")]:
            raise PicaError(f"--ev and --set {clash[0]} both say how to expose")
        values |= {"post.auto_exposure": False, "post.exposure": -ev - _SATURATION}
    return pica.Settings.preset(preset).with_values(values)


def warn_of_unread(preset: str, texts: list[str] | None) -> None:
    """Warn of settings that are given and that path tracing does not read."""
    names = [text.partition("=")[0].strip() for text in texts or []]
    unread = [
        f"--set {name}"
        for name in dict.fromkeys(names)
        if name in _OF_TIME or not f"{name}.".startswith(_OF_PATH_TRACING)
    ]
    unread = [*([f"--preset {preset}"] if preset != "quality" else []), *unread]
    if unread:
        fault = "changes nothing, as path tracing does not read it"
        warnings.warn(f"--path-traced: {', '.join(unread)} {fault}", stacklevel=2)


def load_light_map(path: Path | None, settings: "Settings") -> "LightMap | None":
    """The light map of a file. Raises PicaError where the settings have no use for it."""
    import pica

    if path is None:
        return None
    mode = settings.global_illumination.mode
    if mode in ("off", "surfels"):
        way = "--preset raster or --set global_illumination.mode=light_map, path_traced or restir"
        raise PicaError(f"--light-map: global_illumination.mode is {mode}, which does not use it; give {way} too")
    return pica.LightMap.load(path)


def check_output(path: Path, suffixes: tuple[str, ...]) -> None:
    """Raise PicaError now if `path` cannot be written later: it has another suffix, or cannot be put where it is."""
    if path.suffix.lower() not in suffixes:
        raise PicaError(f"cannot write {path}: the name must end in {' or '.join(suffixes)}")
    if not path.parent.is_dir():
        raise PicaError(f"cannot write {path}: there is no folder {path.parent}")
    check_writable(path)

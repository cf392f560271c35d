"""`pica info`: what a scene file holds, without rendering it."""

import warnings
from collections.abc import Callable, Iterator, Mapping
from json import dumps as to_json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pica.cli import options
from pica.cli.report import print_columns, print_json, print_line
from pica.cli.subject import BUILT_IN, load_scene, parse_limits
from pica.errors import SceneError
from pica.text import one_line, printable

if TYPE_CHECKING:
    from pica import Limits

_MOST = 40
"""Lines of a list; --json has all."""
_WIDEST = 200
"""Characters of a value."""


def info(
    scene: Annotated[
        str, typer.Argument(metavar="SCENE", help=f"A file, as for render, or one of {', '.join(BUILT_IN)}.")
    ],
    variant: Annotated[str | None, typer.Option(metavar="NAME", help="A variant of the file's materials.")] = None,
    allow_outside: options.AllowOutside = False,
    limit: options.LimitsAsForRender = None,
    json: options.Json = False,
) -> None:
    """Tell what SCENE holds: counts, textures, extensions and what is done with each, metadata, memory.

    It is loaded, with all checks and warnings, and not rendered; no device is opened. Counts are of what pica shows:
    of the default scene, and of one variant. The device memory is an estimate, without the pictures of a frame.
    """
    limits = parse_limits(limit)
    result: dict[str, Any] = {"scene": scene}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            result |= _loaded(scene, allow_outside, limits, variant)
            error = None
        except SceneError as fault:
            result |= _of_file(scene, allow_outside, limits)
            error = fault
    result["warnings"] = [str(each.message).removeprefix(f"{printable(scene)}: ") for each in caught]
    if error is None or len(result) > 2:  # otherwise nothing is known
        print_json(result) if json else _print(result)
    if error is not None:
        raise error


def _loaded(name: str, allow_outside: bool, limits: "Limits", variant: str | None) -> dict[str, Any]:
    from pica.gpu_scene.memory_estimate import estimated_memory
    from pica.scene.contents import contents

    scene = load_scene(name, None, allow_outside, limits, None, variant)
    memory = estimated_memory(scene)
    source = {} if scene.source is None else vars(scene.source)
    return source | contents(scene) | {"device_memory": memory | {"total": sum(memory.values())}}


def _of_file(name: str, allow_outside: bool, limits: "Limits") -> dict[str, Any]:
    """What a glTF file that cannot be loaded says of itself; nothing if it cannot be read, or is of another format."""
    from pica.scene import gltf
    from pica.scene.conversion.formats import format_of
    from pica.scene.limits import Budget

    if format_of(Path(name)) is not None:
        return {}
    try:
        return vars(gltf.source(name, Budget(limits), allow_outside))
    except SceneError:
        return {}


def _print(result: Mapping[str, Any]) -> None:
    print_columns([(name, one_line(value, _WIDEST)) for name, value in _rows(result)])
    for text in result["warnings"]:
        print_line(f"warning: {text}")


def _rows(result: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Names and values, without those that are empty; entries of lists are indented."""
    for key, value in result.items():
        if not value or key == "warnings":
            continue
        name = _NAMES.get(key, key.replace("_", " "))
        if key in _ENTRIES:
            entries = [_ENTRIES[key](each) for each in (value.items() if isinstance(value, Mapping) else value)]
            yield f"{name} ({len(entries):,})" if isinstance(value, list) else name, ""
            yield from ((f"  {one_line(first, 60) or '(no name)'}", second) for first, second in entries[:_MOST])
            if len(entries) > _MOST:
                yield f"  and {len(entries) - _MOST:,} more", ""
        else:
            yield name, _VALUES.get(key, _plain)(value)


def _plain(value: Any) -> str:
    return f"{value:,}" if isinstance(value, int) else str(value)


def _bytes(count: int) -> str:
    for unit, size in (("GB", 10**9), ("MB", 10**6), ("kB", 10**3)):
        if count >= size:
            return f"{count / size:.3g} {unit}"
    return f"{count} bytes"


def _texture(texture: Mapping[str, Any]) -> tuple[str, str]:
    file, device = texture["file_format"] or "made by pica", texture["device_format"]
    return texture["name"], f"{texture['width']}x{texture['height']}, {file}, {device} on the device"


_NAMES = {"bytes": "size on disk", "device_memory": "memory on the device, about"}
_VALUES: dict[str, Callable[[Any], str]] = {
    "bytes": _bytes,
    "size": lambda sides: " x ".join(f"{side:.3g}" for side in sides) + " m",
    "lights": lambda lights: ", ".join(f"{count:,} {kind}" for kind, count in lights.items()),
    "environment": lambda picture: f"{picture['name'] or '(no name)'}, {picture['width']}x{picture['height']}",
}
_ENTRIES: dict[str, Callable[[Any], tuple[str, str]]] = {
    "xmp": lambda entry: (entry[0], entry[1] if isinstance(entry[1], str) else to_json(entry[1])),
    "extensions": lambda entry: entry,
    "textures": _texture,
    "cameras": lambda name: (name, ""),
    "animations": lambda animation: (animation["name"], f"{animation['seconds']:.3g} s"),
    "variants": lambda name: (name, ""),
    "device_memory": lambda entry: (entry[0].replace("_", " "), _bytes(entry[1])),
}
"""Name and value of an entry of a list, or of a name and a value of a mapping."""

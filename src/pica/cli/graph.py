"""`pica graph`: the passes of a frame, the resources that they read and write, and shared memory."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pica.cli import options
from pica.cli.report import print_columns, print_json, print_line, progress
from pica.cli.subject import View, takes_view

if TYPE_CHECKING:
    from pica.graph import GraphDescription

_FRAMES = 4
"""Before the graph is looked at: conditional passes have found their way, and the device its clock."""
_MOST = 3
"""Resources of another effect that a row of the table names one by one."""


@takes_view
def graph(
    view: View,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="The .svg to write; without it, a table.")
    ] = None,
    size: options.Size = "1280x720",
    preset: options.Preset = "quality",
    values: options.Values = None,
    light_map: options.LightMapFile = None,
    device: options.Device = None,
    devices: options.Devices = None,
    json: options.Json = False,
) -> None:
    """Show the frame graph of SCENE: passes in their order, resources, memory and times, as a chart or a table.

    Times are those of one frame; bench has medians.
    """
    import pica

    pixels = options.parse_size(size)
    if output is not None:
        options.check_output(output, (".svg",))
    settings = options.parse_settings(preset, values)
    baked = options.load_light_map(light_map, settings)
    content = view.load()
    where = options.parse_devices(devices)
    renderer = pica.Renderer(content, size=pixels, settings=settings, device=device, devices=where, light_map=baked)
    with progress("Rendering", json) as advance:
        renderer.render(_FRAMES, camera=view.camera_for(content, pixels), progress=advance, aovs=())
    description = renderer.graph
    title = f"{view.scene}, {preset}, {'x'.join(map(str, pixels))}, {renderer.device_name}"
    if output is not None:
        description.save(output, title)
    if json:
        print_json({"scene": view.scene, "device": renderer.device_name, "size": list(pixels), **description.as_dict()})
    elif output is not None:
        print_line(f"{output}: {title}")
    else:
        print_table(title, description)


def _listed(effect: str, keys: tuple[str, ...]) -> str:
    """Names without the effect's own; of another that many are of, such as the G-buffer, its name alone."""
    by_effect: dict[str, list[str]] = {}
    for key in keys:
        by_effect.setdefault(key.split("/")[0], []).append(key)
    parts = []
    for other, own in by_effect.items():
        short = [key.removeprefix(f"{effect}/") for key in own]
        parts += short if other == effect or len(own) <= _MOST else [f"{other}/*"]
    return ", ".join(parts)


def print_table(title: str, description: "GraphDescription") -> None:
    """A row for each pass, then one for each effect."""
    print_line(title)
    rows = [["effect", "pass", "ms", "reads", "writes"]]
    for node in description.passes:
        time = "" if node.milliseconds is None else f"{node.milliseconds:.3f}"
        reads = _listed(node.effect, (*node.reads, *(f"{key} before" for key in node.previous)))
        writes = _listed(node.effect, node.writes)
        name = f"{node.name} (if needed)" if node.conditional else node.name
        if node.bytes is not None:
            name = f"{node.name}, {node.bytes / 1e6:.2f} MB"
        rows.append([node.effect, name, time, reads, writes])
    print_columns(rows, right={2})
    print()
    times = description.milliseconds
    sums = [["effect", "ms", "MB"]]
    for effect in dict.fromkeys([*times, *description.memory]):
        sums.append([effect, f"{times.get(effect, 0):.3f}", f"{description.memory.get(effect, 0) / 1e6:.2f}"])
    sums.append(["all", f"{sum(times.values()):.3f}", f"{sum(description.memory.values()) / 1e6:.2f}"])
    print_columns(sums, right={1})

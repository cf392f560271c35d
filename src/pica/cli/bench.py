"""`pica bench`: how fast a scene renders."""

from typing import Annotated

import typer

from pica.cli import options
from pica.cli.report import print_json, print_table


def bench(
    scene: options.SceneName,
    size: options.Size = "1920x1080",
    frames: Annotated[int, typer.Option(min=1, metavar="N", help="Frames to measure.")] = 200,
    warm_up: Annotated[int, typer.Option(min=0, metavar="N", help="Frames before the first one measured.")] = 50,
    preset: options.Preset = "hybrid",
    values: options.Values = None,
    json: options.Json = False,
) -> None:
    """Measure SCENE: GPU milliseconds per pass, host milliseconds per frame, rays per second, memory."""
    import pica
    from pica.quality.benchmark import benchmark

    pixels = options.parse_size(size)
    settings = options.parse_settings(preset, values)
    renderer = pica.Renderer(options.load_scene(scene), size=pixels, settings=settings)
    measured = benchmark(renderer, frames=frames, warm_up=warm_up)
    result = {"scene": scene, "device": renderer.device_name, "size": list(pixels), "frames": frames, **measured}
    if json:
        print_json(result)
    else:
        print_table(scene, result)

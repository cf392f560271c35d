"""`pica bench`: how fast a scene renders."""

from typing import Annotated

from pica.cli import options
from pica.cli.report import print_json, print_values, progress
from pica.cli.view import View, takes_view


@takes_view
def bench(
    view: View,
    size: options.Size = "1920x1080",
    frames: Annotated[
        int | None,
        options.count("Frames to measure; unless told 200, without a graphics card 20."),
    ] = None,
    warm_up: Annotated[
        int | None,
        options.count("Frames before the first one measured; unless told 50, without a graphics card 3.", least=0),
    ] = None,
    preset: options.Preset = "hybrid",
    values: options.Values = None,
    light_map: options.LightMapFile = None,
    device: options.Device = None,
    json: options.Json = False,
) -> None:
    """Measure SCENE: GPU milliseconds per pass, host milliseconds per frame, rays per second, memory.

    Beside it the same picture by the path tracer, with all light: milliseconds a sample, and the frame over that.
    """
    import pica
    from pica.quality.benchmark import benchmark, path_traced_sample

    pixels = options.parse_size(size)
    settings = options.parse_settings(preset, values)
    baked = options.load_light_map(light_map, settings)
    content = view.load()
    camera = view.camera_in(content)
    renderer = pica.Renderer(content, size=pixels, settings=settings, device=device, light_map=baked)
    with progress("Measuring", json) as advance:
        measured = benchmark(renderer, camera, frames, warm_up, progress=advance)
    with progress("Path tracing", json) as advance:
        measured["path_traced"] = path_traced_sample(renderer, measured["gpu_ms"]["frame"], camera, advance)
    result = {"scene": view.scene, "device": renderer.device_name, "size": list(pixels), **measured}
    if json:
        print_json(result)
    else:
        print_values(view.scene, {name: value for name, value in result.items() if value is not None})

"""`pica bench`: how fast a scene renders."""

from typing import Annotated

from pica.cli import options
from pica.cli.report import print_beside, print_json, print_values, progress
from pica.cli.subject import View, takes_view


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
    preset: options.Preset = "quality",
    values: options.Values = None,
    light_map: options.LightMapFile = None,
    device: options.Device = None,
    json: options.Json = False,
) -> None:
    """Measure SCENE while the camera moves and at rest: GPU milliseconds and rays per pass and per effect, host
    milliseconds per frame, rays per second, memory.

    The camera orbits what it looks at by a degree a frame; within the scene it turns about itself. Beside it the
    same picture by the path tracer, with all light: milliseconds a sample, and the moving frame over that.
    """
    import pica
    from pica.quality.benchmark import benchmark, path_traced_sample
    from pica.quality.sequences import sequence

    pixels = options.parse_size(size)
    settings = options.parse_settings(preset, values)
    baked = options.load_light_map(light_map, settings)
    content = view.load()
    camera = view.camera_for(content, pixels)
    orbit = sequence("orbit", content, camera)
    renderer = pica.Renderer(content, size=pixels, settings=settings, device=device, light_map=baked)
    measured = {}
    for way, play in (("moving", orbit), ("rest", None)):
        renderer.reset()
        with progress(f"Measuring, {_TITLES[way]}", json) as advance:
            measured[way] = benchmark(renderer, camera, frames, warm_up, advance, play)
    with progress("Path tracing", json) as advance:
        traced = path_traced_sample(renderer, measured["moving"]["gpu_ms"]["frame"], camera, advance)
    shared = {
        name: [figures.pop(name) for figures in measured.values()][-1] for name in _SHARED if name in measured["rest"]
    }
    result = {"scene": view.scene, "device": renderer.device_name, "size": list(pixels), **shared}
    if json:
        print_json({**result, "motion": orbit.numbers(), **measured, "path_traced": traced})
        return
    print_values(view.scene, {**result, **orbit.numbers(), **({} if traced is None else {"path_traced": traced})})
    print_beside({_TITLES[way]: figures for way, figures in measured.items()})


_SHARED = ("frames", "warm_up", "peak_gpu_memory")
"""What the last of both says for both."""
_TITLES = {"moving": "moving", "rest": "at rest"}

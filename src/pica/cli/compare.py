"""`pica compare`: the hybrid picture against the path traced one."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pica.cli import options
from pica.cli.report import print_json, print_table, progress

if TYPE_CHECKING:
    from numpy.typing import NDArray


def compare(
    scene: options.SceneName,
    size: options.Size = "640x360",
    frames: options.Frames = 64,
    samples: Annotated[int, typer.Option(min=1, metavar="N", help="Paths per pixel of the reference.")] = 256,
    max_depth: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Edges of the reference's paths; 2 is direct light only.")
    ] = None,
    json: options.Json = False,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Both pictures and the FLIP map, a .png.")
    ] = None,
) -> None:
    """Tell how far the hybrid picture of SCENE is from the path traced one: FLIP, PSNR, relative MSE."""
    import pica

    if output is not None:
        options.check_output(output, (".png",))
    pixels = options.parse_size(size)
    content = options.load_scene(scene)
    renderer = pica.Renderer(content, size=pixels)
    with progress("Hybrid") as advance:
        hybrid = renderer.render(frames=frames, progress=advance)
    tracer = pica.PathTracer(content, size=pixels, max_depth=max_depth)
    with progress("Path traced") as advance:
        reference = tracer.render(samples=samples, progress=advance)

    from pica import pictures, quality

    errors = quality.compare(reference.color, hybrid.color)
    if output is not None:
        panels: dict[str, NDArray[Any]] = {
            f"hybrid, {frames} frames": quality.exposed(hybrid.color, errors.exposure),
            f"path traced, {samples} samples": quality.exposed(reference.color, errors.exposure),
            f"FLIP {errors.flip:.4f}": errors.flip_map,
        }
        pictures.write_png(output, quality.sheet(panels))
    result: dict[str, Any] = {"device": renderer.device_name, "size": list(pixels), "frames": frames}
    result |= {"samples": samples, "whole": errors.numbers()}
    if json:
        print_json(result)
    else:
        print_table(scene, result)

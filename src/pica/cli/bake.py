"""`pica bake`: a light map of a scene."""

import time
from pathlib import Path
from typing import Annotated

import typer

from pica.cli import options
from pica.cli.report import print_json, print_line, progress
from pica.cli.subject import View, takes_view


@takes_view
def bake(
    view: View,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="The .lightmap to write.")],
    spacing: Annotated[
        float | None,
        typer.Option(metavar="M", help="Metres between probes beside surfaces; without it, for about 50,000 probes."),
    ] = None,
    samples: Annotated[int, options.count("Light paths per probe.")] = 1024,
    values: options.Values = None,
    device: options.Device = None,
    json: options.Json = False,
) -> None:
    """Bake the indirect light of SCENE into a light map, for render and bench --light-map.

    What was baked when a run is cut short lies in FILE.partial; the same command goes on there.
    """
    import pica

    options.check_output(output, (".lightmap",))
    settings = options.parse_settings("quality", values)
    content = view.load()
    began = time.perf_counter()
    with progress("Baking", json) as advance:
        partial = output.with_name(f"{output.name}.partial")
        light_map = pica.bake(
            content,
            spacing=spacing,
            samples=samples,
            settings=settings,
            device=device,
            progress=advance,
            partial=partial,
        )
        light_map.save(output)
    seconds = time.perf_counter() - began
    probes, size = len(light_map.harmonics), output.stat().st_size
    if json:
        summary = {"probes": probes, "spacing": light_map.bricks.spacing, "samples": samples, "bytes": size}
        print_json({"scene": view.scene, **summary, "seconds": seconds, "files": [str(output)]})
    else:
        apart = f"{light_map.bricks.spacing:.3g} m apart at the nearest"
        print_line(f"{output}: {probes:,} probes, {apart}, {samples} paths each, {size / 1e6:.1f} MB, {seconds:.1f} s")

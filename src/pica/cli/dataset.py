"""`pica dataset`: pictures of a scene with labels, for training."""

import time
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from pica.cli import options
from pica.cli.report import print_json, print_line, progress
from pica.cli.subject import View, takes_view
from pica.errors import PicaError


@takes_view
def dataset(
    view: View,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FOLDER", help="The folder to write.")],
    cameras: Annotated[
        str,
        typer.Option(
            metavar="orbit|sphere|FILE.csv",
            help="Once round what the scene's camera looks at; random places around it; or a file with columns eye_x, "
            "eye_y, eye_z, target_x, target_y, target_z, and perhaps fov (degrees) and time (seconds).",
        ),
    ] = "orbit",
    count: Annotated[int, options.count("Pictures.")] = 1000,
    labels: Annotated[
        str,
        typer.Option(metavar="NAME,NAME", help="Labels: depth, normal, instance, semantic, motion, albedo."),
    ] = "depth,normal,instance,semantic,motion,albedo",
    size: options.Size = "640x360",
    frames: options.Frames = 8,
    seed: Annotated[int, typer.Option(min=0, max=2**31 - 1, metavar="N", help="Other random places and noise.")] = 1,
    workers: Annotated[int, options.count("Processes that render; with several cards, in turn on each.")] = 1,
    cluster: options.Cluster = None,
    resume: Annotated[bool, typer.Option("--resume", help="Keep the shards that an earlier run has finished.")] = False,
    preset: options.Preset = "quality",
    values: options.Values = None,
    device: options.Device = None,
    json: options.Json = False,
) -> None:
    """Render a data set of SCENE: WebDataset shards, pictures with COCO annotations, and a README with the units."""
    import pica

    if view.start is not None or view.animation is not None:
        raise PicaError("--start, --animation: are for pictures; --cameras FILE.csv gives each picture a time")
    pixels, camera = options.parse_size(size), None
    if view.has_camera or view.f_number is not None:
        camera = view.camera_for(view.load(moving=True), pixels)
    began = time.perf_counter()
    with progress("Rendering", json) as advance:
        pica.dataset(
            partial(view.load, moving=True),
            output,
            cameras=cameras,
            camera=camera,
            count=count,
            labels=[name.strip() for name in labels.split(",") if name.strip()],
            size=pixels,
            frames=frames,
            settings=options.parse_settings(preset, values),
            seed=seed,
            workers=workers,
            cluster=cluster,
            resume=resume,
            device=device,
            progress=advance,
        )
    seconds = time.perf_counter() - began
    if json:
        print_json({"scene": view.scene, "output": str(output), "pictures": count, "seconds": seconds})
    else:
        print_line(f"{output}: {count} pictures with labels, {seconds:.1f} s")

"""`pica prepare`: fills the cache of compiled shaders, so that a first picture need not wait for them."""

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pica.cli import options
from pica.cli.report import print_json, print_line, progress
from pica.cli.subject import BUILT_IN, View
from pica.errors import PicaError

if TYPE_CHECKING:
    from pica import Scene

_SIZE = 64, 36
"""Pixels: programs do not depend on it."""


def prepare(
    scene: Annotated[
        str | None, typer.Argument(metavar="SCENE", help=f"A file, as for render, or one of {', '.join(BUILT_IN)}.")
    ] = None,
    everything: Annotated[
        bool, typer.Option("--all", help="All built-in scenes and all that materials and lights can have.")
    ] = False,
    env: Annotated[Path | None, typer.Option(metavar="FILE", help="Environment, .hdr, .exr or .ktx2.")] = None,
    allow_outside: options.AllowOutside = False,
    limit: options.LimitsAsForRender = None,
    preset: Annotated[
        str | None, typer.Option(metavar="NAME", help="Named settings, as for render; with --all, each of them.")
    ] = None,
    values: options.Values = None,
    path_traced: Annotated[
        bool, typer.Option("--path-traced", help="Also what the reference path tracer takes.")
    ] = False,
    light_map: options.LightMapFile = None,
    device: options.Device = None,
    json: options.Json = False,
) -> None:
    """Compile all shaders that pictures of SCENE take with these settings, or those of all scenes.

    They are kept for later starts, in ~/.cache/pica or what PICA_CACHE names. --all takes minutes without a graphics
    card; files of one's own then find what they need too.
    """
    import pica
    from pica.settings.settings import PRESETS

    if everything is (scene is not None):
        raise PicaError("give either SCENE or --all")
    if everything and (env is not None or light_map is not None):
        raise PicaError("--all takes neither --env nor --light-map")
    presets = list(PRESETS) if everything and preset is None else [preset or "quality"]
    variants = [options.parse_settings(name, values) for name in presets]
    began = time.perf_counter()
    count = 0
    with progress("Preparing", json) as advance:
        view = View(scene or "", env, allow_outside=allow_outside, limit=limit)
        scenes = list(_every()) if everything else [view.load]
        for load in scenes:
            content = load()
            for settings in variants:
                baked = options.load_light_map(light_map, settings)
                with pica.Renderer(content, size=_SIZE, settings=settings, device=device, light_map=baked) as renderer:
                    renderer.prepare()
                    folder = renderer.device.cache
                count += 1
                advance(count, len(scenes) * len(variants))
            if path_traced:
                with pica.PathTracer(content, size=_SIZE, settings=variants[0], device=device) as tracer:
                    tracer.render(1)
    seconds = time.perf_counter() - began
    if json:
        print_json({"scene": scene, "presets": presets, "cache": str(folder), "seconds": seconds})
    else:
        print_line(f"{scene or 'all scenes'}, {', '.join(presets)}: ready in {folder}, {seconds:.1f} s")


def _every() -> Iterator[Callable[[], "Scene"]]:
    """Functions that make each scene: one with all optional features comes first, and serves many others."""
    import pica

    yield _of_all_features
    for name in sorted(set(BUILT_IN.values())):
        yield getattr(pica.scenes, name)


def _of_all_features() -> "Scene":
    """A ball of everything that a material can be, with one light of each kind."""
    import numpy as np

    from pica.scene import light as lights
    from pica.scene.anisotropy import Anisotropy
    from pica.scene.coat import Coat
    from pica.scene.environment import Environment
    from pica.scene.iridescence import Iridescence
    from pica.scene.material import AlphaMode, Image, Material, Texture
    from pica.scene.model import Mesh, Node, Scene
    from pica.scene.sheen import Sheen
    from pica.scenes.basic_meshes import sphere

    grey = Texture(Image(np.full((2, 2, 4), 128, np.uint8)))
    material = Material(
        "all",
        base_color_texture=grey,
        emission=(1.0, 1.0, 1.0),
        emissive_texture=grey,
        alpha_mode=AlphaMode.MASK,
        transmission=0.5,
        diffuse_transmission=0.5,
        coats=(Coat(),),
        iridescence=Iridescence(),
        anisotropy=Anisotropy(),
        sheen=Sheen(),
    )
    kinds = (
        lights.DirectionalLight,
        lights.PointLight,
        lights.SpotLight,
        lights.RectangleLight,
        lights.DiskLight,
        lights.SphereLight,
        lights.TubeLight,
    )
    scene = Scene("all", environment=Environment(np.ones((2, 4, 3), np.float32)))
    scene.add(Node(mesh=Mesh([sphere(1.0, material)])))
    for kind in kinds:
        scene.add(Node(light=kind()))
    return scene

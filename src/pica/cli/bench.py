"""`pica bench`: how fast a scene renders."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pica.cli import options
from pica.cli.report import print_beside, print_columns, print_json, print_values, progress
from pica.cli.subject import View, takes_view

if TYPE_CHECKING:
    from pica import Camera, Renderer, Scene, Settings
    from pica.quality.costs import EffectCost
    from pica.quality.sequences import Motion


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
    table: Annotated[
        bool,
        typer.Option("--table", help="A row for each effect: milliseconds, rays, memory, and what publications state."),
    ] = False,
    sweep: Annotated[
        str | None,
        typer.Option(metavar="WHAT", help="How the moving frame grows with size, triangles, lights or rays."),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE", help="An .svg of milliseconds by effect as stacked bars."),
    ] = None,
    device: options.Device = None,
    json: options.Json = False,
) -> None:
    """Measure SCENE while the camera moves and at rest: GPU milliseconds and rays per pass and per effect, host
    milliseconds per frame, rays per second, memory.

    The camera orbits what it looks at by a degree a frame; within the scene it turns about itself. Beside it the
    same picture by the path tracer, with all light: milliseconds a sample, and the moving frame over that.
    """
    import pica
    from pica.quality.sequences import sequence
    from pica.quality.sweeps import check_sweep

    pixels = options.parse_size(size)
    settings = options.parse_settings(preset, values)
    if sweep is not None:
        check_sweep(sweep)
    if output is not None:
        options.check_output(output, (".svg",))
    baked = options.load_light_map(light_map, settings)
    content = view.load()
    camera = view.camera_for(content, pixels)

    def make(size: tuple[int, int], settings: "Settings") -> "Renderer":
        return pica.Renderer(content, size=size, settings=settings, device=device, light_map=baked)

    meter = _Meter(view.scene, camera, sequence("orbit", content, camera), make, frames, warm_up, json)
    if sweep is None:
        meter.show_view(pixels, settings, table, output)
    else:
        meter.show_sweep(sweep, content, pixels, settings, output)


_SHARED = ("frames", "warm_up", "peak_gpu_memory")
"""What the last of both says for both."""
_TITLES = {"moving": "moving", "rest": "at rest"}


@dataclass
class _Meter:
    """Measures and prints."""

    scene: str
    camera: "Camera"
    orbit: "Motion"
    make: "Callable[[tuple[int, int], Settings], Renderer]"
    frames: int | None
    warm_up: int | None
    json: bool

    def _measure(self, renderer: "Renderer", title: str, play: "Motion | None") -> dict[str, Any]:
        from pica.quality.benchmark import benchmark

        renderer.reset()
        with progress(f"Measuring, {title}", self.json) as advance:
            return benchmark(renderer, self.camera, self.frames, self.warm_up, advance, play)

    def show_view(self, pixels: tuple[int, int], settings: "Settings", table: bool, output: Path | None) -> None:
        """One picture, moving and at rest, and a path traced sample of it."""
        from pica.quality.benchmark import path_traced_sample
        from pica.quality.costs import effect_costs

        renderer = self.make(pixels, settings)
        plays = {"moving": self.orbit, "rest": None}
        measured = {way: self._measure(renderer, _TITLES[way], play) for way, play in plays.items()}
        with progress("Path tracing", self.json) as advance:
            traced = path_traced_sample(renderer, measured["moving"]["gpu_ms"]["frame"], self.camera, advance)
        shared = {
            name: [figures.pop(name) for figures in measured.values()][-1]
            for name in _SHARED
            if name in measured["rest"]
        }
        result = {"scene": self.scene, "device": renderer.device_name, "size": list(pixels), **shared}
        titled = {_TITLES[way]: figures for way, figures in measured.items()}
        if output is not None:
            self._draw(output, f"{'x'.join(map(str, pixels))}, {renderer.device_name}", titled)
        costs = effect_costs(**measured) if table else []
        if self.json:
            rows = {"table": [asdict(cost) for cost in costs]} if table else {}
            print_json({**result, "motion": self.orbit.numbers(), **measured, "path_traced": traced, **rows})
            return
        traced_rows = {} if traced is None else {"path_traced": traced}
        print_values(self.scene, {**result, **self.orbit.numbers(), **traced_rows})
        if table:
            _print_table(costs)
        else:
            print_beside(titled)

    def show_sweep(
        self, name: str, content: "Scene", pixels: tuple[int, int], settings: "Settings", output: Path | None
    ) -> None:
        """The moving picture at every step of a sweep, beside each other."""
        from pica.quality.sweeps import SWEEPS

        measured, device = {}, ""
        for step in SWEEPS[name](content, pixels, settings):
            with self.make(step.size, step.settings) as renderer:
                measured[step.label] = self._measure(renderer, f"{name} {step.label}", self.orbit)
                device = renderer.device_name
        if output is not None:
            self._draw(output, f"by {name}, {device}", measured)
        if self.json:
            result = {"scene": self.scene, "device": device, "sweep": name, "motion": self.orbit.numbers()}
            print_json({**result, "steps": measured})
            return
        print_values(self.scene, {"device": device, "sweep": name, **self.orbit.numbers()})
        print_beside(
            {
                label: {
                    "ms": {**figures["effect_ms"], "frame": figures["gpu_ms"]["frame"]},
                    "rays": figures["effect_rays"],
                }
                for label, figures in measured.items()
            }
        )

    def _draw(self, output: Path, what: str, measured: dict[str, dict[str, Any]]) -> None:
        from pica.quality.stacked_bars import save_stacked_bars

        save_stacked_bars(
            output, f"{self.scene}, {what}", {title: each["effect_ms"] for title, each in measured.items()}
        )


def _print_table(costs: "Sequence[EffectCost]") -> None:
    rows = [("effect", "ms moving", "ms at rest", "rays", "MB", "published", "source")]
    for cost in costs:
        numbers = f"{cost.ms:.3f}", f"{cost.rest_ms:.3f}", f"{cost.rays:,}", f"{cost.bytes / 1e6:.1f}"
        rows.append((cost.effect, *numbers, cost.published, cost.source))
    print_columns(rows, right=range(1, 5))

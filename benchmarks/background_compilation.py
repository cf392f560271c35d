"""Frame times while material types come to a running renderer and are replaced, with cold shader caches.

    python benchmarks/background_compilation.py [--size 1920x1080] [--device NAME] [--set NAME=VALUE …]

Prints one JSON object: for each phase the median frame and the longest above it, how long the programs took, and how
many frames went by between the moment when the worker had compiled all and the frame that shows the result. `making`
is what the renderer's own process did for each program, in milliseconds: SlangPy's calls by name, `link_ms`, `make_ms`
in frames of their own; `code_found` and `code_missed`: SPIR-V that the cache on disk had, or had not. Where the driver
reports them, `code` and `pipeline` are its parts of the time, with their sizes.
"""

import argparse
import json
import math
import os
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from functools import partialmethod
from pathlib import Path
from statistics import median
from typing import Any

SOURCE = """
import materials.material_type;
import shaders.noise;
struct Bench : IMaterialType
{
    struct Parameters { float3 tint; float scale; }
    static void evaluate(MaterialInput input, inout Surface surface)
    {
        Parameters parameters = input.parameters<Parameters>();
        float value = 0;
        for (uint octave = 0; octave < 4; octave++)
            value += sin(dot(input.objectPosition * parameters.scale * (1 << octave), float3(1, 2, 3)) + STEP) / 4;
        surface.brdf.baseColor = lerp(input.material.baseColor.rgb, parameters.tint, .5 + .5 * value);
        surface.brdf.roughness = .3;
    }
    override static float coverage(MaterialInput input)
    {
        return frac(input.objectPosition.x * 4) > HOLES ? 1 : 0;
    }
}
"""
FRAMES = 200
LIMIT = 120.0


def main() -> None:
    """Measure every phase in one running renderer."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", default="1920x1080")
    parser.add_argument("--device")
    parser.add_argument("--set", action="append", default=[], help="NAME=VALUE, a setting")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        # Pica's cache and those of the drivers, before anything opens a device.
        os.environ["PICA_CACHE"] = folder
        os.environ["__GL_SHADER_DISK_CACHE_PATH"] = os.environ["MESA_SHADER_CACHE_DIR"] = folder
        size = tuple(int(length) for length in arguments.size.split("x"))
        print(json.dumps(measure(Path(folder), size, arguments.device, arguments.set), indent=1))


def measure(folder: Path, size: Any, device_name: str | None, values: list[str]) -> dict[str, Any]:
    """All phases, in a folder for sources and caches."""
    import numpy as np

    import pica
    from pica.rhi.device import Device
    from pica.scene.light import DirectionalLight
    from pica.scene.material import AlphaMode, Material
    from pica.scene.model import Mesh, Node, Scene
    from pica.scenes.basic_meshes import plane, sphere
    from pica.scenes.placing import aim, move

    steps, tasks = timed_programs(), submitted_tasks()
    settings = pica.Settings().with_values(dict(value.split("=", 1) for value in values))
    device = Device(device_name)
    scene = Scene("background compilation")
    grey = Material(base_color=(0.6, 0.6, 0.6, 1), metallic=0.0)
    scene.add(Node(mesh=Mesh([plane(20, 20, grey)])))
    for x in range(-4, 5):
        node = Node(mesh=Mesh([sphere(0.4, grey)]))
        node.transform = move(x, 0.4, -1)
        scene.add(node)
    sun = Node(light=DirectionalLight(illuminance=3.0, angular_diameter=0.01))
    sun.transform = aim((1, 2, 1.5), (0, 0, 0))
    scene.add(sun)
    camera = pica.Camera.look_at((0.0, 2.5, 7.0), (0.0, 0.5, 0.0), vertical_fov=math.radians(45.0))
    renderer = pica.Renderer(scene, size=size, settings=settings, device=device)

    def register(name: str, step: int, holes: float) -> None:
        path = folder / f"{name}.slang"
        path.write_text(SOURCE.replace("STEP", str(step)).replace("HOLES", str(holes)))
        pica.register_material(name, path)

    def show(name: str, place: float, mode: AlphaMode) -> None:
        parameters = {"tint": (0.1, 0.1, 0.4), "scale": 3.0}
        material = Material(type=name, metallic=0.0, alpha_mode=mode, double_sided=True, parameters=parameters)
        node = Node(mesh=Mesh([sphere(0.5, material)]))
        node.transform = move(place, 0.5, 1)
        scene.add(node)

    def frame() -> float:
        begun = time.perf_counter()
        renderer.advance(camera)
        device.handle.wait_for_idle()
        return 1e3 * (time.perf_counter() - begun)

    def added() -> None:
        register("first", 0, -1)
        show("first", -1.5, AlphaMode.OPAQUE)

    def masked() -> None:
        register("second", 0, 0.5)
        show("second", 1.5, AlphaMode.MASK)

    def replaced() -> None:
        register("first", 2, -1)

    def phase(change: Callable[[], None]) -> dict[str, Any]:
        still = [frame() for _ in range(FRAMES)]
        steps.clear()
        tasks.clear()
        begun = time.perf_counter()
        change()
        times, pending, compiled, visible = [frame()], [renderer.pending_shaders], None, None
        types = renderer.view.material_types
        while visible is None and time.perf_counter() - begun < LIMIT:
            if compiled is None and tasks and all(task.done for task in tasks):
                compiled = len(times), time.perf_counter() - begun
            times.append(frame())
            pending.append(renderer.pending_shaders)
            if renderer.view.material_types != types:
                visible = len(times), time.perf_counter() - begun
        times += [frame() for _ in range(FRAMES)]
        usual = median(still)
        longest = sorted(range(len(times)), key=lambda index: -times[index])[:5]
        return {
            "median_ms": round(usual, 2),
            "longest_before_ms": round(max(still), 2),
            "longest_ms": round(max(times), 2),
            "longest_above_median_ms": round(max(times) - usual, 2),
            "longest_frames": [
                {"frame": index, "ms": round(times[index], 2), "pending": pending[min(index, len(pending) - 1)]}
                for index in longest
            ],
            "compiled_after_s": round(compiled[1], 2) if compiled else None,
            "shown_after_s": round(visible[1], 2) if visible else None,
            "frames_from_compiled_to_shown": visible[0] - compiled[0] if visible and compiled else None,
            "making": list(steps),
        }

    begun = time.perf_counter()
    frame()
    first = time.perf_counter() - begun
    [frame() for _ in range(20)]
    before = np.asarray(renderer.advance(camera)["material"].to_numpy())
    phases = {change.__name__: phase(change) for change in (added, masked, replaced)}
    after = np.asarray(renderer.advance(camera)["material"].to_numpy())
    return {
        "device": device.name,
        "size": list(size),
        "first_frame_s": round(first, 2),
        "pixels_changed": round(float((before != after).any(-1).mean()), 4),
        "phases": phases,
    }


def submitted_tasks() -> list[Any]:
    """What compilers are asked for from now on."""
    from pica.programs.compiler import Compiler

    tasks: list[Any] = []
    submit = Compiler.submit

    def noted(compiler: Any, task: Any) -> None:
        tasks.append(task)
        submit(compiler, task)

    Compiler.submit = noted  # type: ignore[method-assign]
    return tasks


def timed_programs() -> list[dict[str, Any]]:
    """What `Device.link` and `Device.product` do from now on, with the milliseconds of each call that takes any."""
    import slangpy as spy

    from pica.rhi.device import Device

    calls: dict[str, float] = {}
    made: list[dict[str, Any]] = []

    def time_calls(owner: Any, name: str) -> None:
        call = getattr(owner, name)

        def timed(*arguments: Any, **keywords: Any) -> Any:
            begun = time.perf_counter()
            try:
                return call(*arguments, **keywords)
            finally:
                calls[name] = calls.get(name, 0) + 1e3 * (time.perf_counter() - begun)

        setattr(owner, name, timed)

    for kind in ("compute", "render", "ray_tracing"):
        time_calls(spy.Device, f"create_{kind}_pipeline")
    for name in ("load_module", "load_module_from_source", "link_program", "create_shader_table"):
        time_calls(spy.Device, name)
    time_calls(spy.SlangModule, "entry_point")
    spy.Device.__init__ = partialmethod(spy.Device.__init__, enable_compilation_reports=True)  # type: ignore[assignment]
    link, kept = Device.link, Device.product

    def timed(part: str, work: Any, self: Device, recipe: Any, types: Any = ()) -> Any:
        before = self.handle.shader_cache_stats
        calls.clear()
        begun = time.perf_counter()
        result = work(self, recipe, types)
        whole = 1e3 * (time.perf_counter() - begun)
        step: dict[str, Any] = {"program": f"{type(recipe).__name__} {_brief(recipe)}", part: round(whole, 2)}
        step |= {name: round(ms, 2) for name, ms in calls.items() if ms > 0.05}
        after = self.handle.shader_cache_stats
        step["code_found"] = after.hit_count - before.hit_count
        step["code_missed"] = after.miss_count - before.miss_count
        report = None
        if isinstance(result, tuple) and calls:
            with suppress(RuntimeError):  # some drivers have none
                report = result[0].get_compilation_report()
        if report is not None:
            step["code"] = round(1e3 * report["create_time"], 2)
            step["code_bytes"] = sum(entry["cache_size"] for entry in report["entry_point_reports"])
            pipeline = report["pipeline_reports"][-1]
            step["pipeline"] = round(1e3 * pipeline["create_time"], 2)
            step["pipeline_bytes"], step["pipeline_cached"] = pipeline["cache_size"], pipeline["is_cached"]
        if whole > 0.1:
            made.append(step)
        return result

    Device.link = lambda *arguments: timed("link_ms", link, *arguments)  # type: ignore[assignment,method-assign]
    Device.product = lambda *arguments: timed("make_ms", kept, *arguments)  # type: ignore[assignment,method-assign]
    return made


def _brief(recipe: Any) -> str:
    parts = (getattr(recipe, part, "") for part in ("module", "source", "generation", "entry"))
    words = (getattr(part, "name", part) for part in parts)
    return " ".join(filter(None, words))


if __name__ == "__main__":
    main()

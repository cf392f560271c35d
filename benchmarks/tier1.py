"""Tier 1 with Embree against tier 2 on the same processor: the figures of docs/measurements/tiers.md.

    python benchmarks/tier1.py FlightHelmet.gltf [--size 640x360] [--rounds 10]

FlightHelmet on a plane: one soft shadow ray a pixel, and the path tracer at one sample and depth 5. Each time is from
before the effect's first kernel to the end of its last, with all that goes between device and host. Both tiers take
turns, so that whatever else the machine does meets both; given are medians, and the median of the rounds' ratios.
"""

import argparse
import json
import time
from statistics import median
from typing import Any

import pica
from benchmarks.flight_helmet import helmet_on_plane
from pica.rhi.device import Device
from pica.tracing.path_pipeline import PathPipeline
from pica.tracing.ray_buffers import BufferEffect
from pica.tracing.ray_pipeline import PipelineEffect

EFFECTS = {"shadows": "shadow_rays", "path tracer": "path_tracer"}
TIERS = {"tier 1": "buffers", "tier 2": "pipeline"}


def timed_effects(device: Device) -> dict[str, float]:
    """Milliseconds of the last run of each ray effect, by name: from now on, between two waits for the device."""
    milliseconds: dict[str, float] = {}

    def finish(recording: Any) -> None:
        device.handle.submit_command_buffer(recording.encoder.finish())
        device.handle.wait_for_idle()
        recording.encoder = device.handle.create_command_encoder()

    def time_runs(kind: Any) -> None:
        run = kind.__call__

        def timed(self: Any, recording: Any, grid: tuple[int, int], /, **values: Any) -> None:
            finish(recording)
            started = time.perf_counter()
            run(self, recording, grid, **values)
            finish(recording)
            milliseconds[self.name] = (time.perf_counter() - started) * 1e3

        kind.__call__ = timed

    for kind in (PipelineEffect, PathPipeline, BufferEffect):
        time_runs(kind)
    return milliseconds


def main() -> None:
    """Measure and print one JSON line per effect."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("path")
    parser.add_argument("--size", default="640x360")
    parser.add_argument("--rounds", type=int, default=10)
    parser.add_argument("--env")
    arguments = parser.parse_args()
    width, height = (int(length) for length in arguments.size.split("x"))
    device = Device("llvmpipe")
    scene, camera = helmet_on_plane(arguments.path, arguments.env)
    milliseconds = timed_effects(device)
    renderers: dict[str, list[Any]] = {}
    for tier, scheduler in TIERS.items():
        tracer = "embree" if scheduler == "buffers" else "device"
        settings = pica.Settings().with_values({"rays.scheduler": scheduler, "rays.tracer": tracer})
        renderers[tier] = [
            pica.Renderer(scene, size=(width, height), settings=settings, device=device),
            pica.PathTracer(scene, size=(width, height), max_depth=5, settings=settings, device=device),
        ]
    rounds: list[dict[str, dict[str, float]]] = []
    for number in range(arguments.rounds + 1):
        times: dict[str, dict[str, float]] = {}
        for tier, pair in renderers.items():
            milliseconds.clear()
            for renderer in pair:
                renderer.render(1, camera=camera)
            times[tier] = {name: milliseconds[effect] for name, effect in EFFECTS.items()}
            times[tier]["both"] = sum(times[tier].values())
        if number:  # the first one compiles
            rounds.append(times)
    for name in (*EFFECTS, "both"):
        result = {tier: round(median(times[tier][name] for times in rounds), 1) for tier in TIERS}
        ratio = median(times["tier 2"][name] / times["tier 1"][name] for times in rounds)
        print(json.dumps({"rays": name, "size": [width, height], "ms": result, "ratio": round(ratio, 2)}))


if __name__ == "__main__":
    main()

"""Tier 1 with Embree against tier 2 on the same processor: the figures of docs/tiers.md.

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
from pica.rhi.schedulers import RayEffect

TIERS = {"tier 1": "buffers", "tier 2": "pipeline"}


class Timed:
    """A ray effect that runs alone and tells how long it took."""

    def __init__(self, device: Device, effect: RayEffect) -> None:
        self._device, self._effect = device, effect
        self.milliseconds = 0.0

    def __call__(self, recording: Any, grid: tuple[int, int], /, **values: Any) -> None:
        """Run the effect between two waits for the device."""
        self._finish(recording)
        started = time.perf_counter()
        self._effect(recording, grid, **values)
        self._finish(recording)
        self.milliseconds = (time.perf_counter() - started) * 1e3

    def _finish(self, recording: Any) -> None:
        self._device.handle.submit_command_buffer(recording.encoder.finish())
        self._device.handle.wait_for_idle()
        recording.encoder = self._device.handle.create_command_encoder()


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
    passes: dict[str, dict[str, Timed]] = {}
    renderers = []
    for tier, scheduler in TIERS.items():
        tracer = "embree" if scheduler == "buffers" else "device"
        settings = pica.Settings().with_values({"rays.scheduler": scheduler, "rays.tracer": tracer})
        hybrid = pica.Renderer(scene, (width, height), settings, device)
        reference = pica.PathTracer(scene, (width, height), 5, settings, device)
        hybrid.shadows._trace = Timed(device, hybrid.shadows._trace)
        reference._trace = Timed(device, reference._trace)
        passes[tier] = {"shadows": hybrid.shadows._trace, "path tracer": reference._trace}
        renderers += [hybrid, reference]
    rounds = []
    for number in range(arguments.rounds + 1):
        for renderer in renderers:
            renderer.render(1, camera)
        if number:  # the first one compiles
            rounds.append({tier: {name: p.milliseconds for name, p in timed.items()} for tier, timed in passes.items()})
    for name in ("shadows", "path tracer", "both"):
        times = {tier: [sum(r[tier].values()) if name == "both" else r[tier][name] for r in rounds] for tier in TIERS}
        ratios = [slow / fast for slow, fast in zip(times["tier 2"], times["tier 1"], strict=True)]
        result = {tier: round(median(values), 1) for tier, values in times.items()}
        print(json.dumps({"rays": name, "size": [width, height], "ms": result, "ratio": round(median(ratios), 2)}))


if __name__ == "__main__":
    main()

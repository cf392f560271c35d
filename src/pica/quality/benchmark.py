"""How fast a renderer is: GPU time per pass, host time, rays per second, memory."""

from collections.abc import Callable
from statistics import median
from typing import Any

from pica.graph.description import times_by_effect
from pica.path_tracer.path_tracer import PathTracer
from pica.quality.sequences import Sequence
from pica.renderer import Renderer
from pica.scene.camera import Camera
from pica.tracing.fallbacks import traces

_HARDWARE, _SOFTWARE = (200, 50), (20, 3)
"""Frames and frames of warm-up; on the processor, where a frame can take seconds, as few as a median allows."""
_HARDWARE_SAMPLES, _SOFTWARE_SAMPLES = 20, 3
"""Path traced samples a pixel that are measured."""


def benchmark(
    renderer: Renderer,
    camera: Camera | None = None,
    frames: int | None = None,
    warm_up: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    play: Sequence | None = None,
) -> dict[str, Any]:
    """Medians over `frames` frames after `warm_up` frames, of a still camera or of the sequence `play`.

    None: 200 frames after 50, on a software device 20 after 3. `progress(done, warm_up + frames)` is called after each.
    frames, warm_up: how many; gpu_ms: milliseconds by pass, and "frame" for their sum; effect_ms: by effect, "scene"
    for its updates; host_ms: to record and submit a frame; rays: paths started in one more frame, by pass; further
    bounces and shadow rays at hits are not counted; effect_rays: their sums by effect; effect_bytes: device memory by
    effect, "shared" for what they use one after the other; rays_per_second: by pass; peak_gpu_memory: bytes.
    """
    if play is None:
        still = camera or renderer.scene.default_camera(renderer.size[0] / renderer.size[1])
        play = lambda frame: still  # noqa: E731
    usual = _SOFTWARE if renderer.device.is_software else _HARDWARE
    frames = usual[0] if frames is None else frames
    warm_up = usual[1] if warm_up is None else warm_up
    profiler = renderer.device.profiler
    host = []
    for done in range(warm_up + frames):
        if done == warm_up:
            profiler.flush()
            profiler.finished.clear()
        renderer.advance(play(done))
        if done >= warm_up:
            host.append(renderer.host_seconds * 1e3)
        if progress is not None:
            progress(done + 1, warm_up + frames)
    profiler.flush()
    measured = list(profiler.finished)
    gpu = {name: median(times[name] for times in measured if name in times) for name in measured[-1]}
    gpu["frame"] = median(sum(times.values()) for times in measured)
    effects = [times_by_effect(times) for times in list(profiler.by_owner)[-len(measured) :]]
    rays = renderer.count_rays(play(warm_up + frames))
    effect_of = {node.name: node.effect for node in renderer.graph.passes}
    effect_rays: dict[str, int] = {}
    for name, count in rays.items():
        effect_rays[effect_of[name]] = effect_rays.get(effect_of[name], 0) + count
    return {
        "frames": frames,
        "warm_up": warm_up,
        "gpu_ms": gpu,
        "effect_ms": {name: median(times.get(name, 0.0) for times in effects) for name in effects[-1]},
        "host_ms": median(host),
        "rays": rays,
        "effect_rays": effect_rays,
        "effect_bytes": dict(renderer.graph.memory),
        "rays_per_second": {name: count / (gpu[name] * 1e-3) for name, count in rays.items() if gpu.get(name)},
        "peak_gpu_memory": renderer.device.peak_memory,
    }


def path_traced_sample(
    renderer: Renderer,
    frame_ms: float,
    camera: Camera | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any] | None:
    """The cost of a path traced sample per pixel of the same picture, with all light; None without ray tracing.

    `frame_ms`: of the renderer's frame. `progress(done, samples)` is called after each sample.
    samples: how many were measured; sample_ms: GPU milliseconds, their median; frame_over_sample: the frame's over it.
    """
    device = renderer.device
    if not traces(device):
        return None
    samples = _SOFTWARE_SAMPLES if device.is_software else _HARDWARE_SAMPLES
    with PathTracer(renderer.scene, size=renderer.size, settings=renderer.settings, device=device) as tracer:
        device.profiler.flush()
        device.profiler.finished.clear()
        # The first also fills the G-buffer, the last also makes the picture.
        tracer.render(samples + 2, camera=camera, progress=progress)
    sample = median(sum(times.values()) for times in list(device.profiler.finished)[1:-1])
    return {"samples": samples, "sample_ms": sample, "frame_over_sample": frame_ms / sample}

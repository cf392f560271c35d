"""How fast a renderer is: GPU time per pass, host time, rays per second, memory."""

from statistics import median
from typing import Any

import numpy as np

from pica.renderer import Renderer
from pica.scene.camera import Camera


def benchmark(renderer: Renderer, camera: Camera | None = None, frames: int = 200, warm_up: int = 50) -> dict[str, Any]:
    """Medians over `frames` frames of a still camera after `warm_up` frames.

    gpu_ms: milliseconds by pass, and "frame" for their sum; host_ms: to record and submit a frame; rays: traced in
    one frame, by pass; rays_per_second: likewise; peak_gpu_memory: bytes.
    """
    camera = camera or renderer.scene.default_camera(renderer.size[0] / renderer.size[1])
    for _ in range(warm_up):
        renderer.advance(camera)
    profiler = renderer.device.profiler
    profiler.flush()
    profiler.finished.clear()
    host = []
    for _ in range(frames):
        buffers = renderer.advance(camera)
        host.append(renderer.host_seconds * 1e3)
    profiler.flush()
    measured = list(profiler.finished)
    gpu = {name: median(times[name] for times in measured if name in times) for name in measured[-1]}
    gpu["frame"] = median(sum(times.values()) for times in measured)
    rays = {}
    if "primary_rays" in gpu:
        rays["primary_rays"] = renderer.size[0] * renderer.size[1]
    if "occlusion_rays" in gpu:
        covered = int(np.count_nonzero(buffers["visibility"].to_numpy()[..., 0]))
        rays["occlusion_rays"] = covered * renderer.settings.ambient_occlusion.rays
    if "shadows" in buffers:
        traced = np.asarray(buffers["shadows"].to_numpy())[..., 1]
        rays["shadow_rays"] = int(np.unpackbits(np.ascontiguousarray(traced).view(np.uint8)).sum())
    return {
        "gpu_ms": gpu,
        "host_ms": median(host),
        "rays": rays,
        "rays_per_second": {name: count / (gpu[name] * 1e-3) for name, count in rays.items() if gpu.get(name)},
        "peak_gpu_memory": renderer.device.peak_memory,
    }

"""Ambient occlusion of one ray a pixel and frame, filtered by kernels of three kinds.

As figure 19-16 of Liu et al. 2019, "Cinematic Rendering in UE4 with Real-Time Ray Tracing and Denoising", has it: with
and without a kernel that adapts itself. One is as wide everywhere on a surface; one as the surface's form and the count
of samples let it be, which is pica's; and one goes by the distance of what the rays hit besides, as the chapter's does
after Mehta et al. 2012. With the PSNR against 1000 rays; the last frame is shown.

    python examples/sheets/occlusion_filter_sheet.py sheet.png --frames 8
"""

import argparse
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

import pica
from pica import quality
from pica.effects.ambient_occlusion.filter import RayFilter
from pica.graph.graph import FrameGraph
from pica.graph.resources import Texture, write
from pica.images import pictures
from pica.quality.effects import MeasuredEffect
from pica.rhi.device import Device
from pica.rhi.passes import ComputePass
from pica.rhi.slang_files import SlangFile
from pica.tracing.ray_effect import ray_effect

_FOLDER = Path(pica.__file__).parent / "effects/ambient_occlusion"
_WEIGHT = "1 / (tapNormal.w + bias + 1e-6)"
_EVEN = {"float weights = 1 / (normal.w + 1e-6)": "float weights = 1", _WEIGHT: "bias < .25 ? 1 : 0"}
_DISTANT_RAYS = {
    "RWTexture2D<float> occlusion;": "RWTexture2D<float2> occlusion;",
    "uint open;": "uint open; float metres;",
    "rayCount : 0 };": "rayCount : 0, 0 };",
    "++state.ray;": "++state.ray; state.metres += hit.isMiss() ? maxDistance : hit.distance;",
    "= state.open / float(rayCount)": "= float2(state.open, state.metres) / rayCount",
    "RayType.shadow": "RayType.surface",
}
_BY_DISTANCE = {
    "float maxDistance;": "float maxDistance; Texture2D<float2> occlusion; groupshared float tileMetres[TILE * TILE];",
    "float2 known = signal[place];": "float2 known = signal[place]; tileMetres[index] = occlusion[place].y;",
    "    float4 position = tilePosition[middle]": """    float metres = 0, alike = 0;
    for (int i = 0; i < (2 * RADIUS + 1) * (2 * RADIUS + 1); ++i)
    {
        int tap = middle + (i / (2 * RADIUS + 1) - RADIUS) * TILE + i % (2 * RADIUS + 1) - RADIUS;
        float weight = tileNormal[tap].w < 0 ? 0 : max(dot(tileNormal[tap].xyz, tileNormal[middle].xyz), 0);
        metres += tileMetres[tap] * weight;
        alike += weight;
    }
    metres /= max(alike, 1e-6);
    float4 position = tilePosition[middle]""",
    "normal.xyz));": "normal.xyz), metres);",
    "float cosine)": "float cosine, float metres)",
    "OCCLUDERS_AT = .25": "OCCLUDERS_AT = .5",
    "(maxDistance * maxDistance)": "(metres * metres)",
}
"""What the steps' texts have instead."""


def main() -> None:
    """Render the sheet."""
    parser = argparse.ArgumentParser(description="Ambient occlusion by three kernels on one sheet.")
    parser.add_argument("output", help="a .png")
    parser.add_argument("--scene", default="machine_world")
    parser.add_argument("--distance", type=float, default=0.6, help="metres that rays go")
    parser.add_argument("--frames", type=int, default=8)
    parser.add_argument("--size", default="320x180", help="pixels of each picture")
    given = parser.parse_args()
    width, height = (int(length) for length in given.size.split("x"))
    values = {"ambient_occlusion.mode": "ray_traced", "ambient_occlusion.max_distance": str(given.distance)}
    settings = pica.Settings().with_values(values | {"shadows.mode": "off", "lighting.environment": "off"})
    scene = getattr(pica.scenes, given.scene)()
    camera = scene.default_camera(width / height)

    def filtered(change: Callable[[Device, Any], None]) -> tuple[pica.Renderer, NDArray[np.float32]]:
        renderer = pica.Renderer(scene, size=(width, height), settings=settings)
        change(renderer.device, renderer._stages.ambient_occlusion)
        measured = MeasuredEffect(renderer, "ambient_occlusion")
        for _ in range(given.frames):
            renderer.advance(camera, jittered=False, capture=measured.offers)
        return renderer, measured.result()["open"]

    renderer, present = filtered(lambda device, effect: None)
    reference = np.nan_to_num(MeasuredEffect(renderer, "ambient_occlusion").reference(1000)["open"], nan=1)
    found = {
        "as wide everywhere": filtered(_even)[1],
        "by form and samples": present,
        "by hits and samples": filtered(_by_distance)[1],
    }
    panels = {"1000 rays": reference}
    for name, picture in found.items():
        panels[f"{name}, {-10 * np.log10(np.mean((picture - reference) ** 2)):.1f} dB"] = picture
    print(*panels, sep="\n")
    grey = [{title: np.repeat(picture[..., None], 3, axis=-1)} for title, picture in panels.items()]
    rows = [quality.sheet(first | second) for first, second in (grey[:2], grey[2:])]
    pictures.write_png(given.output, np.concatenate(rows))


def _even(device: Device, effect: Any) -> None:
    assert isinstance(effect._filter, RayFilter)
    effect._filter._smooth = _filter_step(device, _EVEN)


def _by_distance(device: Device, effect: Any) -> None:
    """Rays look for the nearest hit, and the filter asks how far that was."""
    effect._trace = ray_effect(device, _changed("occlusion_rays", _DISTANT_RAYS), "OcclusionRays", "hit")
    effect._filter = _FilterByDistance(device, effect._filter._mean._rays, effect._filter._max_distance)


class _FilterByDistance(RayFilter):
    def __call__(self, graph: FrameGraph, occlusion: Texture) -> tuple[Texture, Texture]:
        history, signal = self._mean(graph, occlusion)
        filtered = graph.texture("filtered", spy.Format.rg16_float)
        step = _filter_step(graph.device, _BY_DISTANCE)
        own = {"occlusion": occlusion, "maxDistance": self._max_distance}
        graph.add(step, graph.grid, signal=signal, filtered=write(filtered), **own)
        return history, filtered


def _filter_step(device: Device, changes: Mapping[str, str]) -> ComputePass:
    """occlusion_filter.slang with some of its text exchanged."""
    return device.compute(_changed("occlusion_filter", changes), name="occlusion_filter")


def _changed(step: str, changes: Mapping[str, str]) -> SlangFile:
    path = _FOLDER / f"{step}.slang"
    text = path.read_text()
    for old, new in changes.items():
        assert text.count(old) == 1, f"{step}.slang has changed: {old}"
        text = text.replace(old, new)
    return SlangFile(path, text)


if __name__ == "__main__":
    main()

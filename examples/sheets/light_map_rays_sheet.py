"""Indirect light by a light map, by rays that end in it, and by rays that must meet what shines, beside many paths.

As figure 19-14 of Liu et al. 2019, "Cinematic Rendering in UE4 with Real-Time Ray Tracing and Denoising", has it:
screen-space ambient occlusion (here of the light map's light), indirect light from rays that take the light map's
where they end, and path tracing; and the chapter's baseline, rays that bring light only where they meet a lamp. With
FLIP and the mean light over that of many paths, all of the light that surfaces reflect diffusely of others.

    python examples/sheets/light_map_rays_sheet.py sheet.png [--scene cornell]

The scene's lamps must be of triangles, or no ray meets them.
"""

import argparse
from pathlib import Path

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

import pica
from pica import quality
from pica.images import pictures
from pica.quality.effects import MeasuredEffect
from pica.rhi.binding import ParameterBlock
from pica.tracing.ray_effect import ray_effect

_SHADER = Path(__file__).with_name("emitters_met.slang")


def main() -> None:
    """Render the sheet."""
    parser = argparse.ArgumentParser(description="Rays that end in a light map on one sheet with other ways.")
    parser.add_argument("output", help="a .png")
    parser.add_argument("--scene", default="cornell")
    parser.add_argument("--size", default="240x135", help="pixels of each picture")
    parser.add_argument("--frames", type=int, default=32)
    parser.add_argument("--samples", type=int, default=1024, help="many paths")
    parser.add_argument("--paths", type=int, default=512, help="of each of the light map's probes")
    given = parser.parse_args()
    width, height = (int(length) for length in given.size.split("x"))
    scene = getattr(pica.scenes, given.scene)()
    camera = scene.default_camera(width / height)
    light_map = pica.bake(scene, samples=given.paths)

    def rendered(mode: str, occlusion: str) -> pica.Renderer:
        values = {"global_illumination.mode": mode, "ambient_occlusion.mode": occlusion}
        settings = pica.Settings().with_values(values)
        renderer = pica.Renderer(scene, size=(width, height), settings=settings, light_map=light_map)
        for _ in range(given.frames):
            renderer.advance(camera, jittered=False, capture=("diffuse_indirect",))
        return renderer

    ways = {
        "light map": ("light_map", "off"),
        "times screen-space occlusion": ("light_map", "ground_truth"),
        "times ray traced occlusion": ("light_map", "ray_traced"),
        "rays that end in it": ("path_traced", "off"),
    }
    found = {}
    for name, way in ways.items():
        renderer = rendered(*way)
        measured = MeasuredEffect(renderer, "global_illumination")
        found[name] = measured.result()["diffuse_indirect"]
    truth = np.nan_to_num(measured.reference(given.samples)["diffuse_indirect"])
    found["rays to lamps"] = _emitters_met(renderer, given.frames)
    exposure = quality.exposure_for(truth)
    panels = {f"{given.samples} paths a pixel": quality.exposed(truth, exposure)}
    for name, light in found.items():
        shown = quality.exposed(light, exposure)
        error = quality.flip(quality.exposed(truth, exposure), shown)[0]
        panels[f"{name}: {error:.3f}, {light.mean() / truth.mean():.2f}"] = shown
    print(*panels, sep="\n")
    rows = list(panels.items())
    sheets = [quality.sheet(dict(row)) for row in (rows[:3], rows[3:])]
    pictures.write_png(given.output, np.concatenate(sheets))


def _emitters_met(renderer: pica.Renderer, frames: int) -> NDArray[np.float32]:
    """(height, width, 3) the mean of so many frames of a path a pixel, from the renderer's newest G-buffer."""
    device, inputs = renderer.device, dict(renderer.effect_inputs)
    device.handle.load_module_from_source("emitters_met", _SHADER.read_text(), _SHADER)
    trace = ray_effect(device, "emitters_met", "EmittersMet", "surface", renderer.tracer)
    met = device.texture("light of lamps that rays met", spy.Format.rgba32_float, renderer.size)
    frame: ParameterBlock = inputs.pop("frame")
    inputs.pop("lightSlots")
    for number in range(frames):
        frame.bind(index=number)
        with device.record() as recording:
            if number == 0:
                recording.encoder.clear_texture_float(met)
            trace(recording, renderer.size, frame=frame, met=met, **inputs)
        device.handle.wait_for_idle()
    return np.float32(met.to_numpy()[..., :3] / frames)


if __name__ == "__main__":
    main()

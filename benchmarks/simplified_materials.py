"""What simplified materials and ray cones save in a reflection, and what they change: docs/measurements/materials.md.

    python benchmarks/simplified_materials.py FlightHelmet.gltf [--size 640x360] [--frames 64] [--roughness 0 0.3]
        [--scheduler pipeline] [--device NAME] [--env SKY.hdr] [--picture F]

Five by five copies of the file's meshes on a plane, with the camera among them. All that the camera sees is white metal
of one roughness and sends out one reflection ray a pixel, whose surface is lit by one shadow ray (one_bounce.slang).
Full detail, simplified materials, and full materials at the level of detail of ray cones take turns, frame by frame.
Prints one JSON line a roughness: medians of the effect's time from its first kernel to its last, waits included (of a
device that is the processor, the process's time on it), and the errors of the mean pictures against the one with full
detail. All have the same noise but for what the materials change.
"""

import argparse
import json
import time
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import slangpy as spy

import pica
from benchmarks.flight_helmet import helmet_on_plane
from pica.effects.gbuffer.gbuffer import GBufferEffect
from pica.frame.context import FrameContext, FrameSequence, Size
from pica.gpu_scene.view import SceneView
from pica.graph.graph import FrameGraph
from pica.graph.memory import Memory
from pica.graph.plan import Plan
from pica.images.pictures import write_png
from pica.quality.picture_errors import compare, exposed
from pica.rhi.device import Device
from pica.scene.model import Scene
from pica.tracing.ray_buffers import Tracer
from pica.tracing.ray_effect import ray_effect
from pica.tracing.tracers import choose_tracer

_SPACING = 0.5
"""Metres between two copies."""
_SHADER = Path(__file__).with_name("one_bounce.slang")


class OneBounce:
    """The reflection of a scene in everything that the camera sees, and the frames that it is measured in."""

    def __init__(
        self,
        device: Device,
        view: SceneView,
        frames: FrameSequence,
        simplified: bool,
        cones: bool,
        tracer: Tracer | None,
    ) -> None:
        size = frames.size
        device.handle.load_module_from_source("one_bounce", _SHADER.read_text(), _SHADER)
        self._trace = ray_effect(device, "one_bounce", "OneBounce", "surface", tracer, simplified)
        self._cones = int(cones)
        self._sum = device.texture("reflected", spy.Format.rgba32_float, size)
        self.frames, self._view = frames, view
        graph = FrameGraph(Memory(device), size, size, frames.block, frames.half_block)
        self._gbuffer = GBufferEffect(device, "auto", tracer)(graph, view).block.parameters
        self.plan = Plan(graph)
        """The G-buffer."""

    def __call__(self, frame: FrameContext, roughness: float) -> None:
        """Add one sample a pixel."""
        if frame.index == 0:
            frame.encoder.clear_texture_float(self._sum)
        values = {"frame": self.frames.block, "gbuffer": self._gbuffer, "scene": self._view, "roughness": roughness}
        self._trace(frame, frame.size, reflected=self._sum, cones=self._cones, **values)

    def mean(self) -> np.ndarray:
        """(height, width, 3) nits."""
        values = self._sum.to_numpy()
        return np.float32(values[..., :3] / np.maximum(values[..., 3:], 1))


def crowd(path: str, environment: str | None = None) -> tuple[Scene, pica.Camera]:
    """The helmet on its plane, 25 times."""
    scene, camera = helmet_on_plane(path, environment)
    moves = np.tile(np.eye(4), (25, 1, 1))
    moves[:, (0, 2), 3] = np.stack(np.meshgrid(np.arange(-2, 3), np.arange(-2, 3)), -1).reshape(-1, 2) * _SPACING
    for node in scene.nodes():
        if node.mesh is not None and node.name != "ground":
            node.instances = np.linalg.inv(node.world) @ moves @ node.world
    return scene, camera


def measure(
    device: Device, scene: Scene, camera: pica.Camera, size: Size, frames: int, roughness: float, scheduler: str
) -> tuple[dict[str, Any], list[np.ndarray]]:
    """Milliseconds and errors, and the pictures."""
    settings = pica.Settings().with_values({"rays.scheduler": scheduler})
    gpu_scene = SceneView(device, scene, settings)
    tracer = choose_tracer(device, settings.rays, gpu_scene)
    options = {"detailed": (False, False), "simplified": (True, False), "cones": (False, True)}
    ways = {
        name: OneBounce(device, gpu_scene, FrameSequence(device, size, settings.seed), simplified, cones, tracer)
        for name, (simplified, cones) in options.items()
    }
    times: dict[str, list[float]] = {name: [] for name in ways}
    clock = time.process_time if device.is_software else time.perf_counter
    for number in range(frames):
        for name, way in ways.items():
            frame = way.frames.begin(camera)
            gpu_scene.update(frame, frame.camera)
            way.plan.replay(frame)
            device.handle.submit_command_buffer(frame.encoder.finish())
            device.handle.wait_for_idle()
            frame.encoder = device.handle.create_command_encoder()
            begun = clock()
            way(frame, roughness)
            way.frames.end(frame)
            device.handle.wait_for_idle()
            if number:  # the first one compiles
                times[name].append((clock() - begun) * 1e3)
    pictures = {name: way.mean() for name, way in ways.items()}
    full = pictures["detailed"]
    figures: dict[str, Any] = {"roughness": roughness, "ms": {n: round(median(v), 3) for n, v in times.items()}}
    for name in ("simplified", "cones"):
        ratios = [other / detailed for detailed, other in zip(times["detailed"], times[name], strict=True)]
        errors = compare(full, pictures[name])
        figures[name] = {
            "ratio": round(median(ratios), 3),
            **{kind: round(value, 4) for kind, value in errors.numbers().items()},
            "brightness": round(float(pictures[name].mean() / full.mean()), 4),
        }
    return figures, [exposed(picture, errors.exposure) for picture in pictures.values()]


def main() -> None:
    """Measure every roughness."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("path")
    parser.add_argument("--size", default="640x360")
    parser.add_argument("--frames", type=int, default=64)
    parser.add_argument("--roughness", type=float, nargs="+", default=[0.0, 0.3])
    parser.add_argument("--scheduler", default="auto")
    parser.add_argument("--device")
    parser.add_argument("--env")
    parser.add_argument("--picture")
    arguments = parser.parse_args()
    width, height = (int(length) for length in arguments.size.split("x"))
    device = Device(arguments.device)
    scene, camera = crowd(arguments.path, arguments.env)
    for roughness in arguments.roughness:
        figures, pictures = measure(
            device, scene, camera, (width, height), arguments.frames, roughness, arguments.scheduler
        )
        print(json.dumps({"device": device.name, "size": [width, height], **figures}), flush=True)
        if arguments.picture:
            side_by_side = np.rint(np.concatenate(pictures, axis=1) * 255).astype(np.uint8)
            write_png(arguments.picture.replace(".png", f"_{roughness}.png"), side_by_side)


if __name__ == "__main__":
    main()

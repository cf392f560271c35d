"""The device's passes of a bake: light at probes, and visibility between parts of cells and probes."""

import numpy as np
from numpy.typing import NDArray

from pica.frame.context import FrameContext, FrameSequence
from pica.gpu_scene.view import SceneView
from pica.light_map.bricks import CELLS, Bricks
from pica.light_map.light_map import HARMONICS, PARTS, SEEN_PER_BRICK
from pica.rhi.device import Device
from pica.scene.model import Scene
from pica.settings import Settings
from pica.tracing.ray_effect import PATHS, ray_effect
from pica.tracing.tracers import choose_tracer

_PATHS = 1 << 18
"""In one dispatch: a long one would trigger the driver's timeout."""
_SAMPLE = 32
"""Bytes: probe_light.slang."""
BRICKS = _PATHS // SEEN_PER_BRICK
"""Of one run of visibility."""


class ProbePasses:
    """Runs on one scene and its bricks."""

    def __init__(self, device: Device, scene: Scene, settings: Settings, bricks: Bricks, samples: int) -> None:
        self._device, self._settings, self._samples = device, settings, samples
        self.probes = max(_PATHS // samples, 1)
        """Of one run of light."""
        self.view = SceneView(device, scene, settings)
        tracer = choose_tracer(device, settings.rays, self.view)
        self._camera = scene.default_camera(1.0)
        self._frames = FrameSequence(device, (1, 1), settings.seed)
        self._light = ray_effect(device, "baking/probe_light.slang", "ProbeLight", "surface", tracer, parts=PATHS)
        self._harmonics = device.compute("baking/probe_harmonics.slang")
        self._visibility = ray_effect(device, "baking/probe_visibility.slang", "ProbeVisibility", "hit", tracer)
        positions = bricks.positions
        corners = bricks.origin + bricks.spacing * CELLS * bricks.places[:, :3]
        sides = bricks.spacing * CELLS ** bricks.places[:, 3:].astype(np.float64)
        self._probe_count, self._brick_count = len(positions), len(corners)
        padded = np.concatenate([positions, np.zeros((len(positions), 1))], 1).astype(np.float32)
        self._places = device.structured("probe places", padded)
        self._bricks = device.structured("brick places", np.concatenate([corners, sides], 1).astype(np.float32))
        make = device.buffer
        self._sample_buffer = make("probe samples", size=self.probes * samples * _SAMPLE, struct_size=_SAMPLE)
        self._sums = make("probe harmonics", size=self.probes * HARMONICS * 16, struct_size=16)
        self._inside = make("probes inside", size=self.probes * 4, struct_size=4)
        self._seen = make("probe visibility", size=BRICKS * SEEN_PER_BRICK * 4, struct_size=4)

    def light(self, first: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Of probes from `first` on: (probes, 9, 4) irradiance over pi, and the variance of each coefficient, averaged
        over colours; (probes,) the fraction of rays that hit back faces."""
        with self._device.lock:
            frame = self._begin()
            shared = {"samples": self._sample_buffer, "across": self._samples}
            self._light(
                frame,
                (self._samples, self.probes),
                frame=frame,
                scene=self.view,
                places=self._places,
                first=first,
                probeCount=self._probe_count,
                maxDepth=0,
                **shared,
            )
            grid = 16, self.probes, 1
            self._harmonics(frame, grid, probeCount=self.probes, harmonics=self._sums, inside=self._inside, **shared)
            self._frames.end(frame)
            sums = self._sums.to_numpy().view(np.float32).reshape(self.probes, HARMONICS, 4)
            inside = self._inside.to_numpy().view(np.float32)
        left = self._probe_count - first
        return sums[:left], inside[:left]

    def visibility(self, first: int) -> NDArray[np.uint8]:
        """(bricks, 4096) from brick `first` on, as LightMap.seen."""
        with self._device.lock:
            frame = self._begin()
            self._visibility(
                frame,
                (PARTS**3, BRICKS * CELLS**3),
                scene=self.view,
                bricks=self._bricks,
                first=first,
                brickCount=self._brick_count,
                seen=self._seen,
            )
            self._frames.end(frame)
            values = self._seen.to_numpy().view(np.uint32).reshape(BRICKS, SEEN_PER_BRICK)
        return values[: self._brick_count - first].astype(np.uint8)

    def _begin(self) -> FrameContext:
        """The scene stays as it was when the first run began."""
        self._frames.rewind()
        frame = self._frames.begin(self._camera, jittered=False)
        self.view.update(frame, self._camera)
        return frame

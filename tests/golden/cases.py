"""The golden pictures: what each shows, how it is rendered, and how far another rendering of it may be away.

Here each shows one thing by itself, over as many frames as it takes to converge; whole_frame_cases.py has the frames
that users get. The pictures lie beside this file as NAME.exr, linear radiance. `make golden` renders all of them anew.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import pica
from pica.images.pictures import read_radiance
from pica.rhi.device import Device
from pica.scene.camera import Camera
from tests.building import CAMERA, still_life
from tests.golden import scenes
from tests.golden.comparison import Limits
from tests.golden.scenes import VIEW

FOLDER = Path(__file__).parent
SIZE = (96, 64)


@dataclass(frozen=True)
class Golden:
    """One picture: of `frames` frames of a still scene, or the mean of as many in which it moves."""

    name: str
    scene: Callable[[], pica.Scene]
    flip: float
    """The most that mean FLIP may be, at the golden picture's own exposure."""
    energy: float
    """The most that `Comparison.energy` may be."""
    frames: int = 64
    camera: Camera | None = None
    """None: the scene's own."""
    preset: str = "quality"
    values: dict[str, str] = field(default_factory=dict)
    """Settings that differ from the preset's."""
    path_edges: int | None = None
    """Path traced, with so many edges at most and `frames` samples; None: by the hybrid renderer."""
    move: Callable[[pica.Scene, float], None] | None = None
    """Puts the scene where it is after so many seconds, before each frame."""
    marks: tuple[pytest.MarkDecorator, ...] = ()

    @property
    def path(self) -> Path:
        return FOLDER / f"{self.name}.exr"

    def picture(self) -> NDArray[np.float32]:
        """(height, width, 3) the golden picture. Raises SceneError where there is none."""
        return read_radiance(self.path)

    def limits(self, device: Device) -> Limits:
        """The same on all devices: what other noise of as many frames is away."""
        return Limits(self.flip, self.energy)

    def render(self, device: Device, seed: int = 0) -> NDArray[np.float32]:
        """(height, width, 3) the picture as it is today; another seed gives it other noise."""
        # What is golden is each frame by itself, or the mean of frames in which nothing moves.
        values = {
            "antialiasing.mode": "accumulate",
            "reflections.mode": "off",
            "global_illumination.mode": "off",
            **self.values,
            "seed": str(seed),
        }
        settings = pica.Settings.preset(self.preset).with_values(values)
        scene = self.scene()
        if self.path_edges is not None:
            tracer = pica.PathTracer(scene, size=SIZE, max_depth=self.path_edges, settings=settings, device=device)
            return tracer.render(self.frames, camera=self.camera).color
        renderer = pica.Renderer(scene, size=SIZE, settings=settings, device=device)
        if self.move is None:
            return renderer.render(self.frames, camera=self.camera).color
        total = np.zeros((SIZE[1], SIZE[0], 3))
        for frame in range(self.frames):
            self.move(scene, frame / 60)
            total += renderer.render(1, camera=self.camera).color
        return (total / self.frames).astype(np.float32)


OCCLUSION = {"lighting.environment": "prefiltered"}
GOLDENS = [
    Golden("cornell", pica.scenes.cornell, flip=0.012, energy=0.0015, frames=128, marks=(pytest.mark.smoke,)),
    Golden("machine_world", scenes.opaque_world, flip=0.07, energy=0.014, frames=24),
    Golden("machine_world_raster", scenes.opaque_world, flip=0.028, energy=0.008, frames=24, preset="raster"),
    Golden("sphere_grid", pica.scenes.sphere_grid, flip=0.054, energy=0.011),
    Golden("landscape", scenes.landscape, flip=0.043, energy=0.011, frames=24),
    Golden("still_life", still_life, flip=0.06, energy=0.013, camera=CAMERA),
    Golden("coloured_glass", scenes.coloured_glass, flip=0.0055, energy=0.0015, camera=VIEW),
    Golden(
        "svgf",
        scenes.under_lamps,
        flip=0.0065,
        energy=0.0015,
        camera=VIEW,
        values={"shadows": "high", "shadows.denoiser": "svgf"},
    ),
    Golden(
        "ratio_estimator",
        scenes.under_lamps,
        flip=0.0065,
        energy=0.0015,
        camera=VIEW,
        values={"shadows": "high", "lighting.area_shadows": "ratio_estimator"},
    ),
    Golden(
        "occlusion_rays",
        scenes.under_a_sky,
        flip=0.021,
        energy=0.004,
        camera=VIEW,
        values={**OCCLUSION, "ambient_occlusion.mode": "ray_traced"},
    ),
    Golden(
        "occlusion_gtao",
        scenes.under_a_sky,
        flip=0.0145,
        energy=0.0025,
        camera=VIEW,
        values={**OCCLUSION, "ambient_occlusion.mode": "ground_truth"},
    ),
    Golden("crowded_light", scenes.crowded_light, flip=0.047, energy=0.008, camera=VIEW),
    Golden("skinned", scenes.bent, flip=0.004, energy=0.001),
    Golden("moving", scenes.bent, flip=0.006, energy=0.002, move=scenes.swing),
    Golden("path_traced", scenes.under_lamps, flip=0.058, energy=0.0125, frames=128, camera=VIEW, path_edges=4),
]

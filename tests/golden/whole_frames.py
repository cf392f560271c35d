"""Whole frames as users get them: reflections, indirect light and temporal antialiasing on, at rest and in motion.

The pictures lie in frames/ as NAME.exr, linear radiance. They are those of lavapipe with Embree, on one thread.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import pica
from pica.images.pictures import read_radiance
from pica.rhi.device import Device
from pica.scene.camera import Camera
from pica.scene.orbit import orbited, pivot
from tests.golden.comparison import Limits

FOLDER = Path(__file__).parent / "frames"
SIZE = (80, 56)
TIGHT = Limits(flip=0.0005, energy=0.0005)
"""Where the picture was made, on a processor: it comes out equal to the bit, so this is room for other processors."""

IN_ORDER = {"LP_NUM_THREADS": "1", "LP_NATIVE_VECTOR_WIDTH": "128"}
"""Of the environment, for pictures that are the same to the bit: one thread of lavapipe, the lanes of conftest.py."""
CLOSE = Limits(flip=0.02, energy=0.01)

Motion = Callable[[pica.Scene, Camera, int, int], Camera]
"""Puts a scene into the state of one of so many frames and gives its camera, from the one that the scene has."""


def still(scene: pica.Scene, camera: Camera, frame: int, frames: int) -> Camera:
    return camera


def orbit(scene: pica.Scene, camera: Camera, frame: int, frames: int) -> Camera:
    """Round what the camera looks at, so that near and far move differently; the scene's camera is in the middle."""
    return orbited(camera, pivot(scene, camera), math.radians(1.5 * (frame - (frames - 1) / 2)))


@dataclass(frozen=True)
class WholeFrame:
    """The last of `frames` frames."""

    name: str
    scene: Callable[[], pica.Scene]
    values: dict[str, str] = field(default_factory=dict)
    """Settings that differ from the preset's."""
    motion: Motion = still
    frames: int = 12
    camera: Camera | None = None
    """None: the scene's own."""
    preset: str = "quality"
    map_spacing: float | None = None
    """Metres between probes of the light map that the renderer is given; None: no light map."""
    display: bool = False
    """Whether the picture is what displays show: exposed and tone mapped, 0 to 1."""
    on_cards: Limits = CLOSE
    """How far a graphics card may be away, whose rounding makes other decisions, and so other noise."""
    one_thread: bool = False
    """Whether its bits follow the order of lavapipe's threads, so that it is rendered on one."""
    differs: str = ""
    """Why it is another picture on a graphics card, where it is."""
    always: bool = False
    """Whether `make test` renders it."""

    @property
    def path(self) -> Path:
        return FOLDER / f"{self.name}.exr"

    def picture(self) -> NDArray[np.float32]:
        """(height, width, 3) the golden picture. Raises SceneError where there is none."""
        return read_radiance(self.path)

    def limits(self, device: Device) -> Limits:
        return TIGHT if device.is_software else self.on_cards

    def render(self, device: Device) -> NDArray[np.float32]:
        """(height, width, 3) the picture as it is today."""
        scene = self.scene()
        settings = pica.Settings.preset(self.preset).with_values(self.values)
        light_map = None
        if self.map_spacing is not None:
            light_map = pica.bake(scene, spacing=self.map_spacing, samples=64, device=device)
        middle = scene.default_camera(SIZE[0] / SIZE[1]) if self.camera is None else self.camera
        with pica.Renderer(scene, size=SIZE, settings=settings, device=device, light_map=light_map) as renderer:
            for frame in range(self.frames):
                camera = self.motion(scene, middle, frame, self.frames)
                shown = renderer.render(1, camera=camera, aovs=())
        return shown.display[..., :3].astype(np.float32) / 255 if self.display else shown.color

"""Default frames against the path tracer, for tests of what the transparency stage shows."""

import pytest

import pica
from pica.quality.picture_errors import compare
from pica.quality.playback import last_frame
from pica.quality.sequences import sequence
from pica.rhi.device import Device
from pica.scene.camera import Camera
from pica.scene.model import Scene
from tests.building import converged

SIZE = (96, 60)


def errors(device: Device, scene: Scene, camera: Camera, samples: int) -> tuple[float, float]:
    """FLIP of 64 frames at rest, and of the 16th of an orbit of a degree a frame. Their means are within 2 %."""
    expected = converged(device, scene, samples, camera, SIZE)
    with pica.Renderer(scene, size=SIZE, device=device) as renderer:
        still = renderer.render(64, camera=camera).color
        renderer.reset()
        moving = last_frame(renderer, sequence("orbit", scene, camera, speed=1.0), range(-15, 1)).color
    for picture in (still, moving):
        assert picture.mean() == pytest.approx(expected.mean(), rel=0.02)
    return compare(expected, still).flip, compare(expected, moving).flip

"""A camera that jumps leaves no ghosts; one that moves keeps its histories."""

import math

import numpy as np
import pytest

import pica
from pica.scene.camera import Camera
from pica.scene.light import DirectionalLight
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import aim, move
from tests.building import RAYS, lambert, placed, scene_of, shining, uniform

SIZE = (64, 36)
SETTINGS = pica.Settings().with_values(
    {
        **RAYS,
        "shadows.mode": "hard",
        "lighting.environment": "prefiltered",
        "reflections.mode": "off",
        "global_illumination.mode": "off",
    }
)
"""Without noise: what differs between two pictures of a view are ghosts."""
FOUND = "debug.reprojection.found"


def orbit(degrees: float) -> Camera:
    angle = math.radians(degrees)
    return Camera.look_at((4 * math.sin(angle), 1.5, 4 * math.cos(angle)), (0, 0.4, 0))


@pytest.fixture(scope="module")
def renderer(device):
    scene = scene_of(
        *(
            placed(
                sphere(0.3, lambert(*colour), segments=16),
                move(math.sin(2.1 * number), 0.3, math.cos(2.1 * number)),
            )
            for number, colour in enumerate(((0.9, 0.1, 0.1), (0.1, 0.9, 0.1), (0.1, 0.1, 0.9)))
        ),
        placed(box(0.5, lambert(0.8)), move(0, 0.6, 0)),
        placed(plane(8, 8, lambert(0.5))),
        shining(DirectionalLight(illuminance=2.0), aim((1, 2, 1), (0, 0, 0))),
        environment=uniform(0.3, 0.4, 0.5),
    )
    with pica.Renderer(scene, size=SIZE, settings=SETTINGS, device=device) as made:
        yield made


def frame(renderer: pica.Renderer, camera: Camera) -> np.ndarray:
    return renderer.advance(camera, jittered=False, capture=(FOUND,))["color"].to_numpy()[..., :3]


def test_nothing_of_another_view_is_left_after_a_jump(renderer):
    renderer.reset()
    expected = frame(renderer, orbit(170))
    renderer.reset()
    for _ in range(4):
        frame(renderer, orbit(0))
    np.testing.assert_allclose(frame(renderer, orbit(170)), expected, rtol=1e-5)
    assert not renderer.captured[FOUND]().any()


def test_a_camera_that_moves_keeps_what_it_knows(renderer):
    renderer.reset()
    for step in range(4):
        frame(renderer, orbit(3 * step))
        if step:
            assert np.count_nonzero(renderer.captured[FOUND]()) > 0.85 * SIZE[0] * SIZE[1]


def test_motion_is_told_over_a_jump(renderer):
    renderer.reset()
    renderer.render(1, camera=orbit(0))
    depth = renderer.render(1, camera=orbit(60)).aov("depth")
    motion = renderer.render(1, camera=orbit(0)).aov("motion")
    renderer.reset()
    renderer.render(1, camera=orbit(60))
    small = renderer.render(1, camera=orbit(63)).aov("motion")
    assert np.abs(motion[np.isfinite(depth)]).max() > 3 * np.abs(small).max() > 1

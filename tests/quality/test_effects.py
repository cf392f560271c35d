"""Single effects against their references: the references are right, and errors count what they should."""

import numpy as np
import pytest

import pica
from pica.quality.effects import EffectErrors, MeasuredEffect, compare_effect, error_sheet
from pica.scene.camera import Camera
from pica.scene.light import PointLight, RectangleLight
from pica.scenes.basic_meshes import box, plane
from pica.scenes.placing import move, rotate
from tests.building import lambert, placed, scene_of, shining

CAMERA = Camera.look_at((0, 6, 0.01), (0, 0, 0), vertical_fov=np.radians(40))
SIZE = (48, 32)


def half_hidden(light):
    """A floor, and a board that hides one half of it from a small light above."""
    return scene_of(
        placed(plane(20, 20, lambert(0.5)), name="floor"),
        placed(box(2, lambert(0.5)), move(1.2, 2, 0) @ np.diag([1, 0.01, 1, 1]), name="board"),
        shining(light, move(0, 5, 0) @ rotate("x", -90)),
    )


def test_the_reference_of_a_penumbra_is_the_share_of_the_lamp_in_sight(device):
    """A lamp 2 m wide, 5 m above a floor, half of it behind an edge 3 m up, for which x runs through the penumbra."""
    scene = scene_of(
        placed(plane(40, 40, lambert(0.5))),
        placed(plane(20, 20, lambert(0.5, double_sided=True)), move(10, 3, 0)),
        shining(RectangleLight(radiance=10, width=2, height=2), move(0, 5, 0) @ rotate("x", -90)),
    )
    # The camera looks from below the board's height, lest it see the board.
    camera = Camera.look_at((0, 2.9, 0.01), (0, 0, 0), vertical_fov=np.radians(80))
    renderer = pica.Renderer(scene, size=(64, 36), device=device)
    measured = MeasuredEffect(renderer, "shadows")
    frame = renderer.render(1, camera=camera)
    (found,) = measured.reference(1024).values()
    # From floor point x the edge at x = 0, y = 3 is seen at x - 5/3 x = -2/3 x on the lamp's plane, which spans -1..1.
    # A point of the lamp brings cos^2 / distance^2 = 5^2 / distance^4.
    depth = frame.aov("depth")[18]
    x = (np.arange(64) + 0.5 - 32) / 18 * np.tan(np.radians(40)) * depth
    lamp = (np.arange(400) + 0.5) / 200 - 1
    brought = 1 / ((lamp - x[:, None])[..., None] ** 2 + lamp**2 + 25) ** 2
    seen = (lamp < -2 / 3 * x[:, None])[..., None]
    expected = (brought * seen).sum((1, 2)) / brought.sum((1, 2))
    assert ((expected > 0.05) & (expected < 0.95)).sum() >= 20
    np.testing.assert_allclose(found[18], expected, atol=0.015)


def test_sharp_shadows_equal_their_reference(device):
    scene = half_hidden(PointLight(intensity=10))
    renderer = pica.Renderer(scene, size=SIZE, device=device)
    errors = compare_effect(renderer, "shadows", "still", frames=2, samples=4, camera=CAMERA)
    assert errors.psnr == [120, 120] and list(errors.layers) == ["light 0"]
    # Jitter moves the edge by less than a pixel.
    assert errors.change[0] < 0.05


def test_one_ray_of_a_wide_lamp_is_noise(device):
    scene = half_hidden(PointLight(intensity=10, radius=0.8))
    renderer = pica.Renderer(scene, size=SIZE, settings=pica.Settings(), device=device)
    errors = compare_effect(renderer, "shadows", "orbit", frames=2, samples=256, camera=CAMERA)
    assert 5 < errors.numbers()["psnr"] < 60
    assert error_sheet(errors).shape[1] > 3 * SIZE[0]


def test_numbers_are_means_over_frames():
    errors = EffectErrors([10.0, 20.0], {"a": [10.0, 20.0]}, [0.1])
    assert errors.numbers()["psnr"] == 15 and errors.numbers()["flicker"] == 0.1


def test_shadows_that_are_off_cannot_be_measured(device):
    settings = pica.Settings().with_values({"shadows.mode": "off"})
    renderer = pica.Renderer(half_hidden(PointLight()), size=SIZE, settings=settings, device=device)
    with pytest.raises(pica.errors.SettingsError, match="off"):
        compare_effect(renderer, "shadows", "still", 1, 1)

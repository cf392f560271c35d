"""Reflections of a picture at rest: what neighbours' rays get wrong goes."""

import numpy as np
import pytest

import pica
from pica.quality.effects import MeasuredEffect
from pica.scene.camera import Camera
from pica.scene.environment import Environment
from pica.scene.material import Material
from pica.scenes.basic_meshes import plane, sphere
from pica.scenes.placing import move
from tests.building import held, lambert, placed, scene_of, settings, uniform
from tests.effects.reflections.scenes import metal, striped_floor, under_clouds

SIZE = (64, 48)


@pytest.mark.parametrize(("roughness", "tolerance"), [(0.15, 0.05), (0.55, 0.02)])
def test_a_still_picture_is_what_many_rays_find(device, roughness, tolerance):
    scene, camera = under_clouds(roughness)
    renderer = pica.Renderer(scene, size=SIZE, settings=settings({"reflections.mode": "ray_traced"}), device=device)
    measured = MeasuredEffect(renderer, "reflections")
    for _ in range(64):
        renderer.advance(camera, jittered=False, capture=measured.offers)
    found, truth = measured.result()["reflections"], measured.reference(512)["reflections"]
    there = np.isfinite(truth)
    assert found[there].mean() == pytest.approx(truth[there].mean(), rel=tolerance)


def test_a_small_ball_shows_a_band_as_wide_as_it_is(device):
    """Neighbours' rays would bring tails of its lobe alone, and widen the band."""
    radiance = np.full((32, 64, 3), 0.2, np.float32)
    radiance[:, 30:34] = 20.0
    satin = Material(base_color=(0.9, 0.9, 0.9, 1), metallic=1.0, roughness=0.15)
    scene = scene_of(placed(sphere(1, satin, 48)), environment=Environment(radiance))
    camera = Camera.look_at((1.37, 0, 3.76), (0, 0, 0), vertical_fov=np.radians(20))
    with pica.Renderer(scene, size=SIZE, settings=pica.Settings(), device=device) as renderer:
        found = renderer.render(32, camera=camera).color[12:36, 16:48]
    with pica.PathTracer(scene, size=SIZE, device=device) as tracer:
        truth = tracer.render(256, camera=camera).color[12:36, 16:48]
    assert found.mean() == pytest.approx(truth.mean(), rel=0.12)


def test_rare_finds_of_a_small_lamp_leave_no_blotches(device):
    """A glossy floor shows metal balls, and in them a lamp that few paths find."""
    floor = Material(base_color=(0.05, 0.05, 0.06, 1), metallic=0.0, roughness=0.3, ior=2.0)
    balls = [placed(sphere(0.35, metal(0.1)), move(x, 0.4, -0.6)) for x in (-0.8, 0, 0.8)]
    lamp = placed(sphere(0.04, lambert(0, emission=(400.0, 300.0, 200.0))), move(0.2, 1.2, 1.4))
    scene = scene_of(placed(plane(6, 6, floor)), *balls, lamp, environment=uniform(0.2, 0.2, 0.25))
    camera = Camera.look_at((0, 1.2, 2.2), (0, 0, 0), vertical_fov=np.radians(45))
    with pica.Renderer(
        scene, size=(96, 64), settings=settings({"reflections.mode": "ray_traced"}), device=device
    ) as renderer:
        measured = MeasuredEffect(renderer, "reflections")
        for _ in range(24):
            renderer.advance(camera, jittered=False, capture=measured.offers)
        found, truth = (light["reflections"][40:] for light in (measured.result(), measured.reference(1024)))
    assert np.sqrt(np.mean((found - truth) ** 2)) < 0.3 * truth.mean()
    assert found.mean() == pytest.approx(truth.mean(), rel=0.03)


def test_a_picture_at_rest_becomes_that_of_own_rays(device):
    """What neighbours' rays got wrong goes; as soon as the camera moves, it starts anew."""
    scene, camera = striped_floor(0.05)
    errors = []
    for own in (True, False):
        renderer = pica.Renderer(
            scene,
            size=(48, 36),
            settings=settings({"reflections.mode": "ray_traced"}),
            device=device,
        )
        measured = MeasuredEffect(renderer, "reflections")
        if not own:
            renderer._stages.reflections._correction = None
        for _ in range(180):
            renderer.advance(camera, jittered=False, capture=measured.offers)
        found, truth = measured.result()["reflections"], measured.reference(1024)["reflections"]
        errors.append(np.nanmean((found - truth) ** 2))
        if own:
            correction = held(renderer, "reflections", "correction")
            before = correction.to_numpy()[..., 3].max()
            for _ in range(34):
                renderer.advance(
                    Camera.look_at((1.3, 0.9, 2.2), (0, 0.4, 0), vertical_fov=np.radians(40)), jittered=False
                )
            assert before > 30 and 0 < correction.to_numpy()[..., 3].max() < 4
    assert errors[0] < 0.3 * errors[1], errors


def test_all_pixels_of_a_picture_at_rest_have_as_many_rays_of_their_own(device):
    """Also in the rows below which threads of the last groups have no texel."""
    scene = scene_of(placed(sphere(3, metal(0.4)), move(0, 0, -4)), environment=uniform(0.3, 0.4, 0.5))
    with pica.Renderer(
        scene, size=(40, 36), settings=settings({"reflections.mode": "ray_traced"}), device=device
    ) as renderer:
        for _ in range(72):
            renderer.advance(Camera.look_at((0, 0, 0), (0, 0, -4), vertical_fov=np.radians(30)), jittered=False)
        counts = held(renderer, "reflections", "correction").to_numpy()[..., 3]
    assert counts.min() > 8 and np.ptp(counts) <= 1

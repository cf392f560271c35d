"""Transmissive surfaces of pica's path tracer against Mitsuba 3's dielectrics."""

import math

import numpy as np
import pytest

import pica
from pica.scene.material import Material
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import move, rotate
from tests.building import lambert, placed, scene_of, sky
from tests.reference.mitsuba_scene import render_reference

pytestmark = pytest.mark.thorough
SIZE = (192, 128)
CAMERA = pica.Camera.look_at((0.4, 0.9, 2.2), (0, 0.35, 0), vertical_fov=math.radians(35))
REFRACTED = pica.Settings().with_values({"shadows.transparent": "false"})
"""Light through glass is found along refracted paths alone, as Mitsuba has it."""


def glass(**values):
    return Material(**{"metallic": 0.0, "transmission": 1.0, "roughness": 0.0, "thin_walled": False, **values})


def test_path_tracer_agrees_with_mitsuba(device):
    """A clear ball, a rough one, an absorbing block and a pane. (Mitsuba loses light between rougher facets.)"""
    scene = scene_of(
        placed(plane(3, 3, lambert(0.3, 0.5, 0.7))),
        placed(plane(3, 2, lambert(0.7, 0.3, 0.2)), move(0, 1, -0.8) @ rotate("x", 90)),
        placed(sphere(0.28, glass(ior=1.7), 48), move(-0.55, 0.3, 0)),
        placed(sphere(0.25, glass(roughness=0.25, ior=1.3), 48), move(0.0, 0.27, 0.1)),
        placed(box(0.4, glass(absorption=(0.5, 2.0, 5.0))), move(0.6, 0.23, 0.1) @ rotate("y", 25)),
        placed(plane(0.5, 0.6, glass(thin_walled=True)), move(-0.1, 0.75, 0.2) @ rotate("x", 70)),
        environment=pica.Environment(np.minimum(sky(3).radiance, 2.0)),  # few fireflies
    )
    check(scene, device)


def test_scattering_agrees_with_mitsuba(device):
    """A ball and a block of wax, a ball of mist, one of milk in glass, and a sheet of paper."""
    wax = {"metallic": 0.0, "diffuse_transmission": 1.0, "specular": 0.0}
    fog = glass(ior=1.0, specular=0.0, scattering=(6.0, 3.0, 1.0), scatter_anisotropy=0.5)
    scene = scene_of(
        placed(plane(3, 3, lambert(0.3, 0.5, 0.7))),
        placed(
            sphere(
                0.28, Material(thin_walled=False, scattering=(8.0, 10.0, 12.0), absorption=(0.1, 1.0, 3.0), **wax), 48
            ),
            move(-0.55, 0.3, 0),
        ),
        placed(sphere(0.25, fog, 48), move(0.0, 0.27, 0.1)),
        placed(
            box(
                0.35,
                Material(
                    thin_walled=False, scattering=(3.0, 6.0, 9.0), diffuse_transmission_color=(0.9, 0.8, 0.7), **wax
                ),
            ),
            move(0.6, 0.19, 0.2) @ rotate("y", 25),
        ),
        placed(
            sphere(0.2, glass(ior=1.3, scattering=(5.0, 5.0, 5.0), absorption=(0.1, 0.5, 1.0)), 48),
            move(0.1, 0.85, -0.3),
        ),
        placed(
            plane(0.5, 0.6, Material(diffuse_transmission_color=(0.8, 0.9, 0.3), double_sided=True, **wax)),
            move(-0.5, 0.9, 0.1) @ rotate("x", 70),
        ),
        environment=pica.Environment(np.minimum(sky(3).radiance, 2.0)),
    )
    check(scene, device)


def check(scene, device):
    """Blocks of pixels: few samples of a large picture take a third of the time of many samples of a small one."""
    expected = render_reference(scene, CAMERA, SIZE, 256)
    with pica.PathTracer(scene, size=SIZE, settings=REFRACTED, device=device) as tracer:
        found = tracer.render(128, camera=CAMERA).color
    blocks = [picture.reshape(8, 16, 12, 16, 3).mean((1, 3)) for picture in (found, expected)]
    np.testing.assert_allclose(*blocks, rtol=0.05, atol=0.005)
    assert found.mean() == pytest.approx(expected.mean(), rel=0.01)

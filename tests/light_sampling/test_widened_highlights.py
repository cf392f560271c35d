"""widened_highlights.slang: how rough a hit is for light samples of paths that were scattered diffusely."""

import numpy as np
import pytest

from pica.scenes.basic_meshes import plane, sphere
from pica.scenes.placing import stretch
from tests.building import lambert, placed, scene_of
from tests.rays import FRONT, gpu_scene
from tests.tracing.kernels import read, run

SOURCE = """
import light_sampling.widened_highlights;
import shaders.surface;
RWStructuredBuffer<float> found;
uint record;
uint primitive;
uniform float metallic;
uniform float distance;
uniform float least;
[shader("compute")] [numthreads(1, 1, 1)]
void main()
{
    Surface surface = {};
    surface.record = record;
    surface.primitive = primitive;
    surface.brdf.metallic = metallic;
    surface.brdf.roughness = .1;
    found[0] = widenedRoughness(surface, distance, least);
}
"""
BALL, FLOOR = range(2)
LEAST, MOST = 0.3, (0.3**4 + 0.04) ** 0.25


@pytest.fixture(scope="module")
def roughness(device):
    """Of a ball with a radius of half a metre, twice as large as its mesh, or of a floor."""
    ball = placed(sphere(0.25, lambert(), segments=32), stretch(2, 2, 2))
    scene = gpu_scene(device, scene_of(ball, placed(plane(2, 2, lambert()))))
    with device.record() as recording:
        scene.update(recording, FRONT)
    buffer = device.structured("found", np.zeros(1, np.float32))

    def of(record: int, distance: float, metallic: float = 1.0, least: float = LEAST) -> float:
        values = {"metallic": metallic, "distance": distance, "least": least}
        run(device, SOURCE, 1, found=buffer, record=record, primitive=300 * (record == BALL), scene=scene, **values)
        return float(read(buffer, np.float32)[0])

    return of


def test_it_grows_with_the_turn_of_normals_within_the_footprint(roughness):
    turn = 0.5 * 0.2 / 0.5  # footprint over radius
    assert roughness(BALL, 0.2) == pytest.approx((LEAST**4 + turn**2 / 6) ** 0.25, rel=0.02)
    assert roughness(BALL, 1e-4) == pytest.approx(LEAST, rel=1e-4)
    assert roughness(BALL, 100.0) == pytest.approx(MOST, rel=1e-4)


def test_flat_metal_dielectrics_and_references_keep_theirs(roughness):
    assert roughness(FLOOR, 100.0) == pytest.approx(LEAST)
    assert roughness(BALL, 100.0, metallic=0.0) == pytest.approx(LEAST)
    assert roughness(BALL, 100.0, least=0.0) == pytest.approx(0.1)

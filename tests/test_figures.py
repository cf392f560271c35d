"""The hybrid renderer against the path tracer on whole scenes: direct light with soft shadows."""

import numpy as np
import pytest

import pica
from pica.quality.picture_errors import compare
from tests.assets import ASSETS, needs_assets

FRAMES = 256
HIGHEST_FLIP = 0.02
DIRECT = pica.Settings().with_values({"global_illumination.mode": "off"})


def helmet() -> pica.Scene:
    return pica.load(ASSETS / "FlightHelmet" / "FlightHelmet.gltf")


SCENES = [pytest.param(pica.scenes.cornell, id="cornell"), pytest.param(helmet, id="FlightHelmet", marks=needs_assets)]


def check(device, make, size, samples, folder):
    """Mean FLIP of 256 frames against the path tracer at two edges; pictures stay in `folder` for a look."""
    scene = make()
    hybrid = pica.Renderer(scene, size=size, settings=DIRECT, device=device).render(FRAMES)
    reference = pica.PathTracer(scene, size=size, max_depth=2, device=device).render(samples)
    hybrid.save(folder / "hybrid.exr", aovs=())
    reference.save(folder / "reference.exr", aovs=())
    errors = compare(reference.color, hybrid.color)
    assert reference.color.mean() > 0.01 and (hybrid.aov("instance") > 0).mean() > 0.1
    assert errors.flip <= HIGHEST_FLIP, f"{errors.numbers()}; pictures are in {folder}"
    np.testing.assert_allclose(hybrid.color.mean((0, 1)), reference.color.mean((0, 1)), rtol=0.01)


@pytest.mark.parametrize("make", SCENES[:1])
def test_soft_shadows_converge_to_path_traced_direct_light(device, make, tmp_path):
    check(device, make, (96, 72), 1024, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("make", SCENES)
def test_soft_shadows_converge_to_path_traced_direct_light_large(device, make, tmp_path):
    check(device, make, (320, 240), 2048, tmp_path)

"""pica's path tracer against pictures of the Cornell box that Mitsuba made once."""

import numpy as np
import pytest

import pica
from pica.images.pictures import read_radiance
from tests.assets import ASSETS, needs_assets

FOLDER = ASSETS / "ReferenceScenes"
pytestmark = pytest.mark.thorough


def psnr(picture, reference):
    """Peak signal-to-noise ratio in decibels of linear radiance with 1 nit as the peak.

    Both are clipped to 0..1 first, so that the lamp, of 18 nits, is white in both; the mean squared difference
    is over all pixels and channels.
    """
    difference = np.clip(picture, 0, 1).astype(np.float64) - np.clip(reference, 0, 1)
    return -10 * np.log10(np.mean(difference**2))


@needs_assets
@pytest.mark.device
@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.parametrize(
    ("name", "max_depth"), [("direct_d2_1024spp", 2), ("full_gi_2048spp", None)], ids=["direct light", "all light"]
)
def test_path_tracer_matches_mitsubas_pictures(name, max_depth):
    reference = read_radiance(FOLDER / f"CornellBox_Mitsuba_{name}.exr")
    scene = pica.load(FOLDER / "CornellBox_Mitsuba.glb")
    picture = pica.PathTracer(scene, size=(256, 256), max_depth=max_depth).render(samples=512).color
    assert picture.mean() == pytest.approx(reference.mean(), rel=0.01)
    assert psnr(picture, reference) >= 38


@needs_assets
@pytest.mark.parametrize(("name", "max_depth"), [("direct_d2_1024spp", 2), ("full_gi_2048spp", None)])
def test_converted_scene_matches_mitsubas_pictures(name, max_depth):
    """The converter of mitsuba_scene.py carries geometry, camera, lamp and depth over as they are."""
    pytest.importorskip("tests.reference.variant")
    from tests.reference.mitsuba_scene import render_reference

    reference = read_radiance(FOLDER / f"CornellBox_Mitsuba_{name}.exr")
    scene = pica.load(FOLDER / "CornellBox_Mitsuba.glb")
    picture = render_reference(scene, scene.default_camera(1.0), (256, 256), samples=64, max_depth=max_depth)
    assert picture.mean() == pytest.approx(reference.mean(), rel=0.005)
    assert psnr(picture, reference) >= 36

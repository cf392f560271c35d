"""Pictures with a transparent background: alpha, and that they can be put over any other."""

import numpy as np
import pytest
from PIL import Image

import pica
from pica.color import srgb_encode
from pica.images import pictures
from pica.images.aov_table import AOVS
from pica.scene.material import AlphaMode, Material
from pica.scene.orbit import orbited
from pica.scenes.basic_meshes import sphere
from tests.building import lambert, placed, scene_of, settings, uniform

SIZE = (48, 32)
CAMERA = pica.Camera.look_at((0, 0, 4), (0, 0, 0))
CLEAR = {"visibility.background": "transparent"}
SKY = (0.5, 1.0, 2.0)


@pytest.fixture(scope="module")
def ball():
    return scene_of(placed(sphere(1.0, lambert(0.5, 0.2, 0.1))), environment=uniform(*SKY))


@pytest.fixture(scope="module")
def clear(device, ball):
    """The hybrid picture of a ball without its sky."""
    return pica.Renderer(ball, size=SIZE, settings=settings().with_values(CLEAR), device=device).render(
        32, camera=CAMERA
    )


def test_over_the_sky_it_is_the_picture_with_the_sky(device, ball, clear):
    alpha = clear.aov("alpha")
    assert alpha.shape == (32, 48) and alpha.dtype == np.float32
    assert alpha[16, 24] == 1 and alpha[0, 0] == 0 and len(np.unique(alpha)) > 20
    assert clear.aov_info("alpha") is AOVS["alpha"]
    whole = pica.Renderer(ball, size=SIZE, settings=settings(), device=device).render(32, camera=CAMERA)
    assert "alpha" not in whole.aov_names
    np.testing.assert_allclose(clear.color + (1 - alpha[..., None]) * SKY, whole.color, atol=1e-5)
    assert (clear.color[alpha == 0] == 0).all() and (clear.display[alpha == 0] == 0).all()


def test_the_path_tracer_gives_the_same_alpha(device, ball, clear):
    traced = pica.PathTracer(ball, size=SIZE, settings=settings().with_values(CLEAR), device=device).render(
        64, camera=CAMERA
    )
    alpha = traced.aov("alpha")
    assert set(np.round(np.unique(alpha) * 64, 3)) <= set(range(65))
    assert np.abs(alpha - clear.aov("alpha")).mean() < 0.004
    assert np.abs(traced.color - clear.color).mean() < 0.01


def test_edges_are_antialiased_in_motion_too(device, ball):
    renderer = pica.Renderer(ball, size=SIZE, settings=pica.Settings().with_values(CLEAR), device=device)
    aside = np.array([2.0, 0, 0])
    for step in range(10):
        camera = orbited(CAMERA, aside, 0.01 * step)
        moving = renderer.render(1, camera=camera).aov("alpha")
    renderer.reset()
    single = renderer.render(1, camera=camera).aov("alpha")
    renderer.reset()
    still = renderer.render(32, camera=camera).aov("alpha")
    assert len(np.unique(single)) == 2
    assert np.abs(moving - still).mean() < 0.8 * np.abs(single - still).mean()


def test_blended_surfaces_cover_in_part(device):
    half = Material(base_color=(0.5, 0.5, 0.5, 0.25), alpha_mode=AlphaMode.BLEND)
    scene = scene_of(placed(sphere(3.0, half)), environment=uniform(1, 1, 1))
    front = pica.Camera.look_at((0, 0, 8), (0, 0, 0), near=0.1)
    alpha = (
        pica.Renderer(scene, size=SIZE, settings=settings().with_values(CLEAR), device=device)
        .render(64, camera=front)
        .aov("alpha")
    )
    assert np.abs(alpha[12:20, 20:28].mean() - 0.25) < 0.05


def test_settings_of_a_renderer_change_between_both(device, ball, clear):
    renderer = pica.Renderer(ball, size=SIZE, settings=settings(), device=device)
    assert "alpha" not in renderer.render(1, camera=CAMERA).aov_names
    renderer.configure(settings().with_values(CLEAR))
    again = renderer.render(32, camera=CAMERA)
    np.testing.assert_allclose(again.aov("alpha"), clear.aov("alpha"), atol=1e-6)
    renderer.resize((24, 16))
    assert renderer.render(2, camera=CAMERA).aov("alpha").shape == (16, 24)
    renderer.configure(settings().with_values({**CLEAR, "antialiasing.upscale": 2}))
    upscaled = renderer.render(16, camera=CAMERA)
    assert upscaled.aov("alpha").shape == (16, 24) and upscaled.aov("alpha")[8, 12] == 1


def test_straight_in_png_and_premultiplied_in_exr(clear, tmp_path):
    clear.save(tmp_path / "ball.png")
    clear.save(tmp_path / "ball.exr")
    clear.save(tmp_path / "few.exr", aovs=["depth"])
    alpha = clear.aov("alpha")
    pixels = np.array(Image.open(tmp_path / "ball.png"))
    assert pixels.shape == (32, 48, 4)
    np.testing.assert_array_equal(pixels[..., 3], np.round(alpha * 255))
    edge = (alpha > 0.3) & (alpha < 0.7)
    inside = pixels[alpha == 1][:, :3].astype(int)
    assert edge.any() and (pixels[edge][:, :3] >= inside.min(0) - 25).all()
    channels = pictures.read_exr(tmp_path / "ball.exr")
    np.testing.assert_array_equal(channels["A"], alpha)
    np.testing.assert_array_equal(np.dstack([channels[name] for name in "RGB"]), clear.color)
    assert "alpha" not in channels and "depth.Z" in channels
    assert set(pictures.read_exr(tmp_path / "few.exr")) == {"R", "G", "B", "A", "depth.Z"}


def test_exposed_by_what_is_seen(clear):
    """The display's middle grey is the ball's, however little of the picture it covers."""
    covered = clear.display[clear.aov("alpha") == 1]
    assert abs(covered.mean() / 255 - srgb_encode(np.float32(0.18))) < 0.15

"""Glare, chromatic aberration and grain."""

import numpy as np
import pytest

import pica
from pica.color import srgb_decode
from pica.scenes.basic_meshes import plane, sphere
from pica.scenes.placing import move, rotate
from tests.building import placed, scene_of, settings, uniform

pytestmark = pytest.mark.filterwarnings("ignore:.*nearly black")
VIEW = pica.Camera(np.eye(4))
AS_IT_IS = {"post.auto_exposure": "false", "post.tone_map": "linear"}


def plain(*color: float) -> pica.Material:
    return pica.Material(base_color=(*color, 1.0), unlit=True)


def dots(*places):
    """Small white balls before black."""
    return scene_of(
        *(placed(sphere(0.03, plain(1, 1, 1)), move(*place, -2)) for place in places), environment=uniform(0)
    )


def board(*color):
    """A wall of one colour."""
    return scene_of(placed(plane(20, 20, plain(*color)), move(0, 0, -3) @ rotate("x", 90)), environment=uniform(0))


def rendered(device, scene, size, values, frames=1):
    renderer = pica.Renderer(scene, size=size, settings=settings({**AS_IT_IS, **values}), device=device)
    renderer.debug = True
    return [renderer.render(1, camera=VIEW) for _ in range(frames)]


@pytest.mark.parametrize("size", [(160, 160), (121, 95)])
def test_glare_is_a_star_of_six_rays_and_keeps_the_light(device, size):
    (frame,) = rendered(device, dots((0, 0)), size, {"post.glare": "0.5"})
    star = frame.aov("debug.post.glare")[..., 0]
    assert star.sum() == pytest.approx(frame.color[..., 0].sum(), rel=0.01)
    width, height = size
    rows, columns = np.mgrid[:height, :width]
    angle = np.arctan2(rows + 0.5 - height / 2, columns + 0.5 - width / 2)
    distance = np.hypot(rows + 0.5 - height / 2, columns + 0.5 - width / 2)
    ring = (distance > 12) & (distance < 18)
    # To the nearest of 30, 90, 150 ... degrees.
    along = np.abs((angle - np.pi / 6 + np.pi / 6) % (np.pi / 3) - np.pi / 6)
    on, between = star[ring & (along < 0.12)].mean(), star[ring & (along > 0.4)].mean()
    assert on > 3 * between


def test_aberration_moves_red_out_and_blue_in(device):
    size, share = (128, 128), 0.08
    (plain_frame,) = rendered(device, dots((0.6, 0)), size, {})
    (frame,) = rendered(device, dots((0.6, 0)), size, {"post.chromatic_aberration": str(share)})
    columns = np.arange(size[0]) + 0.5 - size[0] / 2

    def centre(picture, channel):
        light = srgb_decode(picture.display[..., channel] / 255).sum(0)
        return (light * columns).sum() / light.sum()

    middle = centre(plain_frame, 1)
    assert middle > 15
    assert centre(frame, 0) / middle == pytest.approx(1 + share / 2, abs=0.005)
    assert centre(frame, 1) == pytest.approx(middle, abs=0.01)
    assert centre(frame, 2) / middle == pytest.approx(1 - share / 2, abs=0.005)


@pytest.mark.parametrize("grey", [0.18, 0.5])
def test_grain_has_its_deviation_keeps_the_mean_and_is_new_in_each_frame(device, grey):
    first, second = rendered(device, board(grey, grey, grey), (128, 96), {"post.grain": "0.1"}, frames=2)
    light = [srgb_decode(frame.display[..., 0] / 255) for frame in (first, second)]
    for each in light:
        assert each.mean() == pytest.approx(grey, rel=0.005)
        assert each.std() / grey == pytest.approx(0.1 * (0.18 / grey) ** 0.5, rel=0.05)
    assert abs(np.corrcoef(light[0].ravel(), light[1].ravel())[0, 1]) < 0.05
    beside = np.corrcoef(light[0][:, 1:].ravel(), light[0][:, :-1].ravel())[0, 1]
    assert abs(beside) < 0.05
    assert np.ptp(first.color) < 1e-3, "the light itself has none"

"""From exposed radiance to the display: tone maps, white balance, look-up tables, dither, vignette."""

import numpy as np
import pytest

import pica
from pica.color import srgb_encode
from pica.effects.post.white_balance import adaptation, balance, planckian
from pica.scenes.basic_meshes import plane
from tests.building import CAMERA, lambert, placed, scene_of, settings

SIZE = (48, 32)
AS_IT_IS = {"post.auto_exposure": "false", "post.tone_map": "linear"}


def colorful() -> pica.Scene:
    """An environment of many colours from 0 to 1.2, smooth enough that a pixel has one colour."""
    values = np.random.default_rng(3).uniform(0, 1.2, (4, 8, 3)).astype(np.float32)
    return scene_of(placed(plane(0.01, 0.01, lambert())), environment=pica.Environment(values))


@pytest.fixture(scope="module")
def renderer(device):
    return pica.Renderer(colorful(), size=SIZE, settings=settings(AS_IT_IS), device=device)


def shown(renderer, **values):
    changed = {f"post.{name}": str(value) for name, value in values.items()}
    renderer.configure(settings({**AS_IT_IS, **changed}))
    renderer.reset()
    return renderer.render(1, camera=CAMERA)


def test_linear_is_the_radiance_clipped(renderer):
    frame = shown(renderer)
    np.testing.assert_allclose(frame.display / 255, srgb_encode(frame.color), atol=0.51 / 255)


def test_each_tone_map_is_another(renderer):
    pictures = [shown(renderer, tone_map=curve).display.astype(int) for curve in ("neutral", "agx", "aces", "linear")]
    for number, picture in enumerate(pictures):
        for other in pictures[:number]:
            assert np.abs(picture - other).mean() > 1


def test_the_planckian_locus():
    """CIE 15:2018: illuminant A, a black body of 2856 K; Robertson 1968: the locus at 154 mired."""
    np.testing.assert_allclose(planckian(2856), (0.44757, 0.40745), atol=1e-3)
    np.testing.assert_allclose(planckian(6504), (0.3135, 0.3237), atol=1e-3)
    for kelvin in (2222, 4000):
        np.testing.assert_allclose(planckian(kelvin - 1e-6), planckian(kelvin), atol=2e-4)


def test_bradford_from_daylight_to_horizon_light():
    """Lindbloom, "Chromatic Adaptation": Bradford, D65 to D50."""
    published = [[1.0478112, 0.0228866, -0.0501270], [0.0295424, 0.9904844, -0.0170491]]
    published += [[-0.0092345, 0.0150436, 0.7521316]]
    d65, d50 = np.array([0.95047, 1, 1.08883]), np.array([0.96422, 1, 0.82521])
    np.testing.assert_allclose(adaptation(d65, d50), published, atol=1e-4)


def test_white_balance_moves_the_white_and_keeps_its_luminance(renderer):
    np.testing.assert_allclose(balance(6500), np.eye(3), atol=1e-12)
    plain = shown(renderer).color
    warm = shown(renderer, white_balance=9000)
    np.testing.assert_array_equal(warm.color, plain)  # the radiance is as it was
    expected = srgb_encode(np.maximum(plain @ balance(9000).T, 0))
    np.testing.assert_allclose(warm.display / 255, expected, atol=0.6 / 255)
    assert balance(9000)[0].sum() > 1.1 > 0.9 > balance(9000)[2].sum()
    # The light of a black body of 9000 K, as Rec. 709 by another inverse than the one in use, becomes that of 6500 K.
    to_rgb = [[3.2409699, -1.5373832, -0.4986108], [-0.9692436, 1.8759675, 0.0415551]]
    to_rgb += [[0.0556301, -0.2039770, 1.0569715]]
    hot, white = (np.array([x / y, 1, (1 - x - y) / y]) @ np.transpose(to_rgb) for x, y in map(planckian, (9000, 6500)))
    np.testing.assert_allclose(balance(9000) @ hot, white, atol=1e-4)


def tetrahedral(table, place):
    """Interpolation along the axes in the order of their fractions, in double precision."""
    size = len(table)
    result = np.empty_like(place)
    for row, at in enumerate(place * (size - 1)):
        corner = np.minimum(at.astype(int), size - 2)
        within, value = at - corner, table[tuple(corner[::-1])].astype(float)
        for axis in np.argsort(-within, kind="stable"):
            before = table[tuple(corner[::-1])].astype(float)
            corner[axis] += 1
            value = value + within[axis] * (table[tuple(corner[::-1])] - before)
        result[row] = value
    return result


def test_a_look_up_table_is_interpolated_tetrahedrally(device):
    table = np.random.default_rng(4).uniform(0, 1, (5, 5, 5, 3)).astype(np.float32)
    lut = pica.Lut(table, ((-0.5, 0, 0), (1, 1, 2)))
    renderer = pica.Renderer(colorful(), size=SIZE, settings=settings(AS_IT_IS), device=device, lut=lut)
    frame = renderer.render(1, camera=CAMERA)
    place = (srgb_encode(frame.color).reshape(-1, 3) - (-0.5, 0, 0)) / (1.5, 1, 2)
    np.testing.assert_allclose(frame.display.reshape(-1, 3) / 255, tetrahedral(table, place), atol=0.6 / 255)


def test_dither_hides_bands_and_keeps_the_mean(renderer):
    plain, dithered = shown(renderer), shown(renderer, dither="true")
    exact = srgb_encode(plain.color) * 255
    error = dithered.display - exact
    assert np.abs(error).max() < 1.01 and np.abs(dithered.display.astype(int) - plain.display).max() == 1
    assert abs(error[exact < 254].mean()) < 0.02  # white has no room for noise above it
    assert 0.2 < error[exact < 254].std() < 0.6


def test_vignette_darkens_the_corners_by_what_it_says(renderer):
    plain = shown(renderer).color
    dark = shown(renderer, vignette=0.5).display / 255
    rows, columns = (np.arange(size) * 2 + 1 - size for size in plain.shape[:2])
    place = (rows[:, None] / SIZE[1]) ** 2 + (columns / SIZE[0]) ** 2
    falloff = 1 / (1 + place / 2 * (0.5**-0.5 - 1)) ** 2  # 1/2 where place is 2, in the very corner
    np.testing.assert_allclose(dark, srgb_encode(plain * falloff[..., None]), atol=0.6 / 255)

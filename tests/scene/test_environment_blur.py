"""Environment.blurred against a Gaussian on the sphere."""

import numpy as np
import pytest

from pica.errors import SceneError
from pica.scene.environment import Environment

HEIGHT, WIDTH = 64, 128
POLAR = (np.arange(HEIGHT) + 0.5) / HEIGHT * np.pi
SOLID_ANGLE = np.sin(POLAR)[:, None]


def directions() -> np.ndarray:
    azimuth = (np.arange(WIDTH) + 0.5) / WIDTH * 2 * np.pi
    flat = np.sin(POLAR)[:, None, None] * np.stack([np.cos(azimuth), 0 * azimuth, np.sin(azimuth)], -1)
    return flat + np.cos(POLAR)[:, None, None] * (0, 1, 0)


@pytest.mark.parametrize(("row", "error"), [(32, 0.02), (12, 0.05), (3, 0.25)])
@pytest.mark.parametrize("column", [64, 0])
def test_a_point_becomes_a_spot_of_the_same_power(row: int, error: float, column: int) -> None:
    """At the horizon and near the zenith, and where the picture's edges meet."""
    radiance = np.zeros((HEIGHT, WIDTH, 3), np.float32)
    radiance[row, column] = (1, 2, 0)
    spot = Environment(radiance, strength=3.0, rotation=0.5, name="point").blurred(0.2)
    assert (spot.strength, spot.rotation, spot.name) == (3.0, 0.5, "point")
    angle = np.arccos(np.clip(directions() @ directions()[row, column], -1, 1))
    expected = np.exp(-0.5 * (angle / 0.2) ** 2)
    expected *= np.sin(POLAR[row]) / (expected * SOLID_ANGLE).sum()
    found = spot.radiance[..., 0]
    assert np.abs(found - expected).max() < error * expected.max()
    assert (found * SOLID_ANGLE).sum() == pytest.approx(np.sin(POLAR[row]), rel=0.06)
    np.testing.assert_allclose(spot.radiance[..., 1], 2 * found, rtol=1e-5, atol=1e-9)


def test_no_blur_changes_nothing_and_even_light_stays_even() -> None:
    radiance = np.random.default_rng(0).random((16, 31, 3)).astype(np.float32)
    np.testing.assert_allclose(Environment(radiance).blurred(0).radiance, radiance, atol=1e-6)
    even = Environment(np.full((32, 64, 3), 2.0, np.float32)).blurred(1.0)
    np.testing.assert_allclose(even.radiance, 2.0, rtol=1e-6)


def test_wide_blurs_have_few_texels() -> None:
    wide = Environment(np.ones((256, 512, 3), np.float32)).blurred(0.5)
    assert wide.radiance.shape[0] <= 64


@pytest.mark.parametrize("angle", [-0.1, float("nan"), "wide"])
def test_what_is_no_angle_is_refused(angle: object) -> None:
    with pytest.raises(SceneError, match="blurred: angle"):
        Environment(np.ones((2, 4, 3), np.float32)).blurred(angle)  # type: ignore[arg-type]

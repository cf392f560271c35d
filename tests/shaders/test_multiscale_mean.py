"""multiscale_mean.slang on values that stay, step, rise, and fall out of line: one ray's light, mostly none."""

import numpy as np
import pytest

SOURCE = """
import filtering.multiscale_mean;
import shaders.noise;

static const uint CHANGES = 300; // the frame
static const uint LISTING = 1, SETTLED = 2; // ways

float level(uint kind, uint frame)
{
    float since = frame < CHANGES ? 0 : frame - CHANGES;
    return kind == 1 ? (since > 0 ? 1 : .25) : kind == 2 ? .25 + min(since / 200, 1) : .5;
}

// The mean of the values up to `last`, of rays of which the share `finding` finds light. kind 0: they stay; 1: a step;
// 2: a ramp of 200 frames; 3: one value of 1000.
float meanAt(uint sequence, uint last, uint kind, float finding, float scale, uint way)
{
    MultiscaleMean estimator = MultiscaleMean.create(0);
    for (uint frame = 0; frame <= last; ++frame)
    {
        bool found = toUnitFloat(pcg3d(uint3(sequence, frame, 7)).x) < finding;
        float value = found ? level(kind, frame) / finding : 0;
        if (kind == 3 && frame == CHANGES)
            value = 1000;
        float3 taken = value * scale;
        if (way != LISTING)
            estimator.add(taken, scale, 0, way == SETTLED);
        else
        {
            float share = estimator.listed(taken, scale);
            estimator.count += 1;
            estimator.mean = lerp(estimator.mean, taken, share);
        }
    }
    return estimator.mean.x / scale;
}
"""
CHANGES = 300
STAYS, STEP, RAMP, IMPULSE = range(4)
LISTING, SETTLED = 1, 2


@pytest.fixture(scope="module")
def means(load):
    """The mean over many sequences, and their standard deviation, at these frames."""
    shader = load(SOURCE)

    def run(kind, frames, finding=0.5, scale=1.0, way=0, sequences=256):
        frames = np.asarray(frames, np.uint32)
        sequence, last = np.meshgrid(np.arange(sequences, dtype=np.uint32), frames, indexing="ij")
        found = shader.meanAt(
            sequence.ravel(), last.ravel(), kind, finding, float(scale), way, _result="numpy"
        ).reshape(sequences, len(frames))
        return found.mean(0), found.std(0)

    return run


def frames_until(mean, low, high, share):
    return int(np.argmax((mean - low) / (high - low) >= share))


@pytest.mark.parametrize("finding", [0.5, 0.8, 0.95])
def test_a_step_is_followed(means, finding):
    mean, _ = means(STEP, CHANGES + np.arange(0, 150), finding)
    assert frames_until(mean, 0.25, 1, 0.8) <= 32
    assert frames_until(mean, 0.25, 1, 0.95) <= 85
    assert mean.max() < 1 + 0.1 * 0.75


@pytest.mark.parametrize("finding", [0.8, 0.95])
def test_the_listing_follows_as_fast_as_the_chapter_has_it(means, finding):
    mean, _ = means(STEP, CHANGES + np.arange(0, 150), finding, way=LISTING)
    assert 30 <= frames_until(mean, 0.25, 1, 0.8) <= 57


def test_noise_is_averaged(means):
    """A value's deviation is as large as its mean. That of the mean is an eighth."""
    mean, deviation = means(STAYS, [CHANGES])
    assert mean[0] == pytest.approx(0.5, rel=0.03)
    assert deviation[0] < 0.14 * 0.5


def test_in_a_settled_scene_values_are_of_equal_worth(means):
    """Of which one in twenty brings all the light: the plain mean of 300 deviates by a quarter. Little is lost."""
    mean, deviation = means(STAYS, [CHANGES - 1], finding=0.05, way=SETTLED, sequences=1024)
    assert mean[0] == pytest.approx(0.5, rel=0.12)
    assert deviation[0] == pytest.approx(0.5 * (0.95 / 0.05 / CHANGES) ** 0.5, rel=0.2)


def test_a_ramp_is_followed(means):
    mean, _ = means(RAMP, CHANGES + np.arange(0, 400, 20))
    expected = 0.25 + np.minimum(np.arange(0, 400, 20) / 200, 1)
    assert np.abs(mean - expected).max() < 0.18
    assert mean[-1] == pytest.approx(1.25, rel=0.05)


def test_an_impulse_passes(means):
    """A firefly of two thousand times the mean."""
    mean, _ = means(IMPULSE, CHANGES + np.array([-1, 0, 5, 60]))
    assert mean[1:].max() < 1.6 * mean[0]
    assert mean[3] == pytest.approx(0.5, rel=0.1)


@pytest.mark.parametrize("scale", [1e-3, 1e5])
def test_units_do_not_matter(means, scale):
    frames = CHANGES + np.array([-1, 10, 60])
    np.testing.assert_allclose(means(STEP, frames, scale=scale)[0], means(STEP, frames)[0], rtol=1e-3)

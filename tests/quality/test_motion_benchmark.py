"""benchmarks/motion.py: what it stores, and how it counts."""

from types import SimpleNamespace

import numpy as np
import pytest

import pica
from benchmarks import motion, motion_scenes
from pica.scene.orbit import encloses


class Tracer:
    """Paints its seed."""

    made = 0

    def __init__(self, scene, *, size, settings, device):
        Tracer.made += 1
        self.picture = np.full((size[1], size[0], 3), 1.0 + settings.seed, np.float32)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def render(self, samples, *, camera):
        return SimpleNamespace(color=self.picture * samples)


@pytest.fixture
def bench(monkeypatch, tmp_path):
    monkeypatch.setitem(vars(pica), "PathTracer", Tracer)
    monkeypatch.setattr(Tracer, "made", 0)
    return motion.Bench(None, (4, 2), 8, pica.Settings(), tmp_path / "references")


def test_references_are_two_halves_and_traced_once(bench):
    first = bench.reference("box", None, None, (4, 2))
    assert first.shape == (2, 2, 4, 3) and first.mean() == 6 and (first[0] == 4).all() and Tracer.made == 2
    np.testing.assert_array_equal(bench.reference("box", None, None, (4, 2)), first)
    assert Tracer.made == 2
    bench.reference("other", None, None, (4, 2))
    bench.reference("box", None, None, (2, 2))
    assert Tracer.made == 6


def test_the_mean_is_over_the_reference_s_and_clips_what_display_white_clips():
    halves = np.full((2, 10, 10, 3), 0.5, np.float32)
    assert motion.errors(halves, halves[0]) == {"flip": 0.0, "mean": 1.0}
    assert motion.errors(halves, 0.8 * halves[0])["mean"] == pytest.approx(0.8)
    lamp, dimmer = halves.copy(), halves[0].copy()
    lamp[:, 0, 0], dimmer[0, 0] = 100.0, 50.0
    assert motion.errors(lamp, dimmer)["mean"] == 1.0


def test_sky_next_to_the_ring_does_not_count():
    mask = np.zeros((9, 9), bool)
    mask[4, 4] = True
    grown = motion._dilated(mask, 2)
    assert grown[2:7, 2:7].all() and grown.sum() == 25


@pytest.mark.parametrize(("name", "inside"), [("door", True), ("metal", True), ("ring", False)])
def test_cameras_stand_in_the_rooms_and_outside_of_the_ring(name, inside):
    scene = getattr(motion_scenes, name)()
    assert encloses(scene, scene.default_camera(16 / 9)) == inside

"""What is kept of a bake that was cut short, which may come from anybody: a bake goes on there, or begins anew."""

import numpy as np
import pytest

from pica.baking.bake import _Done
from pica.light_map.bricks import bricks_around
from pica.light_map.light_map import HARMONICS

KEY = np.array(["content", "layout", "0.5 16 1"])


def nothing_yet() -> _Done:
    return _Done(bricks_around(np.zeros(3), np.ones(3), 1.0, *[np.zeros((1, 1, 1), bool)] * 2), KEY)


@pytest.fixture
def written(tmp_path):
    """A file of 20 probes and a brick."""

    def write(light=1.0, inside=0.0, key=KEY, probes=20):
        done = nothing_yet()
        done._key = key
        done.light, done.probes = np.full((probes, HARMONICS, 4), light, np.float32), probes
        done.inside = np.full(probes, inside, np.float32)
        done.bricks = 1
        done.write(tmp_path / "a.partial")
        return tmp_path / "a.partial"

    return write


def went_on(file) -> bool:
    done = nothing_yet()
    done.read(file)
    assert np.isfinite(done.light).all() and np.isfinite(done.inside).all()
    assert (done.probes, done.bricks) in ((20, 1), (0, 0))
    return done.probes > 0


def test_it_goes_on_with_the_same_bake_alone(written, tmp_path):
    assert went_on(written())
    assert not went_on(written(key=np.array(["content", "layout", "0.5 32 1"])))
    assert not went_on(written(probes=1000))
    assert not went_on(tmp_path / "missing.partial")


@pytest.mark.parametrize("values", [{"light": np.nan}, {"light": np.inf}, {"light": -3e38}, {"inside": np.nan}])
def test_light_that_cannot_be_is_baked_anew(written, values):
    assert not went_on(written(**values))


def test_broken_files_end_nothing(written):
    file = written()
    whole, random, survived = file.read_bytes(), np.random.default_rng(4), 0
    for _ in range(300):
        content = bytearray(whole)
        for place in random.integers(0, len(whole), random.integers(1, 6)):
            content[place] = random.choice([0, 1, 0x7F, 0x80, 0xFF, content[place] ^ 4])
        file.write_bytes(content[: len(whole) if random.random() < 0.8 else random.integers(len(whole))])
        survived += went_on(file)
    assert survived < 150

"""Machine code of the loops around Embree is kept, and a cache of it that fails is made anew."""

import os
import pickle
import subprocess
import sys
import warnings
from types import ModuleType

import pytest

from pica.caches.places import NUMBA
from pica.tracing import embree

numba = pytest.importorskip("numba")
from pica.tracing import kept_loops  # noqa: E402

LOAD = """
import numba
from pica.tracing import kept_loops
before = numba.config.CACHE_DIR
kept_loops.load().nearest.signatures
assert numba.config.CACHE_DIR == before
"""


@pytest.fixture
def folder(monkeypatch, tmp_path):
    monkeypatch.setattr(kept_loops, "caches", lambda: tmp_path)
    monkeypatch.setattr(kept_loops, "load", kept_loops.load.__wrapped__)
    (tmp_path / NUMBA / "below").mkdir(parents=True)
    return tmp_path / NUMBA


def test_a_cache_that_fails_is_removed_and_told(monkeypatch, folder):
    def imported(place):
        assert place == str(folder)
        if (folder / "below").exists():
            raise pickle.UnpicklingError("pickle data was truncated")
        return ModuleType("loops")

    monkeypatch.setattr(kept_loops, "_imported", imported)
    with pytest.warns(
        UserWarning, match=r"failed \(UnpicklingError: pickle data was truncated\) and was removed"
    ) as told:
        assert kept_loops.load().__name__ == "loops"
    assert len(told) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        kept_loops.load()


def test_where_nothing_can_be_kept_nothing_is(monkeypatch, folder):
    def imported(place):
        if place:
            raise OSError("No space left on device")
        return ModuleType("loops")

    monkeypatch.setattr(kept_loops, "_imported", imported)
    with pytest.warns(UserWarning, match="No space left"):
        assert kept_loops.load().__name__ == "loops"


def test_a_fault_of_the_loops_themselves_is_raised(monkeypatch, folder):
    def imported(_):
        raise ZeroDivisionError

    monkeypatch.setattr(kept_loops, "_imported", imported)
    with pytest.raises(ZeroDivisionError), warnings.catch_warnings():
        warnings.simplefilter("error")
        kept_loops.load()


@pytest.mark.slow
@pytest.mark.skipif(embree.missing() is not None, reason=f"Embree cannot trace: {embree.missing()}")
def test_numbas_own_files(tmp_path):
    """Compiled in one process, read in the next, truncated for the third, and whole again for the fourth."""
    said = []
    for _ in range(4):
        environment = {**os.environ, "PICA_CACHE": str(tmp_path)}
        command = [sys.executable, "-c", LOAD]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=240)
        assert done.returncode == 0, done.stderr
        said.append(done.stderr)
        kept = [path for path in (tmp_path / NUMBA).rglob("*") if path.is_file()]
        assert len(kept) > 4
        if len(said) == 2:
            for path in kept:
                os.truncate(path, path.stat().st_size // 2)
    assert ["failed" in text for text in said] == [False, False, True, False]

"""Where caches go: for users who may write nowhere as well."""

import os
import stat
import subprocess
import sys
import warnings
from pathlib import Path

import pytest

from pica.caches import places
from pica.caches.places import COMPILED, MESA, MODULES, SHADERS, cache_folder, caches
from tests.unprivileged import needs_unprivileged, unprivileged

PLACES = """
import os, stat, sys, warnings
with warnings.catch_warnings(record=True) as told:
    warnings.simplefilter("always")
    from pica.caches.places import caches
    folder, again = caches(), caches()
assert folder == again
print(folder, oct(stat.S_IMODE(os.stat(folder).st_mode)) if folder else "", len(told), sep="|")
print(*(warning.message for warning in told))
print(*(open(os.path.join(folder, file)).read() for file in os.environ.get("LOOK", "").split()))
"""


@pytest.fixture(autouse=True)
def no_choice_yet(monkeypatch):
    monkeypatch.delenv("PICA_CACHE", raising=False)
    monkeypatch.delenv("MESA_SHADER_CACHE_DIR", raising=False)
    monkeypatch.delenv("LP_NATIVE_VECTOR_WIDTH", raising=False)
    monkeypatch.setattr(places, "_usable", places._usable.__wrapped__)


def found_by_somebody(**environment: str) -> tuple[str, str, int, str, str]:
    """The folder that a process without privileges takes, its mode, the number of warnings, their text, and what the
    files are that LOOK names in it."""
    first, last, held = ran(unprivileged([sys.executable, "-c", PLACES]), **environment).splitlines()
    folder, mode, count = first.split("|")
    return folder, mode, int(count), last, held


def ran(command: list[str], **environment: str) -> str:
    """What a process says in an environment without a choice of folders but these."""
    hidden = ("HOME", "XDG_CACHE_HOME", "PICA_CACHE", "MESA_SHADER_CACHE_DIR", "LP_NATIVE_VECTOR_WIDTH")
    shown = {name: value for name, value in os.environ.items() if name not in hidden}
    done = subprocess.run(command, env=shown | environment, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_environment_names_the_folder(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "there"))
    if sys.platform.startswith("linux"):
        assert cache_folder() == tmp_path / "there" / "pica"
        monkeypatch.setenv("PICA_CACHE", "")
        assert cache_folder() == tmp_path / "there" / "pica", "an empty one is none"
        monkeypatch.setenv("XDG_CACHE_HOME", "")
        monkeypatch.setenv("HOME", str(tmp_path))
        assert cache_folder() == tmp_path / ".cache" / "pica"
    monkeypatch.setenv("PICA_CACHE", str(tmp_path / "here"))
    assert cache_folder() == tmp_path / "here"
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PICA_CACHE", "near")
    assert cache_folder() == tmp_path / "near"


def test_all_caches_are_in_one_folder(monkeypatch, tmp_path):
    monkeypatch.setenv("PICA_CACHE", str(tmp_path / "new" / "cache"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert caches() == tmp_path / "new" / "cache"
    assert all((tmp_path / "new" / "cache" / place).is_dir() for place in (MODULES, SHADERS, MESA))
    assert os.environ["MESA_SHADER_CACHE_DIR"] == str(tmp_path / "new" / "cache" / MESA)
    assert not [path for path in tmp_path.rglob("*") if path.is_file()], "trying leaves nothing"


def test_programs_for_another_vector_width_are_apart(monkeypatch, tmp_path):
    """A process would load them, and crash."""
    monkeypatch.setenv("PICA_CACHE", str(tmp_path))
    monkeypatch.setenv("LP_NATIVE_VECTOR_WIDTH", "256")
    apart = tmp_path / "vectors-256"
    assert caches() == apart and os.environ["MESA_SHADER_CACHE_DIR"] == str(apart / MESA)
    monkeypatch.setenv("PICA_CACHE", str(apart))
    assert caches() == apart, "of a worker, which is told the folder in use"


def test_what_the_user_says_of_mesa_stays(monkeypatch, tmp_path):
    monkeypatch.setenv("PICA_CACHE", str(tmp_path))
    monkeypatch.setenv("MESA_SHADER_CACHE_DIR", "/elsewhere")
    caches()
    assert os.environ["MESA_SHADER_CACHE_DIR"] == "/elsewhere"


@pytest.mark.parametrize("place", [Path(), MODULES, SHADERS, MESA, SHADERS / "rhi" / "data.mdb"])
def test_what_is_in_the_way_is_told_and_avoided(monkeypatch, tmp_path, place):
    """A file where a folder should be, or the other way round."""
    way = tmp_path / "cache" / place
    way.parent.mkdir(parents=True, exist_ok=True)
    way.mkdir() if place.suffix == ".mdb" else way.touch()
    monkeypatch.setenv("PICA_CACHE", str(tmp_path / "cache"))
    with pytest.warns(UserWarning, match=r"cannot be kept in .*cache \(.+\); .*pica-\w+ stands in until") as told:
        folder = caches()
    assert len(told) == 1
    assert folder is not None and tmp_path not in folder.parents and (folder / MESA).is_dir()
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert os.environ["MESA_SHADER_CACHE_DIR"] == str(folder / MESA)


def test_a_full_disk_is_told_and_avoided(monkeypatch, tmp_path):
    monkeypatch.setenv("PICA_CACHE", str(tmp_path))
    usage = places.shutil.disk_usage(tmp_path)
    full = lambda path: usage._replace(free=2 << 20) if path == tmp_path else usage  # noqa: E731
    monkeypatch.setattr(places.shutil, "disk_usage", full)
    with pytest.warns(UserWarning, match=r"2 MiB are free, and 16 are needed"):
        assert caches() != tmp_path


def test_no_place_at_all(monkeypatch, tmp_path):
    (tmp_path / "file").touch()
    monkeypatch.setenv("PICA_CACHE", str(tmp_path / "file"))
    monkeypatch.setattr(places.tempfile, "mkdtemp", lambda prefix: os.mkdir(tmp_path / "file" / "below"))
    with pytest.warns(UserWarning, match="nor anywhere else"):
        assert caches() is None
    assert "MESA_SHADER_CACHE_DIR" not in os.environ


@needs_unprivileged
def test_somebody_who_may_write_nowhere(tmp_path):
    closed = tmp_path / "closed"
    closed.mkdir(mode=0o500)
    for environment in ({"HOME": str(closed)}, {"HOME": "/nonexistent"}, {"PICA_CACHE": str(closed)}, {}):
        if not environment and os.geteuid():
            continue  # an ordinary user's home is known without HOME too
        folder, mode, warned, text, _ = found_by_somebody(**environment)
        assert Path(folder).name.startswith("pica-") and mode == "0o700"
        assert warned == 1 and f"cannot be kept in {next(iter(environment.values()), '')}" in text
        assert not Path(folder).exists(), "it goes with the process"


@needs_unprivileged
def test_a_full_cache_that_can_only_be_read_serves(tmp_path):
    """As in an image: all that is in it is there in the copy, which may be written to; and it costs no warning."""
    cache = tmp_path / "cache"
    files = [COMPILED, SHADERS.parent / "modules" / "a" / "b.slang-module", MESA / "part0" / "mesa_cache.db"]
    for number, file in enumerate(files):
        (cache / file).parent.mkdir(parents=True, exist_ok=True)
        (cache / file).write_text(str(number))
    for path in [cache, *cache.rglob("*")]:
        path.chmod(0o555 if path.is_dir() else 0o444)
    folder, _, warned, _, held = found_by_somebody(PICA_CACHE=str(cache), LOOK=" ".join(map(str, files)))
    assert Path(folder).name.startswith("pica-") and warned == 0 and held == "0 1 2"
    assert not Path(folder).exists(), "it goes with the process"
    (cache / COMPILED).chmod(0)
    for path in [cache, *cache.rglob("*")]:
        path.chmod(0o755)  # for pytest to remove


def test_files_that_may_not_be_long_enough_are_told_and_avoided(tmp_path):
    """A write beyond the limit to a file that is mapped ends the process."""
    limited = f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 20, 1 << 20))\n{PLACES}"
    done = ran([sys.executable, "-c", limited], PICA_CACHE=str(tmp_path))
    assert done.startswith("None||1\n") and "files may have 1 MiB here (ulimit -f)" in done


@needs_unprivileged
def test_a_database_of_somebody_else(tmp_path):
    tmp_path.chmod(0o777)
    folder, _, warned, _, _ = found_by_somebody(PICA_CACHE=str(tmp_path / "cache"))
    assert folder == str(tmp_path / "cache") and warned == 0
    data = tmp_path / "cache" / SHADERS / "rhi" / "data.mdb"
    data.parent.mkdir()
    data.touch(0o400)
    folder, _, warned, text, _ = found_by_somebody(PICA_CACHE=str(tmp_path / "cache"))
    assert "pica-" in Path(folder).name and warned == 1 and "Permission denied" in text
    data.chmod(0o600)

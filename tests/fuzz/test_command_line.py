"""Command lines end with exit code 0 or 2, and what is wrong in one line."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

import pica
from pica.cli.main import main
from tests.fuzz import whole_files
from tests.fuzz.mutations import NUMBERS, TEXTS

OPTIONS = [
    "-o",
    "--output",
    "--size",
    "--frames",
    "--preset",
    "--set",
    "--aov",
    "--path-traced",
    "--samples",
    "--seconds",
]
OPTIONS += ["--fps", "--resume", "--device", "--json", "--env", "--camera", "--eye", "--target", "--fov"]
OPTIONS += [
    "--env-strength",
    "--env-rotation",
    "--sun",
    "--up",
    "--variant",
    "--ev",
    "--turntable",
    "--camera-path",
    "--transparent",
    "--against",
]
OPTIONS += ["--start", "--animation", "--effect", "--sequence", "--speed", "--help", "--", "-"]
SCENES = ["cornell", "demo", "model.gltf", "missing.gltf", "folder", "nothing"]
VALUES = [
    *map(str, NUMBERS),
    *TEXTS,
    *SCENES,
    "64x36",
    "0x0",
    "-1x5",
    "1e3x2",
    "9" * 30 + "x1",
    "a.png",
    "f/%04d.png",
    "a.mp4",
]
VALUES += [
    "1,2,3",
    "1,2",
    "nan,0,0",
    "low",
    "shadows.mode=off",
    "shadows.mode",
    "=",
    "seed=nan",
    "shadows=high",
    "%d.png",
]
word = st.sampled_from(VALUES) | st.sampled_from(OPTIONS) | st.text(max_size=10)


class Stub:
    """Instead of what renders: here only what comes before is tried."""

    def __init__(self, *_: object, **__: object) -> None:
        raise pica.errors.DeviceError("nothing renders here")


@pytest.fixture(autouse=True)
def nothing_renders(monkeypatch, tmp_path):
    monkeypatch.setattr(pica, "Renderer", Stub)
    monkeypatch.setattr(pica, "PathTracer", Stub)
    monkeypatch.chdir(tmp_path)
    whole_files.gltf().write(tmp_path)
    (tmp_path / "folder").mkdir()


@given(st.sampled_from(["render", "compare", "bench", "info", "", "nothing"]), st.lists(word, max_size=8))
def test_exit_codes_and_lines(nothing_renders, capfd, command, words):
    words = [word for word in words if "\0" not in word]  # which no command line can hold
    code = main([command, *words] if command else words)
    shown = capfd.readouterr()
    assert code in (0, 2), shown.err
    if code == 2 and shown.err:
        lines = [line for line in shown.err.splitlines() if not line.startswith("pica: warning: ")]
        assert len(lines) == 1 and lines[0].startswith("pica: ") and lines[0].isprintable(), shown.err
        assert "internal error" not in lines[0] and len(lines[0]) < 2500

"""Every command over every built-in scene and effect: a result, or one line that says why there is none."""

import itertools

import pytest

from pica.cli.subject import BUILT_IN
from pica.settings import PRESETS

SMALL, ONE_FRAME = ["--size", "24x16"], ["--frames", "1"]
SCENES = sorted(set(BUILT_IN) - {"demo"})
EFFECTS = ["shadows", "ambient_occlusion", "global_illumination", "reflections"]
WAYS = {
    "render": [["-o", "out.png"], ["-o", "out.exr", "--transparent"], ["-o", "%d.png", "--turntable", "--fps", "0.25"]],
    "compare": [["--samples", "1"], ["--against", "preset=balanced"]],
    "bench": [["--warm-up", "0"]],
}
WAYS["render"] += [["-o", "out.png", "--path-traced", "--samples", "1"]]
WAYS["render"] += [["-o", "out.png", "--preset", preset] for preset in PRESETS]
WAYS["compare"] += [
    ["--samples", "1", "--effect", effect, "--set", "ambient_occlusion.mode=ray_traced", "--sequence", sequence]
    for effect, sequence in itertools.product(EFFECTS, ("still", "orbit", "objects", "light"))
]
EVERY = [(command, scene, way) for command, ways in WAYS.items() for scene in SCENES for way in ways]
SPREAD = [("compare", "cornell", WAYS["compare"][2]), *EVERY[:: len(EVERY) // 11]]
"""A few of them, at least one of each command."""


def check(run, tmp_path, monkeypatch, command, scene, way):
    monkeypatch.chdir(tmp_path)
    frames = [] if "--path-traced" in way else ONE_FRAME
    code, _, err = run(command, scene, *SMALL, *frames, *way)
    told = [line for line in err.splitlines() if line.startswith("pica: ") and not line.startswith("pica: warning: ")]
    assert code == 0 or (code == 2 and len(told) == 1 and told[0].startswith("pica: compare --effect")), err


@pytest.mark.device
@pytest.mark.parametrize(
    ("command", "scene", "way"), SPREAD, ids=lambda value: " ".join([value] if isinstance(value, str) else value)
)
def test_a_spread(run, tmp_path, monkeypatch, command, scene, way):
    check(run, tmp_path, monkeypatch, command, scene, way)


@pytest.mark.slow
@pytest.mark.device
@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.timeout(3600)
def test_every_way(run, tmp_path, monkeypatch, scene):
    for command, ways in WAYS.items():
        for way in ways:
            check(run, tmp_path, monkeypatch, command, scene, way)

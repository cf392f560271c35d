"""Every command over every built-in scene and effect: a result, or one line that says why there is none."""

import itertools

import pytest

from pica.cli.subject import BUILT_IN
from pica.settings import PRESETS

SMALL, ONE_FRAME = ["--size", "24x16"], ["--frames", "1"]
SCENES = sorted(set(BUILT_IN) - {"demo"})
EFFECTS = ["shadows", "ambient_occlusion", "global_illumination", "reflections"]


def of_effect(effect, sequence):
    return [*REFERENCE, "--effect", effect, "--set", "ambient_occlusion.mode=ray_traced", "--sequence", sequence]


PICTURE, REFERENCE = ["-o", "out.png"], ["--samples", "1"]
TRANSPARENT, TURNTABLE = ["-o", "out.exr", "--transparent"], ["-o", "%d.png", "--turntable", "--fps", "0.25"]
PATH_TRACED, BENCH = [*PICTURE, "--path-traced", *REFERENCE], ["--warm-up", "0"]
PRESET = {preset: [*PICTURE, "--preset", preset] for preset in PRESETS}
OF_EFFECTS = list(itertools.starmap(of_effect, itertools.product(EFFECTS, ("still", "orbit", "objects", "light"))))
WAYS = {
    "render": [PICTURE, TRANSPARENT, TURNTABLE, PATH_TRACED, *PRESET.values()],
    "compare": [REFERENCE, ["--against", "preset=balanced"], *OF_EFFECTS],
    "bench": [BENCH],
}
SPREAD = [
    ("render", "cornell", PICTURE),
    ("render", "cornell", PATH_TRACED),
    ("render", "court", TRANSPARENT),
    ("render", "corridor", PRESET["raster"]),
    ("render", "machine_world", TURNTABLE),
    ("render", "sphere_sweep", PRESET["performance"]),
    ("compare", "cornell", of_effect("shadows", "still")),
    ("compare", "cornell", of_effect("reflections", "light")),
    ("compare", "court", of_effect("ambient_occlusion", "still")),
    ("compare", "cornell", of_effect("global_illumination", "light")),
    ("compare", "rooms", of_effect("ambient_occlusion", "light")),
    ("compare", "rooms", of_effect("shadows", "still")),
    ("compare", "sphere_grid", of_effect("reflections", "objects")),
    ("bench", "rooms", BENCH),
]
"""A few of them; programs for the showroom's coats take minutes to compile, and are left to the test of every way."""


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

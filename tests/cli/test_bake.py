"""`pica bake`, and what render and bench do with the file."""

import json

import numpy as np
import pytest

import pica
from pica.light_map.bricks import bricks_around
from pica.light_map.light_map import HARMONICS, SEEN_PER_BRICK, LightMap


@pytest.fixture
def bakes(monkeypatch):
    """What was asked of pica.bake, which gives a small map at once."""
    asked = []

    def bake(scene, spacing, samples, settings, device, progress, partial):
        asked.append({"spacing": spacing, "samples": samples, "partial": partial.name, "device": device})
        progress(1, 1)
        bricks = bricks_around(np.zeros(3), np.ones(3), 0.5, *[np.ones((1, 1, 1), bool)] * 2)
        light = np.ones((len(bricks.probes), HARMONICS, 3), np.float16)
        seen = np.zeros((len(bricks.places), SEEN_PER_BRICK), np.uint8)
        return LightMap(bricks, 1.0, light, np.ones(len(light), bool), seen, 32 * "0", 32 * "1")

    monkeypatch.setitem(vars(pica), "bake", bake)
    return asked


def test_bakes_a_file_and_says_so(run, calls, bakes, tmp_path):
    file = tmp_path / "a.lightmap"
    code, out, err = run("bake", "m.glb", "-o", file, "--spacing", "0.5", "--samples", "64")
    assert code == 0 and "125 probes, 0.5 m apart" in out and "Baking" in err
    assert bakes == [{"spacing": 0.5, "samples": 64, "partial": "a.lightmap.partial", "device": None}]
    told = json.loads(run("bake", "m.glb", "-o", file, "--json")[1])
    assert told["probes"] == 125 and told["bytes"] == file.stat().st_size and told["samples"] == 1024


def test_render_and_bench_take_it(run, calls, bakes, tmp_path):
    file = tmp_path / "a.lightmap"
    run("bake", "m.glb", "-o", file)
    small = "--size", "8x4", "--light-map", file
    assert run("render", "m.glb", "-o", tmp_path / "a.png", *small, "--preset", "raster")[0] == 0
    assert run("bench", "m.glb", *small, "--set", "global_illumination.mode=light_map")[0] == 0
    assert run("bench", "m.glb", *small)[0] == 0
    assert [len(call.light_map.harmonics) for call in calls] == 5 * [
        125
    ]  # bench renders twice, with a moving camera and with one at rest


def test_a_map_that_nobody_would_look_at_is_refused(run, calls, bakes, tmp_path):
    file = tmp_path / "a.lightmap"
    run("bake", "m.glb", "-o", file)
    for arguments, fault in (
        (["--light-map", file, "--set", "global_illumination.mode=surfels"], "global_illumination.mode is surfels"),
        (["--light-map", file, "--preset", "raster", "--path-traced"], "--path-traced"),
        (["--light-map", tmp_path / "missing.lightmap", "--preset", "raster"], "no such file"),
    ):
        code, _, err = run("render", "m.glb", "-o", tmp_path / "a.png", "--size", "8x4", *arguments)
        assert code == 2 and fault in err
    code, _, err = run("bake", "m.glb", "-o", tmp_path / "a.png")
    assert code == 2 and ".lightmap" in err
    assert calls == []

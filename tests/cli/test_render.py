import json
import math

import numpy as np
import pytest
from PIL import Image

from pica import pictures


def test_writes_the_picture_and_says_so(run, calls, tmp_path):
    code, out, _ = run("render", "model.glb", "-o", tmp_path / "out.png", "--size", "8x4", "--frames", "3")
    assert code == 0
    assert "8x4, 3 frames" in out and "fake device" in out
    assert Image.open(tmp_path / "out.png").size == (8, 4)
    assert (calls[0].size, calls[0].frames, calls[0].camera) == ((8, 4), 3, None)


def test_json_is_one_object(run, calls, tmp_path):
    code, out, _ = run("render", "model.glb", "-o", tmp_path / "out.png", "--size", "8x4", "--json")
    result = json.loads(out)
    assert code == 0
    assert result.pop("seconds").keys() == {"load", "render"}
    assert result == {
        "scene": "model.glb",
        "device": "fake device",
        "size": [8, 4],
        "frames": 16,
        "timings": {"gbuffer": 1.5},
        "files": [str(tmp_path / "out.png")],
    }


def test_path_traced_counts_samples(run, calls, tmp_path):
    out = run(
        "render", "m.glb", "-o", tmp_path / "o.png", "--size", "8x4", "--path-traced", "--samples", "5", "--json"
    )[1]
    assert json.loads(out)["samples"] == 5 and "frames" not in json.loads(out)
    assert calls[0].samples == 5


@pytest.mark.parametrize("kind", [[], ["--path-traced"]])
def test_settings_reach_the_renderer(run, calls, tmp_path, kind):
    more = ["--preset", "raster", "--set", "post.exposure=2", "--device", "x", *kind]
    run("render", "m.glb", "-o", tmp_path / "o.png", *more)
    assert calls[0].settings.visibility.primary == "raster"
    assert calls[0].settings.post.exposure == 2.0
    assert calls[0].device == "x"


def test_cameras(run, calls, tmp_path):
    run("render", "m.glb", "-o", tmp_path / "o.png", "--camera", "side")
    run("render", "m.glb", "-o", tmp_path / "o.png", "--eye", "-1,2,3", "--target", "0,0,0", "--fov", "30")
    assert calls[0].camera.name == "side"
    assert np.allclose(calls[1].camera.transform[:3, 3], (-1, 2, 3))
    assert math.isclose(calls[1].camera.vertical_fov, math.radians(30))


def test_aovs_beside_a_png(run, calls, tmp_path):
    run("render", "m.glb", "-o", tmp_path / "o.png", "--size", "8x4", "--aov", "normal", "--aov", "depth")
    assert {file.name for file in tmp_path.iterdir()} == {"o.png", "o.normal.png", "o.depth.png"}


def test_aovs_in_an_exr(run, calls, tmp_path):
    run("render", "m.glb", "-o", tmp_path / "all.exr", "--size", "8x4")
    run("render", "m.glb", "-o", tmp_path / "some.exr", "--size", "8x4", "--aov", "depth")
    everything = {"R", "G", "B", "depth.Z", "normal.X", "normal.Y", "normal.Z"}
    assert pictures.read_exr_channels(tmp_path / "all.exr").keys() == everything
    assert pictures.read_exr_channels(tmp_path / "some.exr").keys() == {"R", "G", "B", "depth.Z"}


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--size", "0x10"], "width and height must be 1 to 16384"),
        (["--size", "wide"], "not WIDTHxHEIGHT"),
        (["--size", "10x-4"], "not WIDTHxHEIGHT"),
        (["--size", "99999x4"], "width and height must be 1 to 16384"),
        (["--preset", "best"], "preset 'best'"),
        (["--set", "shadows.mode"], "not group.name=value"),
        (["--set", "shadows.tint=red"], "setting 'shadows.tint' does not exist"),
        (["--set", "shadows.max_lights=99"], "99 is outside 1 to 29"),
        (["--camera", "top"], "no camera 'top' in the scene; there are 'side'"),
        (["--camera", "side", "--fov", "30"], "--camera takes no"),
        (["--eye", "1,2,3"], "--eye and --target go together"),
        (["--eye", "1,2", "--target", "0,0,0"], "--eye '1,2' is not three numbers"),
        (["--eye", "nan,2,3", "--target", "0,0,0"], "is not three numbers"),
        (["--eye", "1,2,3", "--target", "0,0,0", "--fov", "180"], "field of view 180.0"),
        (["--samples", "4"], "--samples is for --path-traced"),
        (["--aov", "nonsense"], "no AOV 'nonsense' in this frame; there are depth, normal"),
        (["--device", "nothing"], "no device named 'nothing'"),
        (["-o", "out.jpg"], "must end in .png or .exr"),
        (["-o", "nowhere/out.png"], "there is no folder nowhere"),
    ],
)
def test_bad_input_is_one_line_and_no_file(run, calls, tmp_path, arguments, says):
    code, out, err = run("render", "m.glb", "-o", tmp_path / "o.png", *arguments)
    said = [line for line in err.splitlines() if line.startswith("pica:")]
    assert (code, out, len(said)) == (2, "", 1)
    assert says in said[0]
    assert not list(tmp_path.iterdir())

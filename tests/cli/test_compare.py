import json

import pytest
from PIL import Image

import pica


def test_json_has_the_schema(run, calls, tmp_path):
    code, out, _ = run(
        "compare", "m.glb", "--size", "8x4", "--frames", "3", "--samples", "5", "--max-depth", "2", "--json"
    )
    result = json.loads(out)
    assert code == 0
    assert result == {
        "device": "fake device",
        "size": [8, 4],
        "frames": 3,
        "samples": 5,
        "whole": {"flip": 0.0, "psnr": 120.0, "relmse": 0.0},
    }
    assert [call.max_depth for call in calls] == [None, 2]


def test_against_other_settings(run, calls, tmp_path):
    first = ["--preset", "low", "--set", "shadows.mode=hard"]
    more = ["--size", "8x4", "--frames", "3", "--json", "-o", tmp_path / "sheet.png"]
    others = ["--against", "preset=high", "--against", "reflections.mode=off"]
    code, out, err = run("compare", "m.glb", *first, *others, *more)
    assert code == 0, err
    result = json.loads(out)
    assert result["against"] == ["preset=high", "reflections.mode=off"] and "samples" not in result
    assert result["whole"] == {"flip": 0.0, "psnr": 120.0, "relmse": 0.0}
    low, high = calls
    hard = {"shadows.mode": "hard"}
    assert low.settings == pica.Settings.preset("low").with_values(hard)
    assert high.settings == pica.Settings.preset("high").with_values({**hard, "reflections.mode": "off"})
    assert (low.frames, high.frames) == (3, 3) and high.camera is low.camera and high.scene is low.scene
    assert (tmp_path / "sheet.png").exists()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--against", "high"], "--against 'high' is neither preset=name nor group.name=value"),
        (["--against", "preset=best"], "preset 'best' is not one of"),
        (["--against", "shadows.tint=1"], "setting 'shadows.tint' does not exist"),
        (["--against", "preset=high", "--samples", "4"], "--against takes no --effect"),
        (["--against", "preset=high", "--effect", "shadows"], "--against takes no --effect"),
    ],
)
def test_what_nothing_is_compared_against(run, calls, arguments, says):
    code, out, err = run("compare", "m.glb", "--size", "8x4", *arguments)
    assert (code, out, err.count("\n")) == (2, "", 1) and says in err


def test_the_sheet_holds_three_pictures(run, calls, tmp_path):
    code, out, _ = run("compare", "m.glb", "--size", "64x32", "-o", tmp_path / "sheet.png")
    assert code == 0
    assert "flip" in out
    width, height = Image.open(tmp_path / "sheet.png").size
    assert width > 3 * 64 and height > 32


def test_the_sheet_must_be_a_png(run, calls, tmp_path):
    code, _, err = run("compare", "m.glb", "-o", tmp_path / "sheet.exr")
    assert code == 2
    assert "must end in .png" in err


def test_the_reference_has_the_settings_and_the_device_of_the_picture(run, calls):
    run("compare", "m.glb", "--size", "8x4", "--set", "shadows.transparent=false", "--device", "x")
    hybrid, traced = calls
    assert hybrid.settings.shadows.transparent is False
    assert traced.settings == hybrid.settings
    assert (hybrid.device, traced.device) == ("x", "opened x")
    assert traced.scene is hybrid.scene


def test_nothing_is_rendered_where_the_path_tracer_cannot(run, calls, monkeypatch):
    def refuse(*_, **__):
        raise pica.errors.DeviceError("path tracing: nothing traces rays")

    monkeypatch.setitem(vars(pica), "PathTracer", refuse)
    code, out, err = run("compare", "m.glb", "--size", "8x4")
    assert code == 2 and out == ""
    assert "pica: path tracing: nothing traces rays" in err
    assert calls == []

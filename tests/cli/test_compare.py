import json

import numpy as np
import pytest
from PIL import Image

import pica
from pica.cli import compare
from pica.quality.sequences import SEQUENCES


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


def test_the_last_frame_of_a_sequence_is_compared_where_the_camera_is_then(run, calls):
    more = ["--size", "8x4", "--frames", "3", "--samples", "5", "--json"]
    code, out, err = run("compare", "m.glb", "--sequence", "orbit", "--speed", "30", *more)
    assert code == 0, err
    result = json.loads(out)
    assert (result["sequence"], result["speed"], result["speed_unit"]) == ("orbit", 30.0, "degrees a frame")
    assert result["whole"]["flip"] == 0.0
    *moving, traced = calls
    assert [call.frames for call in moving] == [1, 1, 1] and traced.samples == 5
    for call, degrees in zip(calls, (0, 30, 60, 60), strict=True):
        eye = np.cos(np.radians(degrees)), 0, -np.sin(np.radians(degrees))
        np.testing.assert_allclose(call.camera.transform[:3, 3], eye, atol=1e-9)


def test_both_pictures_of_other_settings_follow_the_sequence(run, calls):
    more = ["--size", "8x4", "--frames", "2", "--against", "preset=cinematic", "--json"]
    code, out, err = run("compare", "m.glb", "--sequence", "turn", *more)
    assert code == 0, err
    assert json.loads(out)["sequence"] == "turn"
    first, second = calls[1].camera.transform, calls[3].camera.transform
    assert len(calls) == 4 and np.allclose(first, second) and not np.allclose(first, calls[0].camera.transform)


def test_the_sequences_of_the_help_are_those_that_there_are():
    assert tuple(SEQUENCES) == compare._SEQUENCES


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--sequence", "dance"], "sequence 'dance' is not one of still, orbit, turn"),
        (["--sequence", "still", "--speed", "1"], "the sequence still has no speed"),
        (["--sequence", "orbit", "--speed", "nan"], "speed nan of the sequence orbit: must be above 0"),
        (["--speed", "1"], "--speed is for --sequence"),
        (["--sequence", "light"], "the scene has no light"),
    ],
)
def test_wrong_sequences_and_speeds(run, calls, arguments, says):
    code, out, err = run("compare", "m.glb", "--size", "8x4", *arguments)
    assert (code, out, err.count("\n")) == (2, "", 1) and says in err
    assert calls == []


def test_against_other_settings(run, calls, tmp_path):
    first = ["--preset", "balanced", "--set", "shadows.mode=hard"]
    more = ["--size", "8x4", "--frames", "3", "--json", "-o", tmp_path / "sheet.png"]
    others = ["--against", "preset=cinematic", "--against", "reflections.mode=off"]
    code, out, err = run("compare", "m.glb", *first, *others, *more)
    assert code == 0, err
    result = json.loads(out)
    assert result["against"] == ["preset=cinematic", "reflections.mode=off"] and "samples" not in result
    assert result["whole"] == {"flip": 0.0, "psnr": 120.0, "relmse": 0.0}
    balanced, cinematic = calls
    hard = {"shadows.mode": "hard"}
    assert balanced.settings == pica.Settings.preset("balanced").with_values(hard)
    assert cinematic.settings == pica.Settings.preset("cinematic").with_values({**hard, "reflections.mode": "off"})
    assert (balanced.frames, cinematic.frames) == (3, 3)
    assert cinematic.camera is balanced.camera and cinematic.scene is balanced.scene
    assert (tmp_path / "sheet.png").exists()


def test_both_pictures_have_the_light_map(run, calls, monkeypatch, tmp_path):
    monkeypatch.setattr(pica.LightMap, "load", lambda path: "baked")
    code, _, err = run(
        "compare", "m.glb", "--size", "8x4", "--light-map", tmp_path / "room.npz", "--against", "preset=raster"
    )
    assert code == 0, err
    assert [call.light_map for call in calls] == ["baked", "baked"]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--against", "high"], "--against 'high' is neither preset=name nor group.name=value"),
        (["--against", "preset=best"], "preset 'best' is not one of"),
        (["--against", "shadows.tint=1"], "setting 'shadows.tint' does not exist"),
        (["--against", "preset=cinematic", "--samples", "4"], "--against takes no --effect"),
        (["--against", "preset=cinematic", "--effect", "shadows"], "--against takes no --effect"),
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

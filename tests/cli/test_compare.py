import json

from PIL import Image


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

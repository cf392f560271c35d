"""`pica compare --effect`."""

import json

import numpy as np
import pytest

from pica.quality import effects


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--effect", "shadows", "--sequence", "dance"], "'dance' is not one of still"),
        (["--effect", "shadows", "--speed", "2"], "--speed is for --sequence"),
        (["--effect", "shadows", "--sequence", "turn", "--speed", "-2"], "above 0 and at most 90 degrees a frame"),
        (["--effect", "shadows", "--max-depth", "2"], "--max-depth"),
    ],
)
def test_what_does_not_go_together(run, arguments, says):
    code, _, err = run("compare", "cornell", *arguments)
    assert code == 2 and says in err and err.count("\n") == 1


@pytest.mark.device
def test_a_scene_that_has_nothing_of_the_effect_says_so(run):
    code, out, err = run("compare", "cornell", "--effect", "shadows", "--size", "16x16", "--frames", "1")
    assert (code, out) == (2, "")
    assert err.startswith("pica: compare --effect shadows: has nothing to compare here") and err.count("\n") == 1


@pytest.mark.device
def test_json_of_an_effect(run, tmp_path):
    size = ["--size", "32x32", "--frames", "2", "--samples", "4"]
    eight = ["--set", "shadows.max_lights=8"]
    output = tmp_path / "sheet.png"
    code, out, _ = run("compare", "machine_world", "--effect", "shadows", *size, "--json", "-o", output, *eight)
    result = json.loads(out)
    assert code == 0 and output.exists()
    assert result["effect"] == "shadows" and result["sequence"] == "still"
    assert len(result["psnr_by_frame"]) == 2 and len(result["change_by_frame"]) == 1
    assert len(result["layers"]) == 5 and any(name.startswith("sun ") for name in result["layers"])


def test_an_effect_is_looked_at_through_the_camera_that_is_asked_for(run, calls, monkeypatch):
    cameras = []

    def compare_effect(renderer, effect, motion, frames, samples, progress):
        cameras.append(motion(0))
        grey = {"open": np.zeros((4, 8), np.float32)}
        return effects.EffectErrors([1.0], {"open": [1.0]}, newest=(grey, grey))

    monkeypatch.setattr(effects, "compare_effect", compare_effect)
    for view in (["--camera", "side"], ["--eye", "1,2,3", "--target", "0,0,0"]):
        code, _, err = run("compare", "m.glb", "--size", "8x4", "--effect", "ambient_occlusion", *view)
        assert code == 0, err
    assert cameras[0].name == "side" and np.allclose(cameras[1].transform[:3, 3], (1, 2, 3))

"""`pica compare --effect`."""

import json

import pytest


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--effect", "sparkle"], "'sparkle' is not one of shadows"),
        (["--effect", "shadows", "--sequence", "dance"], "'dance' is not one of still"),
        (["--sequence", "still"], "--sequence is for --effect"),
        (["--effect", "shadows", "--max-depth", "2"], "--max-depth"),
    ],
)
def test_what_does_not_go_together(run, arguments, says):
    code, _, err = run("compare", "cornell", *arguments)
    assert code == 2 and says in err and err.count("\n") == 1


def test_json_of_an_effect(run, tmp_path):
    size = ["--size", "32x32", "--frames", "2", "--samples", "4"]
    output = tmp_path / "sheet.png"
    code, out, _ = run("compare", "machine_world", "--effect", "shadows", *size, "--json", "-o", output)
    result = json.loads(out)
    assert code == 0 and output.exists()
    assert result["effect"] == "shadows" and result["sequence"] == "still"
    assert len(result["psnr_by_frame"]) == 2 and len(result["change_by_frame"]) == 1
    assert len(result["layers"]) == 5 and any(name.startswith("sun ") for name in result["layers"])

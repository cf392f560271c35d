import json
import math
import os

import numpy as np
import pytest
from PIL import Image

from pica.images import pictures


def test_writes_the_picture_and_says_so(run, calls, tmp_path):
    code, out, _ = run("render", "model.glb", "-o", tmp_path / "out.png", "--size", "8x4", "--frames", "3")
    assert code == 0
    assert "8x4, 3 frames" in out and "fake device" in out
    assert Image.open(tmp_path / "out.png").size == (8, 4)
    assert (calls[0].size, calls[0].frames, calls[0].camera.name) == ((8, 4), 3, "side")


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
        "denoised": False,
        "timings": {"gbuffer": 1.5},
        "files": [str(tmp_path / "out.png")],
    }


def test_path_traced_counts_samples(run, calls, tmp_path):
    out = run(
        "render", "m.glb", "-o", tmp_path / "o.png", "--size", "8x4", "--path-traced", "--samples", "5", "--json"
    )[1]
    assert json.loads(out)["samples"] == 5 and "frames" not in json.loads(out)
    assert calls[0].samples == 5


@pytest.mark.parametrize(("given", "devices"), [([], None), (["--devices", "0,card"], ["#0", "card"])])
@pytest.mark.parametrize("way", [[], ["--path-traced"]])
def test_devices_share_frames_and_samples(run, calls, tmp_path, given, devices, way):
    run("render", "m.glb", "-o", tmp_path / "o.png", "--size", "8x4", *way, *given)
    assert calls[0].devices == devices


@pytest.fixture
def installed(monkeypatch):
    """Open Image Denoise, or so the command believes."""
    monkeypatch.setattr("pica.denoising.open_image_denoise.check_installed", lambda: None)


@pytest.mark.parametrize("kind", [[], ["--path-traced"]])
def test_denoised(run, calls, installed, tmp_path, kind):
    more = ["m.glb", "-o", tmp_path / "o.png", "--size", "8x4", *kind]
    out = run("render", *more, "--denoise", "--json")[1]
    assert json.loads(out)["denoised"] is True and calls[0].denoise is True
    assert ", denoised, " in run("render", *more, "--denoise")[1]
    assert ", denoised, " not in run("render", *more)[1] and calls[2].denoise is False


def test_without_open_image_denoise_nothing_is_rendered(run, calls, monkeypatch, tmp_path):
    monkeypatch.setattr("pica.denoising.open_image_denoise.find_spec", lambda _: None)
    code, out, err = run("render", "m.glb", "-o", tmp_path / "o.png", "--denoise")
    assert (code, out, len(err.splitlines())) == (2, "", 1)
    assert err.startswith("pica: ") and 'pip install "pica[denoise]"' in err
    assert not calls and not list(tmp_path.iterdir())


def test_denoised_fast(run, calls, installed, tmp_path):
    arguments = ["render", "m.glb", "-o", tmp_path / "o.png", "--size", "8x4", "--denoise-fast"]
    assert json.loads(run(*arguments, "--json")[1])["denoised"] == "fast" and calls[0].denoise == "fast"
    code, _, err = run(*arguments, "--denoise")
    assert code == 2 and "--denoise and --denoise-fast" in err and len(calls) == 1


@pytest.mark.parametrize("kind", [[], ["--path-traced"]])
def test_settings_reach_the_renderer(run, calls, tmp_path, kind):
    more = ["--preset", "raster", "--set", "post.exposure=2", "--device", "x", *kind]
    run("render", "m.glb", "-o", tmp_path / "o.png", *more)
    assert calls[0].settings.visibility.primary == "raster"
    assert calls[0].settings.post.exposure == 2.0
    assert calls[0].device == "x"


@pytest.mark.parametrize(("ev", "white"), [("0", 1.2), ("15", 39321.6), ("-2.5", 0.2121)])
def test_exposed_by_hand(run, calls, tmp_path, ev, white):
    code, _, err = run("render", "m.glb", "-o", tmp_path / "o.png", "--ev", ev, "--set", "shadows.mode=hard")
    assert code == 0, err
    post = calls[0].settings.post
    assert not post.auto_exposure and math.isclose(2**-post.exposure, white, rel_tol=1e-3)


def test_transparent(run, calls, tmp_path):
    code, _, err = run("render", "m.glb", "-o", tmp_path / "o.png", "--size", "8x4", "--transparent")
    assert code == 0, err
    assert calls[0].settings.visibility.background == "transparent"


def test_cameras(run, calls, tmp_path):
    run("render", "m.glb", "-o", tmp_path / "o.png", "--camera", "side")
    run("render", "m.glb", "-o", tmp_path / "o.png", "--eye", "-1,2,3", "--target", "0,0,0", "--fov", "30")
    assert calls[0].camera.name == "side"
    assert np.allclose(calls[1].camera.transform[:3, 3], (-1, 2, 3))
    assert math.isclose(calls[1].camera.vertical_fov, math.radians(30))


def test_a_lens_focuses_on_what_the_camera_looks_at(run, calls, tmp_path):
    at = "--eye", "-1,2,2", "--target", "0,0,0"
    run("render", "m.glb", "-o", tmp_path / "o.png", *at, "--f-number", "2.8")
    run("render", "m.glb", "-o", tmp_path / "o.png", *at, "--f-number", "2.8", "--focus-distance", "5")
    run("render", "m.glb", "-o", tmp_path / "o.png", "--f-number", "2.8", "--focus-distance", "5")
    assert [call.camera.f_number for call in calls] == [2.8] * 3
    assert math.isclose(calls[0].camera.focus_distance, 3)
    assert [call.camera.focus_distance for call in calls[1:]] == [5, 5]


def test_aovs_beside_a_png(run, calls, tmp_path):
    run("render", "m.glb", "-o", tmp_path / "o.png", "--size", "8x4", "--aov", "normal", "--aov", "depth")
    assert {file.name for file in tmp_path.iterdir()} == {"o.png", "o.normal.png", "o.depth.png"}


def test_aovs_in_an_exr(run, calls, tmp_path):
    run("render", "m.glb", "-o", tmp_path / "all.exr", "--size", "8x4")
    run("render", "m.glb", "-o", tmp_path / "some.exr", "--size", "8x4", "--aov", "depth")
    everything = {"R", "G", "B", "depth.Z", "normal.X", "normal.Y", "normal.Z"}
    assert pictures.read_exr(tmp_path / "all.exr").keys() == everything
    assert pictures.read_exr(tmp_path / "some.exr").keys() == {"R", "G", "B", "depth.Z"}


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--size", "0x10"], "width and height must be 1 to 16384"),
        (["--size", "wide"], "not WIDTHxHEIGHT"),
        (["--size", "10x-4"], "not WIDTHxHEIGHT"),
        (["--size", "99999x4"], "width and height must be 1 to 16384"),
        (["--size", "9" * 5000 + "x1"], "is not WIDTHxHEIGHT"),
        (["--size", "٣x٤"], "not WIDTHxHEIGHT"),
        (["--size", ""], "--size '' is not WIDTHxHEIGHT"),
        (["--animation", "9" * 5000], "no animation"),
        (["--animation", "-1"], "no animation '-1'"),
        (["--lut", "none.cube"], "none.cube: no such file"),
        (["--focus-distance", "2"], "--focus-distance needs --f-number"),
        (["--f-number", "0"], "f_number: 0.0 is not above 0"),
        (["--preset", "best"], "preset 'best'"),
        (["--preset", "qualty"], "pica_pica, ue4_reflections, ue4_speed_of_light; did you mean 'quality'?"),
        (["--set", "shadow.mode=hard"], "setting 'shadow.mode' does not exist; did you mean 'shadows.mode'"),
        (["--aov", "nromal"], "no AOV 'nromal' in this frame; there are depth, normal; did you mean 'normal'?"),
        (["--path-traced", "--frames", "4"], "--frames is for the hybrid renderer; with --path-traced, use --samples"),
        (["--set", "shadows.mode"], "not group.name=value"),
        (["--set", ""], "--set '' is not group.name=value"),
        (["--set", "="], "setting '' does not exist"),
        (["--set", "seed=-1"], "setting seed: -1 is outside 0 to"),
        (["--set", "seed=" + "9" * 5000], "is not a whole number"),
        (["--set", "x" * 1_000_000], "is not group.name=value"),
        (["--set", "post.exposure=1e999"], "setting post.exposure: inf is outside"),
        (["--set", "\x1b[31m=\n"], "setting '\\x1b[31m' does not exist"),
        (["--preset", "\udcff\n"], "preset '\\udcff\\n' is not one of"),
        (["--set", "shadows.tint=red"], "setting 'shadows.tint' does not exist"),
        (["--set", "shadows.max_lights=99"], "99 is outside 0 to 29"),
        (["--camera", "top"], "no camera 'top' in the scene; there are 'side'"),
        (["--camera", "side", "--fov", "30"], "--camera takes no"),
        (["--eye", "1,2,3"], "--eye and --target go together"),
        (["--eye", "1,2", "--target", "0,0,0"], "--eye '1,2' is not three numbers"),
        (["--eye", "nan,2,3", "--target", "0,0,0"], "is not three numbers"),
        (["--eye", "1e10,2,3", "--target", "0,0,0"], "is not three numbers"),
        (["--eye", "", "--target", ""], "--eye '' is not three numbers"),
        (["--eye", "0,0,0", "--target", "0,0,0"], "eye and target are the same point (0.0, 0.0, 0.0)"),
        (["--eye", "1,2,3", "--target", "0,0,0", "--fov", "180"], "--fov 180 is not between 0 and 180 degrees"),
        (["--ev", "3", "--set", "post.exposure=1"], "--ev and --set post.exposure both say how to expose"),
        (["--ev", "100"], "'--ev': Input should be less than or equal to 29"),
        (["--ev", "nan"], "'--ev': "),
        (["--samples", "4"], "--samples is for --path-traced"),
        (["--aov", "nonsense"], "no AOV 'nonsense' in this frame; there are depth, normal"),
        (["--device", "nothing"], "no device named 'nothing'"),
        (["--devices", "0,1", "--device", "x"], "--devices takes no --device and no --cluster beside it"),
        (["-o", "out.jpg"], "must end in .png or .exr"),
        (["-o", "nowhere/out.png"], "there is no folder nowhere"),
        (["-o", ""], "must end in .png or .exr"),
        (["-o", "x" * 252 + ".png"], ".png: cannot be written (File name too long)"),
        (["-o", "a/" * 3000 + "o.png"], "File name too long"),
        (["-o", "/proc/out.png"], "/proc/out.png: cannot be written ("),
        (["-o", "/dev/full"], "cannot write /dev/full: the name must end in"),
        (["--aov", "../x"], "no AOV '../x'"),
    ],
)
def test_bad_input_is_one_line_and_no_file(run, calls, tmp_path, arguments, says):
    code, out, err = run("render", "m.glb", "-o", tmp_path / "o.png", *arguments)
    assert (code, out) == (2, "")
    assert err.startswith("pica: ") and says in err and err[:-1].isprintable() and len(err) < 1100
    assert not list(tmp_path.iterdir())


def test_what_path_tracing_does_not_read_is_a_warning(run, calls, tmp_path):
    given = ["--set", "shadows.mode=hard", "--set", "post.exposure=1", "--set", "seed=2", "--set", "lighting=high"]
    more = ["m.glb", "-o", tmp_path / "o.png", "--size", "8x4", *given]
    code, _, err = run("render", *more, "--path-traced")
    says = "--path-traced: --set shadows.mode, --set lighting changes nothing, as path tracing does not read it"
    assert code == 0 and err.startswith(f"pica: warning: {says}\n")
    assert "warning" not in run("render", *more)[2]
    assert "--preset balanced changes nothing" in run("render", *more[:5], "--preset", "balanced", "--path-traced")[2]
    assert run("render", *more[:5], "--set", "shadows.transparent=false", "--path-traced")[2].count("warning") == 0
    assert "--set post.shutter changes" in run("render", *more[:5], "--set", "post.shutter=1", "--path-traced")[2]


def test_other_settings_of_the_display_go_with_exposure_by_hand(run, calls, tmp_path):
    assert run("render", "m.glb", "-o", tmp_path / "o.png", "--ev", "3", "--set", "post.bloom=0.1")[0] == 0
    assert calls[0].settings.post.bloom == 0.1 and not calls[0].settings.post.auto_exposure


@pytest.mark.parametrize("kind", ["folder", "pipe", "device"])
def test_what_no_picture_can_replace_is_told_before_anything_is_rendered(run, calls, tmp_path, kind):
    output = tmp_path / "o.png"
    if kind == "folder":
        output.mkdir()
    elif kind == "pipe":
        os.mkfifo(output)
    else:
        output.symlink_to("/dev/full")
    code, out, err = run("render", "m.glb", "-o", output, "--size", "8x4")
    assert (code, out, calls) == (2, "", [])
    assert err == f"pica: cannot write {output}: it is a {'folder' if kind == 'folder' else 'device or a pipe'}\n"


def test_what_a_killed_run_left_goes_though_the_next_one_fails(run, calls, tmp_path):
    (tmp_path / ".o.pica-01234567.png").write_text("half")
    assert run("render", "m.glb", "-o", tmp_path / "o.png", "--device", "nothing")[0] == 2
    assert not list(tmp_path.iterdir())


def test_names_of_files_do_nothing_to_the_terminal(run, calls, tmp_path):
    output = tmp_path / "a\x1b[31m\n\udcff.png"
    code, out, _ = run("render", "m.glb", "-o", output, "--size", "8x4")
    assert code == 0 and output.exists()
    assert out.startswith(f"{tmp_path}/a\\x1b[31m\\n\\udcff.png: 8x4, ") and out[:-1].isprintable()
    assert json.loads(run("render", "m.glb", "-o", output, "--size", "8x4", "--json")[1])["files"] == [str(output)]


def test_a_folder_does_not_hide_a_built_in_scene(run, calls, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cornell").mkdir()
    assert run("render", "cornell", "-o", "o.png", "--size", "8x4")[0] == 0
    assert calls[0].scene.name != "fake"
    assert run("render", "", "-o", "o.png")[2].startswith("pica: no file and no built-in scene ''")

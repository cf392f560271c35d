"""What is shown: the same arguments for every command that renders."""

import math
from dataclasses import fields

import numpy as np
import PIL.Image
import pytest
from typer.main import get_command

import pica
from pica.cli.app import app
from pica.cli.subject import LIMITS
from pica.scene.animation import Animation, Channel, Pose
from pica.scene.camera import Camera
from pica.scene.environment import Environment
from pica.scene.model import Node

COMMANDS = ("render", "compare", "bench")


@pytest.fixture
def show(run, tmp_path):
    """Run a command on a model with more arguments: (exit code, stderr)."""

    def call(command, *arguments):
        output = ["-o", tmp_path / "out.png"] if command == "render" else []
        code, _, err = run(command, "m.glb", "--size", "8x4", *output, *arguments)
        return code, err

    return call


@pytest.fixture
def loaded(calls, monkeypatch):
    """The environments asked for; every scene has a camera "eye" that goes from x = 0 to 1 m in 1 s ("go")."""
    environments = []

    def load(path, environment=None, **_):
        environments.append(environment)
        scene = pica.Scene()
        node = scene.add(Node("eye", camera=Camera(np.eye(4), name="eye"), pose=Pose()))
        go = Channel(node, "translation", np.array([0.0, 1.0]), np.array([[0.0, 0, 0], [1.0, 0, 0]]))
        wait = Channel(node, "translation", np.array([0.0, 0.5]), np.zeros((2, 3)))
        scene.animations = [Animation([wait], "wait"), Animation([go], "go")]
        return scene

    monkeypatch.setitem(vars(pica), "load", load)
    return environments


@pytest.mark.parametrize("command", COMMANDS[1:])
def test_every_command_takes_what_render_takes(command):
    def described(name):
        return {each.name: (each.opts, each.help, each.default) for each in get_command(app).commands[name].params}

    shown = ("scene", "env", "camera", "eye", "target", "fov", "start", "animation", "preset", "values", "device")
    assert {name: described(command).get(name) for name in shown} == {name: described("render")[name] for name in shown}


@pytest.mark.parametrize("command", COMMANDS)
def test_cameras(show, calls, command):
    assert show(command, "--camera", "side")[0] == 0
    assert calls and all(call.camera.name == "side" for call in calls)
    calls.clear()
    assert show(command, "--eye", "-1,2,3", "--target", "0,0,0", "--fov", "30")[0] == 0
    for call in calls:
        assert np.allclose(call.camera.transform[:3, 3], (-1, 2, 3))
        assert math.isclose(call.camera.vertical_fov, math.radians(30))


@pytest.mark.parametrize("command", COMMANDS)
def test_environment_moment_and_device(show, calls, loaded, command, tmp_path):
    sky = tmp_path / "sky.hdr"
    code, err = show(command, "--env", sky, "--camera", "eye", "--animation", "go", "--start", "0.25", "--device", "x")
    assert code == 0, err
    assert loaded == [sky]
    assert calls[0].device == "x"
    assert all(call.camera.transform[0, 3] == 0.25 for call in calls)


@pytest.mark.parametrize("command", COMMANDS)
def test_without_a_moment_the_scene_is_as_its_file_has_it(show, calls, loaded, command, monkeypatch):
    monkeypatch.setattr(pica.Scene, "animate", lambda *_: pytest.fail("animated"))
    assert show(command, "--camera", "eye")[0] == 0


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--camera", "top"], "no camera 'top' in the scene; there are 'eye'"),
        (["--camera", "eye", "--fov", "30"], "--camera takes no"),
        (["--eye", "1,2,3"], "--eye and --target go together"),
        (["--animation", "jump"], "no animation 'jump'; the scene has 0 'wait', 1 'go'"),
        (["--start", "nan"], "nan is not a number of seconds"),
        (["--device", "nothing"], "no device named 'nothing'"),
    ],
)
def test_bad_input_is_one_line(show, loaded, command, arguments, says):
    code, err = show(command, *arguments)
    assert code == 2 and says in err and err.count("\n") == 1


@pytest.mark.parametrize("command", COMMANDS)
def test_what_loading_may_take_and_read(show, calls, command, monkeypatch):
    asked = []

    def load(path, environment=None, **given):
        asked.append(given)
        return pica.Scene()

    monkeypatch.setitem(vars(pica), "load", load)
    assert show(command)[0] == 0
    code, err = show(command, "--allow-outside", "--variant", "Red", "--limit", "bytes=2e9", "--limit", "pixels = inf")
    assert code == 0, err
    assert asked[0] == {"allow_outside": False, "limits": pica.Limits(), "up": None, "variant": None}
    limits = pica.Limits(bytes=2e9, pixels=math.inf)
    assert asked[-1] == {"allow_outside": True, "limits": limits, "up": None, "variant": "Red"}
    assert show(command, "--up", "z")[0] == 0
    assert asked[-1]["up"] == "z"


@pytest.mark.parametrize("command", COMMANDS)
def test_the_environment_is_made_stronger_and_turned(show, calls, command, monkeypatch):
    sky = Environment(np.ones((2, 4, 3), np.float32), strength=3.0)
    monkeypatch.setitem(vars(pica), "load", lambda path, environment=None, **_: pica.Scene(environment=sky))
    code, err = show(command, "--env-strength", "0.5", "--env-rotation", "-90")
    assert code == 0, err
    turned = calls[0].scene.environment
    assert (turned.strength, turned.rotation) == (0.5, pytest.approx(-math.pi / 2))
    assert turned.radiance is sky.radiance
    assert show(command, "--env-rotation", "10")[0] == 0 and calls[-1].scene.environment.strength == 3


@pytest.mark.parametrize("option", ["--env-strength", "--env-rotation"])
def test_an_environment_that_is_not_there_is_not_changed(show, loaded, option):
    code, err = show("render", option, "2")
    assert (code, err.count("\n")) == (2, 1) and "m.glb has no environment; give --env too" in err


def test_strengths_that_no_environment_has(run, tmp_path):
    for value in ("-1", "nan", "inf"):
        code, _, err = run("render", "sphere_grid", "-o", tmp_path / "o.png", f"--env-strength={value}")
        assert code == 2 and "strength: " in err and err.count("\n") == 1


@pytest.mark.parametrize("command", COMMANDS)
def test_a_sky_with_a_sun(show, calls, command, monkeypatch):
    monkeypatch.setitem(vars(pica), "load", lambda path, environment=None, **_: pica.Scene(environment=environment))
    code, err = show(command, "--sun", "-3,90")
    assert code == 0, err
    scene = calls[-1].scene
    assert scene.environment.radiance.shape == (128, 256, 3) and [node.name for node in scene.nodes()] == ["sun"]
    code, err = show(command, "--sun", "20,90", "--env-strength", "2")
    assert code == 2 and "--sun takes no --env" in err and err.count("\n") == 1
    code, err = show(command, "--sun", "noon")
    assert code == 2 and "neither ELEVATION,AZIMUTH nor TIME" in err and err.count("\n") == 1


def test_up_is_an_axis_and_for_files(run, tmp_path):
    code, _, err = run("render", "cornell", "-o", tmp_path / "o.png", "--up", "z")
    assert code == 2 and "--up z: is for files" in err
    code, _, err = run("render", "m.glb", "-o", tmp_path / "o.png", "--up", "x")
    assert code == 2 and "'x' is not one of y, z" in err


@pytest.mark.parametrize("limit", ["bytes", "bytes=", "bytes=many", "byte=3", "=3", "bytes=nan", "bytes=-1"])
def test_limits_that_are_none(show, limit):
    code, err = show("render", "--limit", limit)
    assert code == 2 and err.count("\n") == 1
    assert "limit" in err and ("name=number" in err or "there are bytes, vertices" in err or "at least 0" in err)


def test_every_limit_has_its_name():
    assert tuple(field.name for field in fields(pica.Limits)) == LIMITS


@pytest.mark.parametrize("command", COMMANDS)
def test_the_background_is_a_colour_in_srgb_or_the_environment(show, calls, loaded, command):
    assert show(command, "--camera", "eye", "--background", "#bc00ff")[0] == 0
    assert calls[-1].scene.background == pytest.approx((0.5028, 0, 1), abs=1e-3)
    assert show(command, "--camera", "eye", "--background", "environment")[0] == 0
    assert calls[-1].scene.background is None
    code, err = show(command, "--camera", "eye", "--background", "red")
    assert (code, err.count("\n")) == (2, 1) and "--background 'red' is neither a colour such as '#404048' nor" in err


def test_the_background_may_be_another_picture_and_blurred(show, calls, loaded, tmp_path):
    sky = tmp_path / "sky.png"
    PIL.Image.fromarray(np.full((2, 4, 3), 255, np.uint8)).save(sky)
    view = ("render", "--camera", "eye")
    assert show(*view, "--background", sky, "--background-blur", "10")[0] == 0
    shown = calls[-1].scene.background
    assert shown.name == "sky" and shown.radiance == pytest.approx(1.0)
    for wrong in (("--background", "#ffffff"), ("--background", sky, "--background-blur", "-1")):
        code, err = show(*view, "--background-blur", "10", *wrong)
        assert (code, err.count("\n")) == (2, 1) and "--background-blur" in err
    code, err = show(*view, "--background", tmp_path / "missing.hdr")
    assert (code, err.count("\n")) == (2, 1) and "missing.hdr" in err

"""What is shown: the same arguments for every command that renders."""

import math
from dataclasses import fields

import numpy as np
import pytest
from typer.main import get_command

import pica
from pica.cli.app import app
from pica.cli.view import LIMITS
from pica.scene.animation import Animation, Channel, Pose
from pica.scene.camera import Camera
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
    code, err = show(command, "--allow-outside", "--limit", "bytes=2e9", "--limit", "pixels = inf")
    assert code == 0, err
    assert asked[0] == {"allow_outside": False, "limits": pica.Limits()}
    assert asked[-1] == {"allow_outside": True, "limits": pica.Limits(bytes=2e9, pixels=math.inf)}


@pytest.mark.parametrize("limit", ["bytes", "bytes=", "bytes=many", "byte=3", "=3", "bytes=nan", "bytes=-1"])
def test_limits_that_are_none(show, limit):
    code, err = show("render", "--limit", limit)
    assert code == 2 and err.count("\n") == 1
    assert "limit" in err and ("name=number" in err or "there are bytes, vertices" in err or "at least 0" in err)


def test_every_limit_has_its_name():
    assert tuple(field.name for field in fields(pica.Limits)) == LIMITS

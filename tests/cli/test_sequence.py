"""Sequences. Most run on a renderer that answers at once and paints where the box is."""

import json
import math
from types import SimpleNamespace

import av
import numpy as np
import pytest
from PIL import Image

import pica
from pica.scene.animation import Animation, Channel, Pose
from pica.scene.camera import Camera
from pica.scene.material import Material
from pica.scene.model import Mesh, Node
from pica.scenes.basic_meshes import box
from tests.assets import ASSETS, needs_assets
from tests.cli.conftest import fake_frame

SMALL = ("--size", "8x4", "--fps", "10")


class Painter:
    """Stands for Renderer and PathTracer: the level of its pictures is where the box is, 0 to 1."""

    device_name = "fake device"
    calls: list[SimpleNamespace] = []  # noqa: RUF012
    restarts: list[int] = []  # noqa: RUF012
    stop_at: float | None = None

    def __init__(self, scene, size, settings=None, device=None, light_map=None, lut=None):
        self.scene, self.size = scene, size

    def reset(self, frame=0):
        Painter.restarts.append(frame)

    def render(self, count, camera=None, progress=None, denoise=False, aovs=None, seconds=None):
        x = next(node.world[0, 3] for node in self.scene.nodes() if node.name == "box")
        if Painter.stop_at is not None and x >= Painter.stop_at:
            raise KeyboardInterrupt
        camera = camera or self.scene.default_camera(2.0)
        Painter.calls.append(
            SimpleNamespace(kind=type(self).__name__, x=round(float(x), 6), count=count, camera=camera, denoise=denoise)
        )
        return fake_frame(*self.size, level=x)


class PathPainter(Painter):
    pass


@pytest.fixture
def scene(monkeypatch):
    """A box that goes from x = 0 to 1 m in 1 s ("go"), and waits at 0 ("wait"); scenes are loaded as this one."""

    def load(path, environment=None, **_):
        scene = pica.Scene("moving")
        moving = scene.add(Node("box", mesh=Mesh([box((0.2, 0.2, 0.2), Material())]), pose=Pose()))
        go = Channel(moving, "translation", np.array([0.0, 1.0]), np.array([[0.0, 0, 0], [1.0, 0, 0]]))
        wait = Channel(moving, "translation", np.array([0.0, 0.5]), np.zeros((2, 3)))
        scene.animations = [Animation([wait], "wait"), Animation([go], "go")]
        if path == "still.glb":
            scene.animations = []
        if path == "filmed.glb":
            moving.add(Node("eye", camera=Camera(np.eye(4), name="eye")))
        return scene

    monkeypatch.setitem(vars(pica), "load", load)
    monkeypatch.setitem(vars(pica), "Renderer", Painter)
    monkeypatch.setitem(vars(pica), "PathTracer", PathPainter)
    monkeypatch.setattr(Painter, "calls", [])
    monkeypatch.setattr(Painter, "restarts", [])
    monkeypatch.setattr(Painter, "stop_at", None)
    return Painter


def places(painter):
    return [(call.x, call.count) for call in painter.calls]


def names(folder):
    return sorted(file.name for file in folder.iterdir())


def levels(film):
    with av.open(film) as container:
        return [round(frame.to_ndarray(format="rgb24").mean() / 255, 1) for frame in container.decode(video=0)]


def test_numbered_pictures_at_their_times(run, scene, tmp_path):
    code, out, _ = run(
        "render", "m.glb", "-o", tmp_path / "new" / "%03d.exr", *SMALL, "--seconds", "0.4", "--start", "0.2"
    )
    assert code == 0
    assert "4 of 4 pictures rendered, 8x4, 16 frames" in out
    assert names(tmp_path / "new") == ["000.exr", "001.exr", "002.exr", "003.exr"]
    assert places(scene) == [(0.2, 16), (0.3, 16), (0.4, 16), (0.5, 16)]


def test_a_film_leaves_nothing_beside_it(run, scene, tmp_path):
    code, out, _ = run("render", "m.glb", "-o", tmp_path / "out.mp4", *SMALL, "--seconds", "0.5", "--json")
    result = json.loads(out)
    assert code == 0
    assert result.pop("seconds").keys() == {"load", "render"}
    assert result == {
        "scene": "m.glb",
        "device": "fake device",
        "size": [8, 4],
        "frames": 16,
        "denoised": False,
        "fps": 10.0,
        "start": 0.0,
        "pictures": 5,
        "rendered": 5,
        "timings": {"gbuffer": 1.5},
        "files": [str(tmp_path / "out.mp4")],
    }
    assert names(tmp_path) == ["out.mp4"]
    assert levels(tmp_path / "out.mp4") == [0.0, 0.1, 0.2, 0.3, 0.4]


def test_without_seconds_until_the_animation_ends(run, scene, tmp_path):
    run("render", "m.glb", "-o", tmp_path / "%d.png", *SMALL, "--start", "0.7")
    run("render", "m.glb", "-o", tmp_path / "%d.png", *SMALL, "--animation", "0")
    assert places(scene) == [(0.7, 16), (0.8, 16), (0.9, 16), *[(0.0, 16)] * 5]


@pytest.mark.parametrize(("name", "x"), [("go", 0.25), ("1", 0.25), ("wait", 0.0), ("0", 0.0)])
def test_animations_by_name_or_number_and_one_picture_at_a_time(run, scene, tmp_path, name, x):
    code, _, err = run("render", "m.glb", "-o", tmp_path / "o.png", "--animation", name, "--start", "0.25")
    assert code == 0, err
    assert places(scene) == [(x, 16)]


def test_path_traced(run, scene, tmp_path):
    more = ["--seconds", "0.2", "--path-traced", "--samples", "7"]
    run("render", "m.glb", "-o", tmp_path / "%d.png", *SMALL, *more)
    assert [(call.kind, call.x, call.count) for call in scene.calls] == [
        ("PathPainter", 0.0, 7),
        ("PathPainter", 0.1, 7),
    ]


def test_pictures_are_denoised_but_not_those_for_the_history(run, scene, monkeypatch, tmp_path):
    monkeypatch.setattr("pica.denoising.open_image_denoise.check_installed", lambda: None)
    arguments = ["render", "m.glb", "-o", tmp_path / "%d.png", *SMALL, "--seconds", "0.3", "--denoise"]
    run(*arguments)
    (tmp_path / "2.png").unlink()
    run(*arguments, "--resume")
    assert [(call.count, call.denoise) for call in scene.calls] == [*[(16, True)] * 3, *[(16, False)] * 2, (16, True)]


def test_buffers_beside_each_picture(run, scene, tmp_path):
    run("render", "m.glb", "-o", tmp_path / "%d.png", *SMALL, "--seconds", "0.2", "--aov", "normal")
    assert names(tmp_path) == ["0.normal.png", "0.png", "1.normal.png", "1.png"]


def test_a_camera_without_a_place_shows_all_the_movement_and_stands_still(run, scene, tmp_path):
    run("render", "m.glb", "-o", tmp_path / "%d.png", *SMALL, "--seconds", "1")
    first, *others = [call.camera for call in scene.calls]
    assert all(camera is first for camera in others)
    for x in (0.0, 0.9):
        right, up, back, _ = np.linalg.inv(first.transform) @ (x, 0, 0, 1)
        edge = -back * math.tan(first.vertical_fov / 2)
        assert abs(up) < edge and abs(right) < 2 * edge


def test_a_camera_that_is_animated_moves(run, scene, tmp_path):
    for more in ([], ["--camera", "eye"]):
        scene.calls.clear()
        run("render", "filmed.glb", "-o", tmp_path / "%d.png", *SMALL, "--seconds", "0.3", *more)
        assert [round(call.camera.transform[0, 3], 6) for call in scene.calls] == [0.0, 0.1, 0.2]


def test_resume_renders_what_is_missing_with_a_warm_history(run, scene, tmp_path):
    arguments = ["render", "m.glb", "-o", tmp_path / "%d.png", *SMALL, "--seconds", "0.7"]
    run(*arguments)
    kept = (tmp_path / "3.png").stat().st_mtime_ns
    for number in (0, 2, 5, 6):
        (tmp_path / f"{number}.png").unlink()
    scene.calls.clear()
    assert "4 of 7 pictures rendered" in run(*arguments, "--resume")[1]
    assert places(scene) == [(x, 16) for x in (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)]
    assert names(tmp_path) == [f"{number}.png" for number in range(7)]
    assert (tmp_path / "3.png").stat().st_mtime_ns == kept
    assert [round(np.array(Image.open(tmp_path / f"{n}.png")).mean() / 255, 1) for n in (2, 3)] == [0.2, 0.3]


@pytest.mark.parametrize(
    ("more", "places_before", "restarts"),
    [
        (["--frames", "80"], [(0.3, 80), (0.4, 80)], [0, 3 * 80]),
        (["--frames", "40"], [(x, 40) for x in (0.1, 0.2, 0.3, 0.4)], [0, 40]),
        (["--path-traced"], [(0.4, 1)], []),
    ],
)
def test_how_a_history_is_made_warm(run, scene, tmp_path, more, places_before, restarts):
    """By 160 frames, which have the numbers that they have in a film from its start."""
    arguments = ["render", "m.glb", "-o", tmp_path / "%d.png", *SMALL, "--seconds", "0.7", *more]
    run(*arguments)
    (tmp_path / "5.png").unlink()
    scene.calls.clear()
    run(*arguments, "--resume")
    assert places(scene)[:-1] == places_before and scene.restarts == restarts


@pytest.mark.parametrize(("kind", "more"), [("png", ["--aov", "normal"]), ("exr", [])])
def test_resume_finds_every_picture_that_is_broken(run, scene, tmp_path, kind, more):
    arguments = ["render", "m.glb", "-o", tmp_path / f"%d.{kind}", *SMALL, "--seconds", "0.6", *more]
    run(*arguments)
    whole = {name: (tmp_path / name).read_bytes() for name in names(tmp_path)}
    kept = (tmp_path / f"0.{kind}").stat().st_mtime_ns
    (tmp_path / f"1.{kind}").write_bytes(b"")
    (tmp_path / f"2.{kind}").write_bytes(whole[f"2.{kind}"][:-20])
    (tmp_path / f"4.{kind}").write_text("something else")
    if kind == "png":
        (tmp_path / "3.normal.png").write_bytes(b"")
    code, out, err = run(*arguments, "--resume")
    assert code == 0, err
    assert f"{4 if kind == 'png' else 3} of 6 pictures rendered" in out
    assert {name: (tmp_path / name).read_bytes() for name in names(tmp_path)} == whole
    assert (tmp_path / f"0.{kind}").stat().st_mtime_ns == kept


def test_a_film_cut_short_is_resumed(run, scene, tmp_path, monkeypatch):
    arguments = ["render", "m.glb", "-o", tmp_path / "out.mp4", *SMALL, "--seconds", "0.6"]
    monkeypatch.setattr(Painter, "stop_at", 0.35)
    code = run(*arguments)[0]
    assert (code, names(tmp_path)) == (130, ["out.mp4.frames"])
    assert len(names(tmp_path / "out.mp4.frames")) == 4
    monkeypatch.setattr(Painter, "stop_at", None)
    scene.calls.clear()
    assert run(*arguments, "--resume")[0] == 0
    assert places(scene) == [(x, 16) for x in (0.0, 0.1, 0.2, 0.3, 0.4, 0.5)]  # the first four for the history
    assert levels(tmp_path / "out.mp4") == [0.0, 0.1, 0.2, 0.3, 0.4, 0.5]
    assert names(tmp_path) == ["out.mp4"]


def test_a_film_that_is_whole_is_left_alone_unless_another_length_is_asked(run, scene, tmp_path):
    arguments = ["render", "m.glb", "-o", tmp_path / "out.mp4", *SMALL]
    run(*arguments, "--seconds", "0.3")
    scene.calls.clear()
    assert "0 of 3 pictures rendered" in run(*arguments, "--seconds", "0.3", "--resume")[1]
    assert names(tmp_path) == ["out.mp4"] and not scene.calls
    (tmp_path / "out.mp4").write_bytes(b"")
    run(*arguments, "--seconds", "0.4", "--resume")
    assert levels(tmp_path / "out.mp4") == [0.0, 0.1, 0.2, 0.3]


def test_a_new_run_cut_short_does_not_mix_with_an_old_one(run, scene, tmp_path, monkeypatch):
    arguments = ["render", "m.glb", "-o", tmp_path / "%d.png", *SMALL, "--seconds", "0.5"]
    run(*arguments)
    monkeypatch.setattr(Painter, "stop_at", 0.15)
    run(*arguments)
    assert names(tmp_path) == ["0.png", "1.png"]


def test_nothing_moves_is_a_warning(run, scene, tmp_path):
    code, _, err = run("render", "still.glb", "-o", tmp_path / "%d.png", *SMALL, "--seconds", "0.2")
    assert (code, names(tmp_path)) == (0, ["0.png", "1.png"])
    assert "the scene has no animation, so nothing moves" in err


def heights_and_angles(painter):
    """Of the cameras, about the box at x = 0."""
    eyes = [call.camera.transform[:3, 3] for call in painter.calls]
    return [eye[1] for eye in eyes], np.unwrap([math.atan2(eye[0], eye[2]) for eye in eyes])


def test_a_turntable_goes_once_round_a_still_scene(run, scene, tmp_path):
    code, _, err = run("render", "still.glb", "-o", tmp_path / "%d.png", *SMALL, "--turntable", "--fps", "2")
    assert code == 0 and "nothing moves" not in err
    assert len(scene.calls) == 16 == len(names(tmp_path))
    heights, angles = heights_and_angles(scene)
    assert np.allclose(heights, heights[0]) and np.allclose(np.diff(angles), 2 * math.pi / 16)
    for call in scene.calls:
        view, slope = np.linalg.inv(call.camera.transform), math.tan(call.camera.vertical_fov / 2)
        for corner in np.array(list(np.ndindex(2, 2, 2))) * 0.2 - 0.1:
            right, up, back, _ = view @ (*corner, 1)
            assert abs(up) < -back * slope and abs(right) < -back * slope * 2


def test_a_turntable_turns_about_the_target_while_an_animation_plays(run, scene, tmp_path):
    view = ["--eye", "5,2,3", "--target", "5,1,0"]
    code, _, err = run("render", "m.glb", "-o", tmp_path / "%d.png", *SMALL, "--turntable", *view)
    assert code == 0, err
    assert [call.x for call in scene.calls] == [n / 10 for n in range(10)]
    eyes = np.array([call.camera.transform[:3, 3] for call in scene.calls])
    assert np.allclose(np.linalg.norm(eyes - (5, 1, 0), axis=1), math.sqrt(10)) and np.allclose(eyes[:, 1], 2)
    assert np.allclose(eyes[5], (5, 2, -3))


def test_a_camera_follows_the_path_of_a_file(run, scene, tmp_path):
    path = tmp_path / "path.json"
    keys = [(0, (0, 1, 4)), (0.5, (2, 1, 4)), (1.0, (4, 1, 4))]
    path.write_text(json.dumps([{"time": t, "eye": eye, "target": (0, 0, 0), "fov": 20 + 20 * t} for t, eye in keys]))
    code, _, err = run("render", "still.glb", "-o", tmp_path / "%d.png", *SMALL, "--camera-path", path)
    assert code == 0, err
    cameras = [call.camera for call in scene.calls]
    assert np.allclose([camera.transform[:3, 3] for camera in cameras], [(0.4 * n, 1, 4) for n in range(10)])
    assert np.allclose([math.degrees(camera.vertical_fov) for camera in cameras], 20 + 2 * np.arange(10))
    assert all(np.allclose(camera.transform[:3, 2], _unit(camera.transform[:3, 3])) for camera in cameras)


def _unit(vector):
    return vector / np.linalg.norm(vector)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("[", "is no JSON"),
        ("\udcff", "is no JSON"),
        ("{}", "is not a list such as"),
        ("[]", "is not a list such as"),
        ("[1]", "is not a list such as"),
        ('[{"time": 0}]', "[0].eye: None"),
        ('[{"time": "x"}]', "[0].time: 'x' is not a number"),
        ('[{"time": 0, "eye": [0, 0], "target": [0, 0, 0]}]', "[0].eye: [0, 0] is not 3 numbers"),
        ('[{"time": 0, "eye": [0, 0, 0], "target": [0, 0, 0]}]', "[0]: camera '': eye and target are the same"),
        ('[{"time": 0, "eye": [0, 0, 1], "target": [0, 0, 0], "fov": 180}]', "[0].fov: 180"),
        ('[{"time": 0, "eye": [0, 0, 1], "target": [0, 0, 0], "up": 3}]', "[0]: 'up' is none of"),
        ('[{"time": 1, "eye": [0, 0, 1], "target": [0, 0, 0]}, {"time": 1}]', "[1].time: 1 is not after"),
    ],
)
def test_paths_of_cameras_that_are_none(run, scene, tmp_path, content, says):
    path = tmp_path / "path.json"
    path.write_bytes(content.encode("utf-8", "surrogateescape"))
    code, _, err = run("render", "still.glb", "-o", tmp_path / "%d.png", *SMALL, "--camera-path", path)
    assert (code, err.count("\n")) == (2, 1) and err.startswith(f"pica: {path}: ") and says in err


@pytest.mark.parametrize(
    ("output", "arguments", "says"),
    [
        ("o.png", ["--seconds", "1"], "and --resume are for out.mp4 or pictures such as"),
        ("o.png", ["--fps", "30"], "--seconds, --fps, --turntable, --camera-path, --cluster and --resume are for"),
        ("o.png", ["--resume"], "--seconds, --fps, --turntable, --camera-path, --cluster and --resume are for"),
        ("o.png", ["--turntable"], "--seconds, --fps, --turntable, --camera-path, --cluster and --resume are for"),
        ("o.mp4", ["--turntable", "--camera-path", "x.json"], "--camera-path takes no --turntable"),
        ("o.mp4", ["--fov", "30", "--camera-path", "x.json"], "--camera-path takes no --turntable"),
        ("o.mp4", ["--camera-path", "nowhere.json"], "nowhere.json: no such file"),
        ("o.mp4", ["--fps", "0"], "--fps 0: must be 0.001 to 1000"),
        ("o.mp4", ["--fps", "0.0001"], "--fps 0.0001: must be"),
        ("o.mp4", ["--fps", "1e-300"], "--fps 1e-300: must be"),
        ("o.mp4", ["--fps", "inf"], "--fps inf: must be"),
        ("o.mp4", ["--fps", "-5"], "--fps -5: must be"),
        ("o.mp4", ["--fps", "nan"], "--fps nan: must be"),
        ("o.mp4", ["--seconds", "0"], "--seconds 0: must be above 0"),
        ("o.mp4", ["--seconds", "inf"], "--seconds inf: must be"),
        ("o.mp4", ["--seconds", "1e300"], "over 1000000 pictures"),
        ("o.mp4", ["--start", "1"], "--seconds is needed"),
        ("o.mp4", ["--start", "nan"], "nan is not a number of seconds"),
        ("o.mp4", ["--start", "1e30", "--seconds", "1"], "--start 1e+30: must be -1e+09 to 1e+09 seconds"),
        ("o.mp4", ["--start=-inf", "--seconds", "1"], "--start -inf: must be"),
        ("o.mp4", ["--animation", "jump"], "no animation 'jump'; the scene has 0 'wait', 1 'go'"),
        ("o.mp4", ["--animation", "2"], "no animation 2"),
        ("o.mp4", ["--size", "9x4"], "a film needs an even width and height, not 9x4"),
        ("o.mp4", ["--aov", "normal"], "a film holds no buffers"),
        ("o.mp4", ["--transparent"], "a film holds no alpha"),
        ("nowhere/o.mp4", [], "there is no folder"),
        ("%d.jpg", [], "must end in .png, .exr or .mp4"),
        ("%d%d.png", [], "needs one %d"),
        ("%0999999999d.png", [], "at most %099d"),
        ("%0" + "9" * 200 + "d.png", [], "at most %099d"),
        ("new/%d.png", ["--aov", "nonsense"], "no AOV 'nonsense'"),
        ("%d.png", ["--aov", "nonsense"], "no AOV 'nonsense'"),
        ("%d.png", ["--camera", "top"], "no camera 'top'"),
    ],
)
def test_bad_input_is_one_line_and_no_file(run, scene, tmp_path, output, arguments, says):
    code, out, err = run("render", "m.glb", "-o", tmp_path / output, "--size", "8x4", *arguments)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("pica: ") and says in err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("arguments", [[], ["--resume"]])
def test_the_next_run_takes_over_what_one_killed_before_its_first_picture_left(run, scene, tmp_path, arguments):
    (tmp_path / "out.mp4.frames").mkdir()
    (tmp_path / "out.mp4.frames" / ".000000.pica-01234567.png").write_text("half")
    (tmp_path / ".out.pica-01234567.mp4").write_text("half")
    code, _, err = run("render", "m.glb", "-o", tmp_path / "out.mp4", *SMALL, "--seconds", "0.3", *arguments)
    assert code == 0, err
    assert names(tmp_path) == ["out.mp4"]


def test_an_empty_folder_of_a_killed_run_does_not_make_a_whole_film_anew(run, scene, tmp_path):
    arguments = ["render", "m.glb", "-o", tmp_path / "out.mp4", *SMALL, "--seconds", "0.3"]
    run(*arguments)
    (tmp_path / "out.mp4.frames").mkdir()
    assert "0 of 3 pictures rendered" in run(*arguments, "--resume")[1]
    assert names(tmp_path) == ["out.mp4"]


@pytest.mark.parametrize("output", ["out.mp4", "new/%d.png"])
def test_a_run_cut_short_before_its_first_picture_leaves_nothing(run, scene, tmp_path, monkeypatch, output):
    monkeypatch.setattr(Painter, "stop_at", 0.0)
    assert run("render", "m.glb", "-o", tmp_path / output, *SMALL) == (130, "", "")
    assert names(tmp_path) == []


def test_a_folder_that_was_there_stays(run, scene, tmp_path, monkeypatch):
    monkeypatch.setattr(Painter, "stop_at", 0.0)
    (tmp_path / "new").mkdir()
    run("render", "m.glb", "-o", tmp_path / "new" / "%d.png", *SMALL)
    assert names(tmp_path) == ["new"]


def test_resuming_in_another_size_is_refused(run, scene, tmp_path):
    arguments = ["render", "m.glb", "-o", tmp_path / "%d.png", "--fps", "10", "--seconds", "0.2"]
    run(*arguments, "--size", "8x4")
    (tmp_path / "0.png").unlink()
    code, _, err = run(*arguments, "--size", "10x4", "--resume")
    assert code == 2 and "1.png is 8x4, not 10x4" in err


def test_a_folder_that_is_a_file(run, scene, tmp_path):
    (tmp_path / "frames").write_text("")
    code, _, err = run("render", "m.glb", "-o", tmp_path / "frames" / "%d.png", *SMALL)
    assert code == 2 and f"pica: {tmp_path / 'frames'}: " in err


@pytest.mark.device
@needs_assets
def test_box_animated_on_the_device(run, tmp_path):
    box = ASSETS / "BoxAnimated" / "BoxAnimated.gltf"
    more = ["--size", "32x18", "--frames", "2", "--fps", "2", "--seconds", "2"]
    code, _, err = run("render", box, "-o", tmp_path / "out.mp4", *more)
    assert code == 0, err
    with av.open(tmp_path / "out.mp4") as film:
        assert float(film.streams.video[0].average_rate) == 2
        pictures = [frame.to_ndarray(format="rgb24").astype(int) for frame in film.decode(video=0)]
    assert np.shape(pictures) == (4, 18, 32, 3)
    assert (np.abs(np.diff(pictures, axis=0)).max((1, 2, 3)) > 20).all()

"""pica demo: directed films. Most run on a renderer that answers at once."""

import json

import av
import numpy as np
import pytest

import pica
from pica.cli.demo_sheet import stored_reference
from pica.images.pictures import read_image
from pica.rhi.device import Device
from pica.scenes.demos import DEMOS
from pica.scenes.motion import LOOP
from tests.cli.conftest import fake_frame


class Camera:
    """Stands for Renderer: what it was asked."""

    device_name = "fake device"
    made: list["Camera"] = []  # noqa: RUF012

    def __init__(self, scene, size, settings, device):
        self.scene, self.size, self.settings, self.shots = scene, size, settings, []
        Camera.made.append(self)

    def render(self, frames, camera, aovs, seconds, cut=False):
        moved = np.array([node.world for node in self.scene.nodes()])
        if cut:
            self.before = moved
            return None  # it is not in the film
        begins = hasattr(self, "before")
        if begins:  # objects move by the time between pictures, not by that between shots
            assert np.abs(moved - vars(self).pop("before"))[..., 3].max() < 1.5
        self.shots.append((camera.transform[:3, 3].copy(), begins, frames, seconds))
        return fake_frame(*self.size, level=0.2 + 0.6 * begins)


@pytest.fixture
def made(monkeypatch):
    monkeypatch.setitem(vars(pica), "Renderer", Camera)
    monkeypatch.setattr(Camera, "made", [])
    return Camera.made


def test_without_a_name_it_lists_them(run):
    code, out, _ = run("demo")
    assert code == 0 and [line.split()[0] for line in out.splitlines()] == ["machine_world", "showroom", "corridor"]
    assert json.loads(run("demo", "--json")[1])["corridor"]["seconds"] == DEMOS["corridor"].seconds


@pytest.mark.device
@pytest.mark.parametrize("name", DEMOS)
def test_each_film_has_all_its_shots_with_cuts_between(run, made, tmp_path, name):
    film = tmp_path / "out.mp4"
    code, out, err = run("demo", name, "-o", film, "--size", "8x4", "--fps", "10", "--seconds", "4", "--json")
    assert code == 0, err
    (renderer,) = made
    cuts = [number for number, (_, cut, _, _) in enumerate(renderer.shots) if cut]
    assert len(cuts) == len(DEMOS[name].shots) and cuts[0] == 0
    assert len(renderer.shots) == pytest.approx(40, abs=2) == json.loads(out)["pictures"]
    places = np.array([eye for eye, *_ in renderer.shots])
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    assert np.delete(steps, np.array(cuts[1:]) - 1).max() < 0.2 < steps[np.array(cuts[1:]) - 1].min()
    assert {tuple(rest) for _, _, *rest in renderer.shots} == {(1, 0.1)}
    assert renderer.settings.antialiasing.first_samples == 8
    with av.open(film) as container:
        levels = [frame.to_ndarray(format="rgb24").mean() / 255 for frame in container.decode(video=0)]
    assert [number for number, level in enumerate(levels) if level > 0.5] == cuts


@pytest.mark.parametrize("name", DEMOS)
def test_shots_are_within_the_loop_and_cameras_within_the_scene(name):
    demo = DEMOS[name]
    assert 15 < demo.seconds <= LOOP and len(demo.shots) >= 3
    assert all(shot.start >= 0 and shot.start + shot.seconds <= LOOP for shot in demo.shots)
    whole = demo.pictures(30, demo.seconds)
    assert len(whole) == round(demo.seconds * 30) == len(demo.pictures(30, 1e9))
    low, high = demo.make().bounds()
    for picture in whole:
        eye = picture.camera.transform[:3, 3]
        assert (eye[[0, 2]] > low[[0, 2]]).all() and (eye[[0, 2]] < high[[0, 2]]).all() and 0.3 < eye[1] < 7


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["showrom", "-o", "o.mp4"], "no demo 'showrom'; there are machine_world, showroom, corridor"),
        (["showroom"], "pica demo showroom needs a film to write, such as -o showroom.mp4"),
        (["showroom", "-o", "o.png"], "needs a film to write"),
        (["showroom", "-o", "o.mp4", "--seconds", "0"], "--seconds 0: must be above 0"),
        (["showroom", "-o", "o.mp4", "--size", "9x4"], "a film needs an even width"),
        (["showroom", "-o", "o.mp4", "--preset", "best"], "best"),
    ],
)
def test_bad_input_is_one_line_and_no_file(run, tmp_path, monkeypatch, arguments, says):
    monkeypatch.chdir(tmp_path)
    code, out, err = run("demo", *arguments)
    assert (code, out, err.count("\n")) == (2, "", 1) and says in err
    assert not list(tmp_path.iterdir())


def test_a_film_with_motion_blur_on_the_device(run, tmp_path, device: Device):
    film = tmp_path / "out.mp4"
    more = ["--size", "64x36", "--fps", "4", "--seconds", "2", "--preset", "raster", "--set", "post.shutter=0.5"]
    code, _, err = run("demo", "machine_world", "-o", film, *more, "--device", device.name)
    assert code == 0, err
    with av.open(film) as container:
        pictures = [frame.to_ndarray(format="rgb24").astype(float) for frame in container.decode(video=0)]
    assert len(pictures) == 8 and min(picture.std() for picture in pictures) > 10
    assert np.abs(np.diff(pictures, axis=0)).mean((1, 2, 3)).min() > 0.5


@pytest.mark.parametrize("arguments", [[], ["-o", "o.png", "showroom"], ["-o", "o.png", "--preset", "raster"]])
def test_the_sheet_takes_a_file_and_nothing_of_films(run, tmp_path, monkeypatch, arguments):
    monkeypatch.chdir(tmp_path)
    code, _, err = run("demo", "--sheet", *arguments)
    assert code == 2 and "pica demo --sheet takes -o FILE.png" in err and not list(tmp_path.iterdir())


def blocks(picture):
    """(9, 16, 3) means, which have little noise."""
    height, width = picture.shape[0] // 9, picture.shape[1] // 16
    return picture.reshape(9, height, 16, width, 3).mean((1, 3))


def test_the_sheet_s_stored_reference_is_of_today_s_scene(device: Device):
    reference = stored_reference()
    assert reference.shape == (180, 320, 3)
    picture = pica.PathTracer(pica.scenes.machine_world(), size=(64, 36), device=device).render(32, aovs=())
    today = blocks(picture.display / np.float32(255))
    assert np.abs(today - blocks(reference)).mean() < 0.02
    assert np.abs(today - blocks(np.roll(reference, 10, axis=1))).mean() > 0.02  # half a metre aside


def test_the_sheet(run, tmp_path, monkeypatch, device: Device):
    monkeypatch.setattr("pica.cli.demo_sheet.FRAMES", 2)
    code, out, err = run("demo", "--sheet", "-o", tmp_path / "demo.png", "--device", device.name, "--json")
    assert code == 0, err
    found = json.loads(out)
    assert found["hybrid"]["flip"] < found["raster"]["flip"] < found["path traced"]["flip"]
    assert found["hybrid"]["frames"] == 2 and found["path traced"]["samples"] == 1
    assert all(found[way][f"{unit}_ms"] > 0 for way, unit in (("raster", "frame"), ("path traced", "sample")))
    picture = read_image(tmp_path / "demo.png", "demo.png")
    assert picture.shape[:2] == (440, 664)

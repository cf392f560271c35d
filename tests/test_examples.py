"""The programs and the notebook that one would copy run, at a tiny size."""

import json
import runpy
import sys
from pathlib import Path

import numpy as np
import PIL.Image
import pytest

import pica
from pica.images.films import describe
from tests.assets import ASSETS, needs_assets

ROOT = Path(__file__).parent.parent
EXAMPLES = ROOT / "examples"
NOTEBOOK = EXAMPLES / "first_steps.ipynb"


@pytest.fixture
def run(device, monkeypatch, tmp_path):
    """Run an example in an empty folder, in this process, whose device it finds open."""

    def called(name, *arguments):
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(sys, "argv", [name, *arguments])
        runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")
        return tmp_path

    return called


def read(path):
    return np.asarray(PIL.Image.open(path))


def test_all_examples_are_listed_and_tested():
    listed = (EXAMPLES / "README.md").read_text()
    for path in EXAMPLES.glob("*.*"):
        assert path == EXAMPLES / "README.md" or f"]({path.name})" in listed, path.name
        assert path.suffix != ".py" or f'run("{path.stem}"' in Path(__file__).read_text(), path.name


@needs_assets
@pytest.mark.filterwarnings("ignore:.*neutral sky")
def test_a_turntable(run):
    short = "--size", "32x18", "--seconds", "0.16", "--frames", "1"
    folder = run("turntable", str(ASSETS / "Fox" / "Fox.glb"), "film.mp4", *short)
    assert describe(folder / "film.mp4") == (4, 32, 18)


def test_a_scene_from_arrays(run):
    picture = read(run("scene_from_arrays", "island.png", "--size", "64x36", "--frames", "2") / "island.png")
    assert picture.shape == (36, 64, 3)
    below, above = picture[24:].astype(int), picture[:4].astype(int)
    assert (below[..., 1] > below[..., 2]).mean() > 0.5 and (above[..., 2] > above[..., 1]).all()  # grass and sky


def test_a_labelled_data_set(run):
    folder = run("labelled_data_set", "set", "--views", "2", "--size", "64x36", "--frames", "1") / "set"
    described = json.loads((folder / "data_set.json").read_text())
    assert len(described["views"]) == 2 and described["size"] == [64, 36]
    for number, view in enumerate(described["views"]):
        ids, depth = read(folder / f"{number:04}.ids.png"), pica.read_exr(folder / f"{number:04}.depth.exr")["depth.Z"]
        assert read(folder / f"{number:04}.png").shape == (36, 64, 3)
        np.testing.assert_array_equal(ids == 0, np.isinf(depth))
        assert {str(each) for each in np.unique(ids)} <= {"0", *described["nodes"]}
        camera = pica.Camera.from_intrinsics(*np.array(view["K"])[[0, 1, 0, 1], [0, 1, 2, 2]], (64, 36), view["pose"])
        np.testing.assert_allclose(camera.intrinsics((64, 36)), view["K"])
        belts = [int(key) for key, path in described["nodes"].items() if "long belt" in path or "cross belt" in path]
        np.testing.assert_array_equal(read(folder / f"{number:04}.belt.png") > 0, np.isin(ids, belts))
    assert read(folder / "0000.belt.png").any()


def test_a_training_set_with_random_colours_places_and_lights(run):
    arguments = "--batches", "2", "--views", "3", "--size", "64x48", "--frames", "1"
    folder = run("domain_randomization", "set", *arguments) / "set"
    described = json.loads((folder / "data_set.json").read_text())
    numbers = {name: int(number) for number, name in described["nodes"].items()}
    pictures = [read(folder / f"{number:04}.png") for number in range(6)]
    assert len(described["boxes"]) == 6 and len({picture.tobytes() for picture in pictures}) == 6
    seen = 0
    for number, boxes in enumerate(described["boxes"]):
        ids, channels = read(folder / f"{number:04}.ids.png"), ["red block", "green block", "blue block"]
        assert set(boxes) == {name for name in channels if (ids == numbers[name]).any()}
        for name, (left, top, width, height) in boxes.items():
            inside = np.zeros(ids.shape, bool)
            inside[top : top + height, left : left + width] = True
            assert not (ids[~inside] == numbers[name]).any()
            colors = pictures[number][ids == numbers[name]].astype(int)
            seen += colors.sum(axis=0).argmax() == channels.index(name)
    assert seen > 0.8 * sum(map(len, described["boxes"])) > 8  # lamps are coloured, but hardly


def test_depth_is_learned(run, capsys):
    pytest.importorskip("torch", reason="PyTorch is not installed")
    picture = read(
        run("train_depth", "--steps", "21", "--batch", "2", "--size", "32x24", "--output", "d.png") / "d.png"
    )
    assert picture.shape == (24, 96, 3)
    errors = [float(line.split()[-1]) for line in capsys.readouterr().out.splitlines()]
    assert len(errors) == 2 and all(0 < error < 1 for error in errors)


def test_a_material_of_one_s_own(run):
    folder = run("own_material", "wall.png", "--size", "64x36", "--frames", "1", "--preset", "raster")
    red = (lambda rgb: rgb[..., 0] / rgb.sum(axis=-1))(read(folder / "wall.png")[9:27, 16:48].astype(float))
    assert (red > 0.45).mean() > 0.3 and (red < 0.4).mean() > 0.05  # bricks and mortar


def test_an_effect_of_one_s_own(run):
    arguments = "--size", "96x54", "--frames", "2", "--preset", "raster"
    lined = read(run("outline", "outline.png", *arguments) / "outline.png").astype(float)
    with pica.Renderer(pica.scenes.machine_world(), size=(96, 54), settings=pica.Settings.preset("raster")) as renderer:
        plain = renderer.render(2)
    change = (lined - plain.display).mean(axis=-1)
    ids = plain.aov("instance")
    beside = np.zeros(ids.shape, bool)
    beside[:, :-1] |= ids[:, :-1] != ids[:, 1:]
    beside[:-1] |= ids[:-1] != ids[1:]
    assert change[beside].mean() < -25 < 0 < np.median(change[~beside])  # dark lines; exposure makes the rest lighter
    assert np.corrcoef(change.ravel(), beside.ravel())[0, 1] < -0.6


def test_two_settings_against_each_other(run, capsys):
    arguments = "--size", "32x18", "--frames", "1", "--samples", "2"
    assert read(run("compare_settings", "sheet.png", *arguments) / "sheet.png").shape[1] > 5 * 32
    assert capsys.readouterr().out.count("FLIP") == 2


def cells(kind):
    return [cell for cell in json.loads(NOTEBOOK.read_text())["cells"] if cell["cell_type"] == kind]


def test_the_notebook_is_one_without_outputs():
    notebook = json.loads(NOTEBOOK.read_text())
    assert (notebook["nbformat"], notebook["nbformat_minor"]) == (4, 5)
    assert all(not cell["outputs"] and cell["execution_count"] is None for cell in cells("code"))
    names = [cell["id"] for cell in notebook["cells"]]
    assert len(names) == len(set(names))


def test_the_notebook_runs(device, monkeypatch, tmp_path):
    pytest.importorskip("viser", reason="the extra pica[view] is not installed")
    monkeypatch.chdir(tmp_path)
    names = {}
    for cell in cells("code"):
        program = "".join(cell["source"])
        for whole, small in (("(640, 360)", "(32, 18)"), ("frames=16", "frames=1"), ("samples=64", "samples=1")):
            program = program.replace(whole, small)
        exec(program, names)
    assert names["scene"].triangle_count() and (tmp_path / "paint.png").exists()
    assert names["frame"]._repr_png_().startswith(b"\x89PNG")

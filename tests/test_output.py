import numpy as np
import pytest
from PIL import Image

from pica import pictures
from pica.errors import PicaError
from pica.output import Frame, preview

HEIGHT, WIDTH = 3, 5


@pytest.fixture
def arrays():
    random = np.random.default_rng(1)
    return {
        "color": random.random((HEIGHT, WIDTH, 3), np.float32) * 9,
        "display": random.integers(0, 256, (HEIGHT, WIDTH, 3), np.uint8),
        "depth": random.random((HEIGHT, WIDTH), np.float32),
        "normal": random.random((HEIGHT, WIDTH, 3), np.float32),
        "motion": random.random((HEIGHT, WIDTH, 2), np.float32),
        "albedo": random.random((HEIGHT, WIDTH, 4), np.float32),
        "instance": random.integers(0, 1000, (HEIGHT, WIDTH), np.uint32),
        "shadows": random.random((HEIGHT, WIDTH, 5), np.float32),
    }


@pytest.fixture
def fetched():
    return []


@pytest.fixture
def frame(arrays, fetched):
    def source(name):
        def fetch():
            fetched.append(name)
            return arrays[name]

        return fetch

    aovs = {name: source(name) for name in ("depth", "normal", "motion", "albedo", "instance", "shadows")}
    return Frame((WIDTH, HEIGHT), source("color"), source("display"), aovs, {"gbuffer": 0.5})


def test_arrays_are_fetched_when_asked_for_and_once(frame, arrays, fetched):
    assert fetched == []
    assert frame.color is frame.color is arrays["color"]
    assert frame.aov("depth") is frame.aov("depth")
    assert frame.color is arrays["color"]
    assert fetched == ["color", "depth"]
    assert frame.timings == {"gbuffer": 0.5}


def test_an_unknown_aov_lists_those_there_are(frame):
    with pytest.raises(PicaError, match=r"'color'.*depth, normal, motion, albedo, instance, shadows"):
        frame.aov("color")


def test_png_is_the_display_picture(frame, arrays, tmp_path):
    frame.save(tmp_path / "out.PNG")
    assert np.array_equal(np.asarray(Image.open(tmp_path / "out.PNG")), arrays["display"])


def test_exr_has_named_channels(frame, arrays, tmp_path):
    frame.save(str(tmp_path / "out.exr"))
    channels = pictures.read_exr(tmp_path / "out.exr")
    assert channels.keys() == {
        *("R", "G", "B", "depth.Z", "normal.X", "normal.Y", "normal.Z", "motion.X", "motion.Y", "instance"),
        *("albedo.R", "albedo.G", "albedo.B", "albedo.A"),
        *("shadows.0", "shadows.1", "shadows.2", "shadows.3", "shadows.4"),
    }
    assert np.array_equal(channels["G"], arrays["color"][..., 1])
    assert np.array_equal(channels["normal.Z"], arrays["normal"][..., 2])
    assert np.array_equal(channels["instance"], arrays["instance"])


def test_exr_with_chosen_aovs(frame, tmp_path, fetched):
    frame.save(tmp_path / "out.exr", aovs=["depth"])
    assert pictures.read_exr(tmp_path / "out.exr").keys() == {"R", "G", "B", "depth.Z"}
    assert fetched == ["color", "depth"]


@pytest.mark.parametrize("name", ["out.jpg", "out", "out.png.tmp"])
def test_other_suffixes_are_an_error(frame, tmp_path, name):
    with pytest.raises(PicaError, match=r"\.png or \.exr"):
        frame.save(tmp_path / name)
    with pytest.raises(PicaError, match=r"\.png"):
        frame.save_aov("depth", tmp_path / name)


def test_a_missing_folder_is_an_error(frame, tmp_path):
    with pytest.raises(PicaError, match="nowhere"):
        frame.save(tmp_path / "nowhere" / "out.png")


def test_previews_are_pictures(frame, arrays, tmp_path):
    for name in frame.aov_names:
        frame.save_aov(name, tmp_path / f"{name}.png")
        assert Image.open(tmp_path / f"{name}.png").size == (WIDTH, HEIGHT)


def test_what_previews_show():
    axis = np.array([[[0, 0, 1], [0, -1, 0]]], np.float32)
    assert preview("normal", axis).tolist() == [[[128, 128, 255], [128, 0, 128]]]
    ids = preview("instance", np.array([[0, 1, 2, 1]], np.uint32))[0].tolist()
    assert ids[1] == ids[3] and len(set(map(tuple, ids))) == 3
    depth = preview("depth", np.array([[2, 4, 0, np.inf]], np.float32))[0, :, 0].tolist()
    assert depth == [255, 128, 0, 0]
    motion = preview("motion", np.array([[[0, 0], [-4, 2]]], np.float32))
    assert motion.tolist() == [[[128, 128, 128], [0, 191, 128]]]
    assert (preview("motion", np.full((1, 1, 2), 1e-5, np.float32)) == 128).all()
    assert preview("albedo", np.full((1, 1, 3), 0.2140, np.float32)).tolist() == [[[127, 127, 127]]]
    assert preview("roughness", np.array([[0.5]], np.float32)).tolist() == [[[128, 128, 128]]]

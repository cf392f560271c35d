import base64
import io
import pickle
import re
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

import pica
from pica.errors import PicaError
from pica.images.output import Frame, preview

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
    channels = pica.read_exr(tmp_path / "out.exr")
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
    assert pica.read_exr(tmp_path / "out.exr").keys() == {"R", "G", "B", "depth.Z"}
    assert fetched == ["color", "depth"]


@pytest.mark.parametrize("name", ["out.jpg", "out", "out.png.tmp"])
def test_other_suffixes_are_an_error(frame, tmp_path, name):
    with pytest.raises(PicaError, match=r"\.png or \.exr"):
        frame.save(tmp_path / name)
    with pytest.raises(PicaError, match=r"\.png, \.exr or \.npy"):
        frame.save_aov("depth", tmp_path / name)
    with pytest.raises(PicaError, match=r"\.png, \.exr or \.npy"):
        pica.write_labels(tmp_path / name, np.zeros((2, 2), int))
    assert not list(tmp_path.iterdir())


def test_a_missing_folder_is_an_error(frame, tmp_path):
    with pytest.raises(PicaError, match="nowhere"):
        frame.save(tmp_path / "nowhere" / "out.png")


def test_previews_are_pictures(frame, arrays, tmp_path):
    for name in frame.aov_names:
        frame.save_aov(name, tmp_path / f"{name}.png")
        assert Image.open(tmp_path / f"{name}.png").size == (WIDTH, HEIGHT)


def test_ids_come_back_as_they_were(frame, arrays, tmp_path):
    for name in ("a.png", "a.PNG", "a.exr", "a.npy", "a.NPY"):
        frame.save_aov("instance", tmp_path / name, exact=True)
    grey = Image.open(tmp_path / "a.png")
    assert grey.mode == "I;16"
    for back in (grey, Image.open(tmp_path / "a.PNG")):
        np.testing.assert_array_equal(np.asarray(back), arrays["instance"])
    channels = pica.read_exr(tmp_path / "a.exr")
    assert channels.keys() == {"instance"} and channels["instance"].dtype == np.uint32
    np.testing.assert_array_equal(channels["instance"], arrays["instance"])
    for back in (np.load(tmp_path / "a.npy"), np.load(tmp_path / "a.NPY")):
        np.testing.assert_array_equal(back, arrays["instance"])
        assert back.dtype == np.uint32
    assert len(list(tmp_path.iterdir())) == 5


def test_other_aovs_come_back_as_they_were(frame, arrays, tmp_path):
    for name in ("depth", "normal", "shadows"):
        frame.save_aov(name, tmp_path / f"{name}.npy")
        frame.save_aov(name, tmp_path / f"{name}.exr")
        np.testing.assert_array_equal(np.load(tmp_path / f"{name}.npy"), arrays[name])
    assert pica.read_exr(tmp_path / "normal.exr").keys() == {"normal.X", "normal.Y", "normal.Z"}
    np.testing.assert_array_equal(pica.read_exr(tmp_path / "shadows.exr")["shadows.3"], arrays["shadows"][..., 3])
    np.testing.assert_array_equal(pica.read_exr(tmp_path / "depth.exr")["depth.Z"], arrays["depth"])
    with pytest.raises(PicaError, match=r"float32 of shape \(3, 5, 3\) are no labels .* \.npy holds any"):
        frame.save_aov("normal", tmp_path / "normal.png", exact=True)


@pytest.mark.parametrize(
    ("labels", "mode"),
    [
        (np.array([[True, False]]), "L"),
        (np.array([[3, 255]], np.uint8), "L"),
        (np.array([[3, 65535]], np.int32), "I;16"),
        (np.array([[3, 65535]], np.int64), "I;16"),
    ],
)
def test_labels_as_pictures(labels, mode, tmp_path):
    pica.write_labels(tmp_path / "a.png", labels)
    back = Image.open(tmp_path / "a.png")
    assert back.mode == mode
    np.testing.assert_array_equal(np.asarray(back), labels * 255 if labels.dtype == bool else labels)
    pica.write_labels(tmp_path / "a.exr", labels)
    np.testing.assert_array_equal(pica.read_exr(tmp_path / "a.exr")["Y"], labels)


@pytest.mark.parametrize(
    ("value", "name", "says"),
    [
        (65536, "a.png", r"holds 65536, and .png 0 to 65535; end the name in .exr or .npy"),
        (-1, "a.png", r"holds -1, and .png 0 to 65535; end the name in .npy"),
        (1 << 32, "a.exr", r"holds 4294967296, and .exr 0 to 4294967295; end the name in .npy"),
    ],
)
def test_labels_that_do_not_fit_are_refused(value, name, says, tmp_path):
    with pytest.raises(PicaError, match=says):
        pica.write_labels(tmp_path / name, np.array([[1, value]]))
    pica.write_labels(tmp_path / "a.npy", np.array([[1, value]]))
    assert [file.name for file in tmp_path.iterdir()] == ["a.npy"]


def test_large_ids_are_whole_in_an_exr(tmp_path):
    ids = np.array([[(1 << 24) + 1, (1 << 32) - 1]], np.uint32)
    pica.write_labels(tmp_path / "a.exr", ids)
    np.testing.assert_array_equal(pica.read_exr(tmp_path / "a.exr")["Y"], ids)


def test_a_frame_goes_to_another_process(frame, arrays, tmp_path):
    (tmp_path / "frame").write_bytes(pickle.dumps(frame))
    program = (
        "import pickle, sys; frame = pickle.load(open(sys.argv[1], 'rb')); frame = pickle.loads(pickle.dumps(frame));"
        "print(repr(frame), frame.aov('instance').sum(), frame.color.shape, frame.timings)"
    )
    told = subprocess.run(
        [sys.executable, "-c", program, tmp_path / "frame"], capture_output=True, text=True, check=True
    )
    expected = f"{frame!r} {arrays['instance'].sum()} (3, 5, 3) {{'gbuffer': 0.5}}"
    assert told.stdout.strip() == expected


def test_a_frame_shows_itself(frame, arrays, fetched):
    assert repr(frame) == ("<pica.Frame 5x3, 0.5 ms of passes, AOVs: depth, normal, motion, albedo, instance, shadows>")
    assert fetched == [], "what it says costs nothing"
    picture = Image.open(io.BytesIO(frame._repr_png_()))
    assert picture.format == "PNG"
    np.testing.assert_array_equal(np.asarray(picture), arrays["display"])


def test_a_notebook_has_the_aovs_under_a_line_to_click(frame, arrays, fetched):
    html = frame._repr_html_()
    picture, shut = html.split("<details>")
    np.testing.assert_array_equal(inline(picture)[0], arrays["display"])
    assert shut.count("<figcaption>") == len(frame.aov_names) and "<figcaption>shadows</figcaption>" in shut
    assert all(each.shape == (3, 5, 3) for each in inline(shut))
    frame.aov("depth")
    assert fetched.count("depth") == 2, "what is only looked at is not kept"


def test_a_notebook_shows_large_aovs_small_and_names_as_they_are():
    ids = np.repeat(np.arange(2), 500)[None].repeat(300, 0).astype(np.uint32)
    html = Frame((1000, 300), None, None, {"<b>": lambda: ids}, {})._repr_html_()
    assert "<details open>" in html and "&lt;b&gt;" in html and "<b>" not in html
    [small] = inline(html)
    assert small.shape == (60, 200, 3)
    assert np.abs(small[30, 50].astype(int) - preview("x", ids[:1, :1])[0, 0]).max() < 6


def inline(html):
    """The pictures in HTML, as arrays."""
    found = re.findall(r"data:image/(?:png|jpeg);base64,([^\"]+)", html)
    return [np.asarray(Image.open(io.BytesIO(base64.b64decode(each)))) for each in found]


def test_what_previews_show():
    places = preview("position", np.array([[[1, 5, 9], [3, 5, 5], [np.nan] * 3]], np.float32))
    assert places.tolist() == [[[0, 0, 255], [255, 0, 0], [0, 0, 0]]]
    assert not preview("position", np.full((1, 2, 3), np.nan, np.float32)).any()
    uv = preview("uv", np.array([[[0.25, 1.5], [-0.25, 2], [np.nan] * 2]], np.float32))
    assert uv.tolist() == [[[64, 128, 0], [191, 0, 0], [0, 0, 0]]]
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

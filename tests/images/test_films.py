import signal
import subprocess
import sys
import threading
import time

import av
import numpy as np
import pytest

from pica.errors import PicaError
from pica.images import films
from pica.images.films import describe, write_video

COLORS = ((255, 0, 0), (0, 200, 0), (30, 60, 255), (255, 255, 255), (0, 0, 0), (128, 128, 128))


def plain(color, width=32, height=18):
    return np.full((height, width, 3), color, np.uint8)


def test_pictures_come_back_in_their_colours(tmp_path):
    write_video(tmp_path / "out.mp4", (plain(color) for color in COLORS), fps=24)
    with av.open(tmp_path / "out.mp4") as film:
        decoded = [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]
    assert np.shape(decoded) == (len(COLORS), 18, 32, 3)
    worst = np.abs(np.array(decoded, int) - np.array(COLORS)[:, None, None]).max()
    assert worst <= 3
    assert describe(tmp_path / "out.mp4") == (len(COLORS), 32, 18)


@pytest.mark.parametrize(("fps", "rate"), [(24, 24), (29.97, 2997 / 100), (0.5, 0.5)])
def test_players_learn_rate_and_colours(tmp_path, fps, rate):
    write_video(tmp_path / "out.mp4", [plain(COLORS[0])] * 4, fps=fps)
    with av.open(tmp_path / "out.mp4") as film:
        stream = film.streams.video[0]
        context = stream.codec_context
        assert (context.name, context.pix_fmt, float(stream.average_rate)) == ("h264", "yuv420p", rate)
        assert (context.color_primaries, context.color_trc, context.colorspace) == (1, 13, 1)  # ITU-T H.273


@pytest.mark.parametrize(
    ("pictures", "says"),
    [
        ([plain(COLORS[0], 31)], "a film needs an even width and height, not 31x18"),
        ([plain(COLORS[0], 32, 17)], "a film needs an even width and height, not 32x17"),
        ([plain(COLORS[0]), plain(COLORS[0], 34)], "picture 1 is 34x18, those before it are 32x18"),
        ([], "there are no pictures"),
    ],
)
def test_pictures_that_make_no_film_leave_the_old_one(tmp_path, pictures, says):
    (tmp_path / "out.mp4").write_bytes(b"old")
    with pytest.raises(PicaError, match=says):
        write_video(tmp_path / "out.mp4", pictures, fps=30)
    assert [(file.name, file.read_bytes()) for file in tmp_path.iterdir()] == [("out.mp4", b"old")]


def test_a_folder_that_is_not_there(tmp_path):
    with pytest.raises(PicaError, match=r"out\.mp4: cannot be written"):
        write_video(tmp_path / "nowhere" / "out.mp4", [plain(COLORS[0])], fps=30)


@pytest.mark.parametrize("fps", [0, -1, 1e-300, 0.0009, 1001, float("inf"), float("nan")])
def test_rates_that_no_film_has(tmp_path, fps):
    with pytest.raises(PicaError, match=r"pictures a second, must be 0\.001 to 1000"):
        write_video(tmp_path / "out.mp4", [plain(COLORS[0])], fps=fps)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("fps", [0.001, 1000])
def test_the_slowest_and_the_fastest_film(tmp_path, fps):
    write_video(tmp_path / "out.mp4", [plain(COLORS[0])] * 3, fps=fps)
    with av.open(tmp_path / "out.mp4") as film:
        assert float(film.streams.video[0].average_rate) == pytest.approx(fps)
        assert sum(1 for _ in film.decode(video=0)) == 3


def test_describing_what_is_no_film(tmp_path):
    (tmp_path / "out.mp4").write_bytes(b"nonsense")
    with pytest.raises(PicaError, match=r"out\.mp4: not a readable film \(Invalid data"):
        describe(tmp_path / "out.mp4")


def test_errors_of_the_pictures_pass_and_leave_the_old_film(tmp_path):
    def pictures():
        yield plain(COLORS[0])
        raise ValueError("of the renderer")

    (tmp_path / "out.mp4").write_bytes(b"old")
    with pytest.raises(ValueError, match="of the renderer"):
        write_video(tmp_path / "out.mp4", pictures(), fps=30)
    assert [(file.name, file.read_bytes()) for file in tmp_path.iterdir()] == [("out.mp4", b"old")]


def test_a_picture_is_encoded_while_the_next_is_made(tmp_path, monkeypatch):
    encoded = threading.Event()
    convert = films._in_film_colors

    def watched(picture):
        assert threading.current_thread() is not threading.main_thread()
        encoded.set()
        return convert(picture)

    def pictures():
        yield plain(COLORS[0])
        assert encoded.wait(10)  # without another picture or the end
        yield plain(COLORS[1])

    monkeypatch.setattr(films, "_in_film_colors", watched)
    write_video(tmp_path / "out.mp4", pictures(), fps=30)
    assert describe(tmp_path / "out.mp4") == (2, 32, 18)


ENDLESS = """
import itertools, sys, numpy as np
from pica.images.films import write_video
noise = np.random.default_rng(0).integers(0, 255, (2, 180, 320, 3), np.uint8)
write_video(sys.argv[1], itertools.cycle(noise), 30)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="ends a process by a signal")
def test_a_killed_process_leaves_the_old_film_and_the_next_one_cleans_up(tmp_path):
    film = tmp_path / "out.mp4"
    film.write_bytes(b"old")
    process = subprocess.Popen([sys.executable, "-c", ENDLESS, str(film)])
    try:
        deadline = time.monotonic() + 60
        while not any(file.stat().st_size > 1000 for file in tmp_path.iterdir()):
            assert time.monotonic() < deadline and process.poll() is None
            time.sleep(0.02)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert film.read_bytes() == b"old" and len(list(tmp_path.iterdir())) == 2
    write_video(film, [plain(COLORS[0])], fps=30)
    assert [file.name for file in tmp_path.iterdir()] == ["out.mp4"]
    assert describe(film) == (1, 32, 18)

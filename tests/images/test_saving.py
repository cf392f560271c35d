import fcntl
import os
import signal
import subprocess
import sys
import threading

import pytest

from pica.errors import PicaError
from pica.images.saving import check_writable, write_whole

_WRITER = """
import sys, time
from pathlib import Path
from pica.images.saving import write_whole

def write(temporary):
    temporary.write_text("half")
    print(temporary.name, flush=True)
    sys.stdin.read()

write_whole(Path(sys.argv[1]), write)
"""


@pytest.fixture
def writer():
    """Start a process that writes to a file and waits; (process, name of its temporary file)."""
    started = []

    def start(path):
        arguments = [sys.executable, "-c", _WRITER, str(path)]
        process = subprocess.Popen(arguments, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        started.append(process)
        return process, process.stdout.readline().strip()

    yield start
    for process in started:
        process.kill()
        process.communicate()


def names(folder):
    return sorted(file.name for file in folder.iterdir())


def text(content):
    return lambda temporary: temporary.write_text(content)


def test_the_next_run_removes_what_a_killed_one_left(tmp_path, writer):
    process, temporary = writer(tmp_path / "out.png")
    assert names(tmp_path) == [temporary]
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert names(tmp_path) == [temporary]
    write_whole(tmp_path / "out.png", text("whole"))
    assert names(tmp_path) == ["out.png"]
    assert (tmp_path / "out.png").read_text() == "whole"


def test_the_next_run_removes_what_a_killed_one_left_of_another_file(tmp_path, writer):
    process, _ = writer(tmp_path / "first.png")
    living, temporary = writer(tmp_path / "second.exr")
    process.send_signal(signal.SIGKILL)
    process.wait()
    check_writable(tmp_path / "third.mp4")
    assert names(tmp_path) == [temporary]
    living.communicate("")
    assert names(tmp_path) == ["second.exr"]


def test_a_file_that_another_run_took_for_abandoned_is_made_anew(tmp_path, monkeypatch):
    """Between its making and its lock, it looks abandoned."""
    opened, taken = os.open, []

    def open_and_lose(path, flags, *mode):
        file = opened(path, flags, *mode)
        if flags & os.O_EXCL and not taken:
            taken.append(path)
            os.unlink(path)
        return file

    monkeypatch.setattr(os, "open", open_and_lose)
    write_whole(tmp_path / "out.png", text("whole"))
    assert taken and names(tmp_path) == ["out.png"] and (tmp_path / "out.png").read_text() == "whole"


def test_a_file_that_another_run_is_about_to_remove_is_made_anew(tmp_path, monkeypatch):
    """That run has the lock already, and the file is still there."""
    opened, removers = os.open, []

    def open_and_lock_elsewhere(path, flags, *mode):
        file = opened(path, flags, *mode)
        if flags & os.O_EXCL and not removers:
            other = opened(path, os.O_WRONLY)
            fcntl.flock(other, fcntl.LOCK_EX)

            def remove():
                os.unlink(path)
                os.close(other)

            removers.append(threading.Timer(0.2, remove))
            removers[0].start()
        return file

    monkeypatch.setattr(os, "open", open_and_lock_elsewhere)

    def write(temporary):
        temporary.write_text("whole")
        removers[0].join()

    write_whole(tmp_path / "out.png", write)
    assert names(tmp_path) == ["out.png"] and (tmp_path / "out.png").read_text() == "whole"


def test_what_a_live_run_writes_is_left_alone(tmp_path, writer):
    process, temporary = writer(tmp_path / "out.png")
    write_whole(tmp_path / "out.png", text("first"))
    check_writable(tmp_path / "out.png")
    assert names(tmp_path) == [temporary, "out.png"]
    process.communicate("")
    assert process.returncode == 0 and names(tmp_path) == ["out.png"]
    assert (tmp_path / "out.png").read_text() == "half"


def test_threads_that_write_one_file_leave_each_other_alone(tmp_path):
    together = threading.Barrier(4)

    def write(temporary):
        temporary.write_text("whole")
        together.wait(10)

    threads = [threading.Thread(target=write_whole, args=(tmp_path / "out.png", write)) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert names(tmp_path) == ["out.png"] and not together.broken


@pytest.mark.parametrize("name", ["a[1].png", "a*.png", "a?.exr", "new\nline.png", ".png", "a.b.png", "\udcff.png"])
def test_nothing_but_leftovers_is_removed(tmp_path, name):
    path = tmp_path / name
    left = path.with_name(f".{path.stem}.pica-01234567{path.suffix}")
    others = ["a.pica-01234567.png", ".pica-01234567", ".a.png", ".a.01234567.png", ".a.b.pica-0.png"]
    others += [".a.pica-0123456g.png", ".a.pica-01234567.tar.gz"]
    for each in (left, *(tmp_path / other for other in others)):
        each.write_text("")
    write_whole(path, text("whole"))
    assert names(tmp_path) == sorted([name, *others])


def test_a_folder_that_is_named_like_a_leftover_stays(tmp_path):
    (tmp_path / ".out.pica-01234567.png").mkdir()
    (tmp_path / ".out.pica-76543210.png").symlink_to("nowhere")
    os.mkfifo(tmp_path / ".out.pica-00000000.png")
    write_whole(tmp_path / "out.png", text("whole"))
    assert len(names(tmp_path)) == 4


def test_a_link_stays_and_what_it_points_to_is_written(tmp_path):
    (tmp_path / "disk").mkdir()
    (tmp_path / "out.png").symlink_to(tmp_path / "disk" / "real.png")
    for content in ("new", "old"):
        write_whole(tmp_path / "out.png", text(content))
        assert (tmp_path / "out.png").is_symlink()
        assert (tmp_path / "disk" / "real.png").read_text() == content
    assert names(tmp_path / "disk") == ["real.png"]


def _folder(path):
    path.mkdir()


def _loop(path):
    path.symlink_to(path.name)


def _device(path):
    path.symlink_to("/dev/full")


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (_folder, "cannot write {}: it is a folder"),
        (os.mkfifo, "cannot write {}: it is a device or a pipe"),
        (_device, "cannot write {}: it is a device or a pipe"),
        (_loop, "cannot write {}: it is a link to itself"),
    ],
)
def test_what_no_picture_can_replace(tmp_path, make, says):
    path = tmp_path / "out.png"
    make(path)
    for attempt in (check_writable, lambda path: write_whole(path, text("whole"))):
        with pytest.raises(PicaError) as caught:
            attempt(path)
        assert str(caught.value).startswith(says.format(path))
    assert names(tmp_path) == ["out.png"] and (path.is_symlink() or not path.is_file())


@pytest.mark.parametrize(
    "path",
    ["/proc/out.png", "/nonexistent/out.png", "/dev/null/out.png", f"{'x' * 252}.png", "x" * 5000, "a\0.png"],
)
def test_folders_and_names_that_cannot_be_written_are_told_before_and_after(tmp_path, monkeypatch, path):
    monkeypatch.chdir(tmp_path)
    for attempt in (check_writable, lambda path: write_whole(path, text("whole"))):
        with pytest.raises(PicaError, match="cannot be written"):
            attempt(type(tmp_path)(path))
    assert not names(tmp_path)


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), RuntimeError("broken\nmore"), ValueError()])
def test_a_write_that_fails_leaves_what_was_there(tmp_path, error):
    (tmp_path / "out.png").write_text("old")

    def write(temporary):
        temporary.write_text("half")
        raise error

    with pytest.raises(PicaError, match=r"out\.png: cannot be written \((No space left|broken|ValueError)"):
        write_whole(tmp_path / "out.png", write)
    assert names(tmp_path) == ["out.png"] and (tmp_path / "out.png").read_text() == "old"


def test_files_get_the_usual_rights(tmp_path):
    before = os.umask(0o027)
    try:
        write_whole(tmp_path / "out.png", text("whole"))
    finally:
        os.umask(before)
    assert (tmp_path / "out.png").stat().st_mode & 0o777 == 0o640

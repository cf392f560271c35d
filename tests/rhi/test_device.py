"""What a device keeps: caches on disk, and a count of its memory."""

import os
import shutil
import subprocess
import sys
import time

import numpy as np
import pytest
import slangpy as spy

from pica.caches.places import SHADERS
from pica.caches.shader_database import is_whole
from pica.errors import DeviceError

COMPILE = """
from pica.rhi.device import Device
import slangpy as spy
device = Device()
compute = device.compute("path_tracer/average.slang")
print("made", bool(compute.pipeline))
"""


CACHE = f"vectors-{os.environ['LP_NATIVE_VECTOR_WIDTH']}"
"""A folder of this name is in use itself, not one below it (places.py)."""


def compiled_in(folder):
    """Compile one shader in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-c", COMPILE],
        env={**os.environ, "PICA_CACHE": str(folder)},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.stdout.strip() == "made True", (done.returncode, done.stderr)
    return done


def compile_in(folder):
    """The files that are in a cache after compiling one shader, with their ages."""
    compiled_in(folder)
    return {path: path.stat().st_mtime_ns for path in folder.rglob("*") if path.is_file()} if folder.is_dir() else {}


@pytest.mark.device
def test_compiled_shaders_are_kept_and_used_again(tmp_path):
    first = compile_in(tmp_path / CACHE)
    assert any("shaders" in path.parts for path in first) and any("modules" in path.parts for path in first)
    modules = {path: age for path, age in first.items() if path.suffix == ".slang-module"}
    assert any("average" in path.name for path in modules)
    time.sleep(0.05)
    second = compile_in(tmp_path / CACHE)
    assert {path: second[path] for path in modules} == modules, "nothing was compiled anew"


@pytest.mark.device
def test_a_folder_that_cannot_be_written_is_no_obstacle(tmp_path):
    (tmp_path / "file").write_text("in the way")
    assert compile_in(tmp_path / "file" / CACHE) == {}


@pytest.fixture(scope="module")
def kept_shaders(tmp_path_factory):
    """A folder of caches with a shader in it."""
    folder = tmp_path_factory.mktemp("kept") / CACHE
    compile_in(folder)
    return folder


@pytest.fixture
def data(kept_shaders, tmp_path):
    """A copy of its database."""
    shutil.copytree(kept_shaders, tmp_path / CACHE)
    return tmp_path / CACHE / SHADERS / "rhi" / "data.mdb"


def starts_with(data) -> str:
    """What is said when a process starts with this database, and works."""
    return compiled_in(data.parents[3]).stderr


@pytest.mark.device
def test_a_database_that_is_whole_is_left_alone(data):
    assert is_whole(data)
    assert starts_with(data) == ""
    data.write_bytes(b"")
    assert is_whole(data), "nobody has written to it yet"
    assert starts_with(data) == ""


@pytest.mark.device
def test_a_truncated_database_is_found_whatever_its_length(data):
    """LMDB ends the process where a page lies behind the end."""
    content = data.read_bytes()
    found = {}
    for length in {*range(1, len(content), 1021), *range(0, len(content), 4096), len(content) - 1} - {0}:
        data.write_bytes(content[:length])
        found[length] = is_whole(data)
    assert not any(found[length] for length in found if length < 3 * 4096)
    shortest = min((length for length in found if found[length]), default=len(content))
    for length in (5000, max(length for length in found if length < shortest), shortest):
        data.write_bytes(content[:length])
        said = starts_with(data)
        assert said.count("data.mdb is damaged and was removed") == (length < shortest), said
        assert is_whole(data) and starts_with(data) == "", "once"
        assert "Failed to open cache" not in said


@pytest.mark.device
@pytest.mark.parametrize("start", [0, 4096, 8192])
def test_garbage_is_found(data, start):
    size = data.stat().st_size
    with data.open("r+b") as file:
        file.seek(start)
        file.write(np.random.default_rng(start).bytes(size - start))
    assert not is_whole(data)
    assert "is damaged and was removed" in starts_with(data)


@pytest.mark.device
def test_whatever_is_in_a_database_is_no_error(data):
    content = np.frombuffer(data.read_bytes(), np.uint8)
    random = np.random.default_rng(1)
    verdicts = []
    for _ in range(400):
        changed = content.copy()
        first = random.integers(len(content))
        run = changed[first : first + random.integers(1, 8192)]
        run[:] = random.integers(0, 256, len(run)) if random.integers(2) else 255
        data.write_bytes(changed.tobytes())
        verdicts.append(is_whole(data))
    assert 0.05 < np.mean(verdicts) < 0.95


@pytest.mark.device
def test_garbage_in_the_lock_file_is_no_obstacle(data):
    lock = data.with_name("lock.mdb")
    lock.write_bytes(np.random.default_rng(1).bytes(lock.stat().st_size))
    assert starts_with(data) == ""


@pytest.mark.device
@pytest.mark.parametrize("truncated", [True, False])
def test_damaged_modules_are_no_obstacle(data, truncated):
    """Slang itself finds those that are too short."""
    for module in data.parents[3].rglob("*.slang-module"):
        content = module.read_bytes()
        module.write_bytes(content[: len(content) // 2] if truncated else content[:20] + b"?" * 120 + content[140:])
    data.unlink()  # else nobody asks for modules
    assert ("is damaged and was removed" in starts_with(data)) == (not truncated)
    assert starts_with(data) == ""


def test_memory_is_counted(device):
    before = device.memory
    device.buffer("kilobyte", size=1024)
    device.structured("numbers", np.zeros((100, 3), np.float32))
    assert device.memory == before + 1024 + 1200
    device.texture("picture", spy.Format.rgba32_float, (64, 64))
    assert device.memory >= before + 1024 + 1200 + 64 * 64 * 16
    device.count_memory(-1024)
    assert device.memory < device.peak_memory


def test_what_the_device_has_no_memory_for_is_an_error_in_words(device):
    """Of Device.memory nothing is booked for it."""
    before = device.memory
    with pytest.raises(DeviceError, match="has no memory for vertices, 1,099,511,627,776 bytes"):
        device.buffer("vertices", size=1 << 40)
    assert device.memory == before


def test_empty_data_still_makes_a_buffer(device):
    assert device.structured("nothing", np.zeros((0, 3), np.float32)).size >= 12


LIMITED = """
import resource, sys
import numpy as np
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]) << 20,) * 2)
from pica.errors import DeviceError
from pica.rhi.device import Device
try:
    device = Device()
    device.compute("effects/post/tone_map.slang").pipeline
    print("made")
    data = np.zeros(1 << 24, np.uint8)
    buffers = [device.buffer("filler", data=data) for _ in range(20)]
    print("no end")
except DeviceError as error:
    print(error)
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="drivers keep their memory otherwise elsewhere")
@pytest.mark.parametrize(("limit", "told"), [(1, "needed"), (100, "needed"), (200, "no room"), (4000, "no end")])
def test_a_limit_of_files_is_an_error_and_not_the_end(device, tmp_path, limit, told):
    """With caches that are empty and then full."""
    if not device.is_software:
        pytest.skip("its memory is in no file")
    for _ in range(2):
        command = [sys.executable, "-W", "ignore", "-c", LIMITED, str(limit)]
        environment = {**os.environ, "PICA_CACHE": str(tmp_path)}
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, done.stderr
        assert told in done.stdout and ("made" in done.stdout) == (limit > 128)

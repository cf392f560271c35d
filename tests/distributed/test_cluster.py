import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from pica.cli.main import main
from pica.distributed.cluster import do_on_cluster
from pica.errors import PicaError
from pica.images.pictures import read_image
from pica.quality.metrics import flip
from tests.distributed.test_workers import Writing, names


@dataclass(frozen=True)
class Dying(Writing):
    """Its process ends in chunk 2, the first so many times."""

    times: int = 1

    def open(self, worker):
        inner = super().open(worker)

        def chunk(number):
            if number == 2 and len(list(self.folder.glob("death *"))) < self.times:
                (self.folder / f"death {os.getpid()}").touch()
                os._exit(1)
            inner(number)

        return chunk


@pytest.fixture(scope="module")
def cluster():
    """Room for two actors."""
    ray = pytest.importorskip("ray", reason="Ray is not installed")
    ray.init(num_cpus=8, include_dashboard=False, log_to_driver=False, logging_level="ERROR")
    yield
    ray.shutdown()


@pytest.mark.slow
def test_all_chunks_are_done(cluster, tmp_path):
    done = []
    do_on_cluster(Writing(tmp_path), [0, 1, 3, 4], "auto", lambda *counts: done.append(counts))
    assert [name for name in names(tmp_path) if name.isdigit()] == ["0", "1", "3", "4"]
    assert done[0] == (0, 48) and done[-1] == (48, 48) and len(done) == 5


@pytest.mark.slow
def test_a_lost_worker_costs_its_chunk_alone(cluster, tmp_path):
    do_on_cluster(Dying(tmp_path), [0, 1, 2, 3], "auto", lambda *counts: None)
    assert [name for name in names(tmp_path) if name.isdigit()] == ["0", "1", "2", "3"]
    assert len(list(tmp_path.glob("death *"))) == 1


@pytest.mark.slow
def test_a_chunk_that_loses_every_worker_is_an_error(cluster, tmp_path):
    with pytest.raises(PicaError, match="lost 3 workers in one place"):
        do_on_cluster(Dying(tmp_path, times=9), [0, 1, 2, 3], "auto", lambda *counts: None)


@pytest.mark.slow
@pytest.mark.parametrize(("fault", "kind"), [("no room", PicaError), ("bug", RuntimeError)])
def test_what_happens_on_the_cluster_is_raised_here(cluster, tmp_path, fault, kind):
    with pytest.raises(kind, match="no room" if fault == "no room" else "ZeroDivisionError: by zero"):
        do_on_cluster(Writing(tmp_path, fault), [0, 1, 2], "auto", lambda *counts: None)


def test_without_ray_one_line_says_so(tmp_path):
    program = f"""
import sys
sys.modules["ray"] = None
from pica.cli.main import main
code = main(["dataset", "cornell", "-o", {str(tmp_path / "out")!r}, "--cluster", "auto"])
sys.exit(code + main(["render", "cornell", "-o", {str(tmp_path / "%d.png")!r}, "--turntable", "--cluster", "auto"]))
"""
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=False)
    lines = run.stderr.splitlines()
    assert run.returncode == 4 and len(lines) == 2 and not list(Path(tmp_path).iterdir())
    assert all(line == 'pica: cluster: Ray is not installed; `pip install "pica[ray]"` installs it' for line in lines)


def arguments(output, *more):
    scene = ["--size", "48x32", "--turntable", "--fps", "10", "--frames", "48", "--device", "llvmpipe"]
    return ["render", "cornell", "-o", str(output), *scene, "--seconds", "4", *more]


@pytest.mark.slow
@pytest.mark.device
def test_frames_of_a_cluster_are_those_of_one_process(cluster, tmp_path, capsys):
    """Three runs of pictures, of which the second and the third begin in the middle."""
    for folder in ("alone", "together"):
        (tmp_path / folder).mkdir()
        more = ["--cluster", "auto"] if folder == "together" else []
        assert main(arguments(tmp_path / folder / "%02d.png", *more)) == 0, capsys.readouterr().err
    assert "40 of 40 pictures rendered" in capsys.readouterr().out
    errors = []
    for number in range(40):
        one, other = (read_image(tmp_path / name / f"{number:02d}.png", "") for name in ("alone", "together"))
        errors.append(flip(one[..., :3] / 255, other[..., :3] / 255)[0])
    assert max(errors[:16]) < 0.001 < max(errors) < 0.01, errors  # threads may change last bits

    kept = (tmp_path / "together" / "03.png").stat().st_mtime_ns
    for number in (7, 20):
        (tmp_path / "together" / f"{number:02d}.png").unlink()
    assert main(arguments(tmp_path / "together" / "%02d.png", "--cluster", "auto", "--resume")) == 0
    assert "2 of 40 pictures rendered" in capsys.readouterr().out
    assert len(names(tmp_path / "together")) == 40
    assert (tmp_path / "together" / "03.png").stat().st_mtime_ns == kept

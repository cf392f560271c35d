"""How long a new user waits for a first picture: with empty caches, then with full ones.

    python benchmarks/first_picture.py demo cornell

Seconds by the clock, and of the processor in all processes: these tell more on a machine that is busy with other work.
Python's own bytecode is there each time, as an installation leaves it.
"""

import argparse
import compileall
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pica

RUNS = "cold", "warm", "warm"


def first_picture(scene: str, size: str, folder: Path) -> tuple[float, float]:
    """Wall and processor seconds of one `pica render` whose caches lie in a folder."""
    # Mesa's folder must be pica's own, wherever this shell has put it.
    environment = {name: value for name, value in os.environ.items() if name != "MESA_SHADER_CACHE_DIR"}
    command = [sys.executable, "-m", "pica", "render", scene, "-o", str(folder / "out.png"), "--size", size]
    before, began = _processor_seconds(), time.perf_counter()
    subprocess.run(
        [*command, "--frames", "1"],
        env={**environment, "PICA_CACHE": str(folder / "cache")},
        check=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    return time.perf_counter() - began, _processor_seconds() - before


def _processor_seconds() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    """Print a line a run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", metavar="SCENE", help="as pica render takes it")
    parser.add_argument("--size", default="640x360")
    given = parser.parse_args()
    compileall.compile_dir(str(Path(pica.__file__).parent), quiet=1)
    for scene in given.scenes:
        with tempfile.TemporaryDirectory() as folder:
            for run in RUNS:
                wall, processor = first_picture(scene, given.size, Path(folder))
                load = os.getloadavg()[0]
                print(f"{scene} {run}: {wall:.1f} s, processor {processor:.1f} s, load {load:.1f}", flush=True)


if __name__ == "__main__":
    main()

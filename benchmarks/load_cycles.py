"""A file is loaded, rendered and dropped, again and again: does the process stay as it is?

    PYTHONPATH=. python benchmarks/load_cycles.py FILE.glb [--cycles 300] [--warm-up 20] [--set NAME=VALUE ...]

Prints resident memory, open files and pica's own count of device memory. Exits with 1 where resident memory after the
last cycle is more than 3 % above that after the warm-up, or where a file is left open (Linux).
"""

import argparse
import os
import sys
import warnings

import pica
from benchmarks.endurance import resident
from pica.rhi.device import open_device

ALLOWED = 1.03


def open_files() -> int:
    """File descriptors of the process (Linux)."""
    return len(os.listdir("/proc/self/fd"))


def cycle(file: str, size: tuple[int, int], settings: pica.Settings) -> None:
    """What somebody writes who knows of no `close`."""
    scene = pica.load(file)
    frame = pica.Renderer(scene, size=size, settings=settings).render(frames=2)
    assert frame.display.shape == (*size[::-1], 3)


def main() -> int:
    """Run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file")
    parser.add_argument("--cycles", type=int, default=300)
    parser.add_argument("--warm-up", type=int, default=20)
    parser.add_argument("--size", default="32x18")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    width, height = map(int, arguments.size.split("x"))
    settings = pica.Settings().with_values(dict(pair.split("=", 1) for pair in arguments.set))
    begun = 0.0, 0
    for done in range(1, arguments.cycles + 1):
        cycle(arguments.file, (width, height), settings)
        now = resident(), open_files()
        if done == arguments.warm_up:
            begun = now
        if done % 20 == 0 or done == arguments.cycles:
            device = open_device().memory / 2**20
            print(f"{done} cycles: resident {now[0]:.1f} MB, {now[1]} open files, device {device:.2f} MB", flush=True)
    return int(now[0] > ALLOWED * begun[0] or now[1] > begun[1])


if __name__ == "__main__":
    sys.exit(main())

"""What loading files takes, with the processes that decode parts of them.

    python benchmarks/load_files.py model.glb other.glb [--runs 5]

Loads each file `--runs` times and prints the least processor seconds of this process and of its children, and the least
seconds that pass.
"""

import argparse
import resource
import time
import warnings
from pathlib import Path

import pica


def used(who: int) -> float:
    """Processor seconds so far."""
    usage = resource.getrusage(who)
    return usage.ru_utime + usage.ru_stime


def measured(path: Path) -> tuple[float, float, float]:
    """Processor seconds of this process, those of its children, and seconds."""
    own, others, start = used(resource.RUSAGE_SELF), used(resource.RUSAGE_CHILDREN), time.perf_counter()
    pica.load(path)
    seconds = time.perf_counter() - start
    return used(resource.RUSAGE_SELF) - own, used(resource.RUSAGE_CHILDREN) - others, seconds


def main() -> None:
    """Print a line for each file."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--runs", type=int, default=5)
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    for path in arguments.files:
        runs = [measured(path) for _ in range(arguments.runs)]
        own, others, seconds = (min(values) for values in zip(*runs, strict=True))
        triangles = pica.load(path).triangle_count()
        print(f"{path.name}: {triangles:,} triangles, {own:.3f} + {others:.3f} s of processor time, {seconds:.3f} s")


if __name__ == "__main__":
    main()

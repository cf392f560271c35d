"""`make fuzz`: fuzzes for some minutes, with other chances in each round.

    python -m tests.fuzz.campaign [--minutes 10]

Stops at the first finding with Hypothesis' report: the smallest input that shows it. What breaks the interpreter
itself is left in the folder that is named. Files that were found are kept in tests/fuzz/cases, where `make test` tries
them again.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

FOLDER = Path(__file__).parent


def main() -> int:
    """Exit code 0: nothing was found."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=10)
    end = time.monotonic() + 60 * parser.parse_args().minutes
    rounds = 0
    while time.monotonic() < end:
        folder = tempfile.mkdtemp(prefix="pica-fuzz-")
        options = ["-q", "-x", "--numprocesses=auto", "--hypothesis-profile=fuzz", f"--basetemp={folder}"]
        # One round may take longer than the rest of the time.
        code = subprocess.run([sys.executable, "-m", "pytest", *options, "--timeout=1800", str(FOLDER)]).returncode
        rounds += 1
        if code:
            print(f"fuzz: a finding in round {rounds}; the files are in {folder}")
            return code
    print(f"fuzz: {rounds} rounds and nothing found")
    return 0


if __name__ == "__main__":
    sys.exit(main())

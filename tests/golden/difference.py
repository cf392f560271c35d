"""`make golden-diff`: by how much each golden picture moved. Changes none; sheets of these come to out/golden.

python -m tests.golden.difference [--device PART_OF_A_NAME] [NAME ...]; names may be beginnings, such as "indirect".
Ends with 1 where a picture is outside its limits.
"""

import argparse
import os

from pica.rhi.device import open_device
from tests.golden.table import HEADER, SHEETS, chosen, compared
from tests.golden.whole_frames import IN_ORDER


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("names", nargs="*")
    parser.add_argument("--device", default=None)
    arguments = parser.parse_args()
    goldens = chosen(arguments.names)
    os.environ.update(IN_ORDER)
    device = open_device(arguments.device)
    print(device.name)
    print(HEADER)
    outside = []
    for golden in goldens:
        try:
            line, _, within = compared(golden, device)
        except Exception as error:  # the other pictures are still to be told of
            line, within = f"{golden.name:37s} {type(error).__name__}: {error}", False
        print(line, flush=True)
        if not within:
            outside.append(golden.name)
    print(f"{len(goldens) - len(outside)} of {len(goldens)} within their limits; sheets of those that moved: {SHEETS}")
    return 1 if outside else 0


if __name__ == "__main__":
    raise SystemExit(main())

"""`make golden`: render golden pictures anew, all or those named, and say what changed.

Sheets of before and after come to out/golden/NAME/. A picture within its limits is renewed too: run this only when
pictures change on purpose, look at the sheets, and commit what is meant. Always by lavapipe, whatever else there is.
"""

import os
import sys

from pica.rhi.device import open_device
from tests.golden.comparison import save_picture
from tests.golden.table import HEADER, chosen, compared
from tests.golden.whole_frames import IN_ORDER


def main() -> None:
    goldens = chosen(sys.argv[1:])
    os.environ.update(IN_ORDER)
    device = open_device("llvmpipe")
    print(HEADER)
    for golden in goldens:
        line, picture, _ = compared(golden, device)
        save_picture(golden.path, picture)
        print(line, flush=True)


if __name__ == "__main__":
    main()

"""`make golden`: render golden pictures anew, all or those named, and say what changed.

Sheets of before and after come to out/golden/NAME/. A picture within its bounds is renewed too: run this only when
pictures change on purpose, look at the sheets, and commit what is meant.
"""

import sys
from pathlib import Path

from pica.rhi.device import Device
from tests.golden.cases import GOLDENS, Golden
from tests.golden.comparison import Comparison, save_picture

SHEETS = Path("out/golden")


def renew(golden: Golden, device: Device) -> str:
    """Render one and write it; a line about it."""
    picture = golden.render(device)
    said = f"{golden.name:22s} "
    if golden.path.exists():
        found = Comparison.of(golden.picture(), picture)
        folder = SHEETS / golden.name
        folder.mkdir(parents=True, exist_ok=True)
        found.save(folder)
        before, after = found.golden.mean(), picture.mean()
        outside = "" if found.flip <= golden.flip and found.energy <= golden.energy else "  changed"
        said += (
            f"FLIP {found.flip:.4f} ({golden.flip})  energy {100 * found.energy:.2f} % ({100 * golden.energy:.2f} %)"
            f"  mean {before:.5f} -> {after:.5f} ({100 * (after / before - 1):+.2f} %){outside}"
        )
    else:
        said += f"new, mean {picture.mean():.5f}"
    save_picture(golden.path, picture)
    return said


def main() -> None:
    names = sys.argv[1:]
    if unknown := set(names) - {golden.name for golden in GOLDENS}:
        sys.exit(f"no golden picture {', '.join(sorted(unknown))}")
    device = Device()
    print("name, what changed from the picture kept (what the test allows), mean radiance before -> after")
    for golden in GOLDENS:
        if not names or golden.name in names:
            print(renew(golden, device), flush=True)


if __name__ == "__main__":
    main()

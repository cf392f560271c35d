"""By how much golden pictures moved, a line each."""

import sys
import time
from pathlib import Path

from pica.rhi.device import Device
from tests.golden.cases import GOLDENS, Golden
from tests.golden.comparison import Comparison, Picture
from tests.golden.whole_frame_cases import WHOLE_FRAMES
from tests.golden.whole_frames import WholeFrame

ALL: list[Golden | WholeFrame] = [*WHOLE_FRAMES, *GOLDENS]
SHEETS = Path("out/golden")
HEADER = (
    f"{'name':37s} {'bits':5s} {'max abs':>9s} {'FLIP':>7s} {'allowed':>7s} {'energy':>8s} {'allowed':>7s}"
    f"  mean before -> after          seconds"
)


def chosen(names: list[str]) -> list[Golden | WholeFrame]:
    """Those of these names, or whose names begin so; all where there are none. Ends the process if one is unknown."""
    by_name = {golden.name: golden for golden in ALL}
    found: dict[str, Golden | WholeFrame] = {}
    for name in names:
        some = {name: by_name[name]} if name in by_name else {n: g for n, g in by_name.items() if n.startswith(name)}
        if not some:
            sys.exit(f"no golden picture is named {name}, or begins so")
        found |= some
    return list(found.values()) if names else ALL


def compared(golden: Golden | WholeFrame, device: Device) -> tuple[str, Picture, bool]:
    """A line about one, its picture as it is today, and whether that is within the limits. Saves a sheet of both in
    SHEETS where bits differ."""
    start = time.perf_counter()
    picture = golden.render(device)
    seconds = time.perf_counter() - start
    if not golden.path.exists():
        return f"{golden.name:37s} new, mean {picture.mean():.5f}  {seconds:.1f}", picture, False
    found = Comparison.of(golden.picture(), picture)
    if not found.same_bits:
        folder = SHEETS / golden.name
        folder.mkdir(parents=True, exist_ok=True)
        found.save(folder)
    limits, before, after = golden.limits(device), found.golden.mean(), picture.mean()
    within = found.within(limits)
    line = (
        f"{golden.name:37s} {'equal' if found.same_bits else 'other'} {found.largest:9.2g}"
        f" {found.flip:7.4f} {limits.flip:7.4f} {100 * found.energy:6.3f} % {100 * limits.energy:5.2f} %"
        f"  {before:.5f} -> {after:.5f} {100 * (after / before - 1):+7.3f} % {seconds:6.1f}"
        f"{'' if within else '  OUTSIDE'}"
    )
    return line, picture, within

"""Pictures as they are now against those kept. Who changes pictures on purpose runs `make golden` and looks."""

import pytest

from tests.golden.cases import GOLDENS, Golden
from tests.golden.comparison import Comparison

CASES = [pytest.param(golden, id=golden.name, marks=golden.marks) for golden in GOLDENS]


@pytest.mark.parametrize("golden", CASES)
def test_pictures_stay_as_they_are(device, golden: Golden, tmp_path):
    found = Comparison.of(golden.picture(), golden.render(device))
    if found.flip > golden.flip or found.energy > golden.energy:
        found.save(tmp_path)
        pytest.fail(
            f"{golden.name}: FLIP {found.flip:.4f} (at most {golden.flip}), energy {100 * found.energy:.2f} % (at most"
            f" {100 * golden.energy:.2f} %); look at {tmp_path / 'sheet.png'}; if it is right, run make golden"
        )

"""Pictures as they are now against those kept. Who changes pictures on purpose runs `make golden` and looks."""

import subprocess
import sys

import pytest

import pica
from tests.golden.cases import GOLDENS, Golden
from tests.golden.comparison import Comparison
from tests.golden.whole_frame_cases import WHOLE_FRAMES
from tests.golden.whole_frames import WholeFrame

CASES = [pytest.param(golden, id=golden.name, marks=golden.marks) for golden in GOLDENS]


def marks_of(golden: WholeFrame) -> list[pytest.MarkDecorator]:
    differs = [pytest.mark.gpu_differs(golden.differs)] if golden.differs else []
    return differs if golden.always else [*differs, pytest.mark.whole_frames]


WHOLE = [pytest.param(golden, id=golden.name, marks=marks_of(golden)) for golden in WHOLE_FRAMES]


@pytest.mark.parametrize("golden", CASES)
def test_pictures_stay_as_they_are(device, golden: Golden, tmp_path):
    check(device, golden, tmp_path)


@pytest.mark.parametrize("golden", WHOLE)
def test_whole_frames_stay_as_they_are(device, golden: WholeFrame, tmp_path):
    if golden.one_thread and device.is_software:
        command = [sys.executable, "-m", "tests.golden.difference", golden.name]
        done = subprocess.run(command, capture_output=True, text=True, timeout=600)
        assert done.returncode == 0, done.stdout + done.stderr
    else:
        check(device, golden, tmp_path)


def check(device, golden, folder):
    limits = golden.limits(device)
    found = Comparison.of(golden.picture(), golden.render(device))
    if not found.within(limits):
        found.save(folder)
        pytest.fail(
            f"{golden.name}: FLIP {found.flip:.4f} (at most {limits.flip}), energy {100 * found.energy:.2f} % (at most"
            f" {100 * limits.energy:.2f} %); look at {folder / 'sheet.png'}; if it is right, run make golden"
        )


def test_each_preset_has_a_picture():
    assert {golden.preset for golden in WHOLE_FRAMES} == set(pica.settings.PRESETS)

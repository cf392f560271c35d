import os
import subprocess
import sys

import pytest

from pica.cli import doctor


def run_doctor(**environment):
    return subprocess.run(
        [sys.executable, "-m", "pica", "doctor"],
        capture_output=True,
        text=True,
        timeout=120,
        env=os.environ | environment,
    )


def test_without_a_driver_it_says_what_to_install():
    run = run_doctor(VK_DRIVER_FILES="/nonexistent", VK_ICD_FILENAMES="/nonexistent")
    assert run.returncode == 0
    assert "lavapipe" in run.stdout and "install" in run.stdout
    assert "Traceback" not in run.stdout + run.stderr


def test_here_it_finds_a_device():
    run = run_doctor()
    assert run.returncode == 0
    assert "Ready" in run.stdout and "SlangPy" in run.stdout and "shader cache" in run.stdout


@pytest.mark.parametrize(
    ("kind", "missing", "says"),
    [("hardware", [], "Ready."), ("software", [], "processor"), ("hardware", ["ray tracing pipelines"], "No device")],
)
def test_advice(kind, missing, says):
    assert says in doctor.advice([{"type": kind, "missing": missing}])[0]


def test_a_crashing_driver_is_told(monkeypatch):
    monkeypatch.setattr(doctor, "_PROBE", "import os; os.abort()")
    devices, fault = doctor.probe()
    assert devices == [] and "-6" in fault


def test_tiers_and_what_each_lacks():
    lines = doctor.tier_lines([{"tier": 1}, {"tier": 3}, {"tier": 3}])
    assert [line[:6] for line in lines] == ["tier 1", "tier 3", "Embree"]
    assert "lacks ray generation" in lines[0] and "lacks nothing" in lines[1]

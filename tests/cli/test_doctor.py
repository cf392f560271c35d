import os
import re
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
    assert run.returncode == 2
    assert "lavapipe" in run.stdout and "install" in run.stdout
    assert "Traceback" not in run.stdout + run.stderr


@pytest.mark.device
def test_here_it_finds_a_device():
    run = run_doctor()
    assert run.returncode == 0
    assert "Ready" in run.stdout and "SlangPy" in run.stdout and "shader cache" in run.stdout


@pytest.mark.parametrize(
    ("kind", "missing", "says"),
    [("hardware", [], "Ready."), ("software", [], "processor"), ("hardware", ["bindless resources"], "No device")],
)
def test_advice(kind, missing, says):
    assert says in doctor.advice([{"type": kind, "missing": missing}])[0]


def test_a_crashing_driver_is_told(monkeypatch):
    monkeypatch.setattr(doctor, "_PROBE", "import os; os.abort()")
    devices, fault = doctor.probe()
    assert devices == [] and "-6" in fault


def test_files_of_the_folder_that_it_runs_in_are_not_imported(monkeypatch, tmp_path):
    for name in ("json.py", "numpy.py", "dataclasses.py"):
        (tmp_path / name).write_text("raise SystemExit(9)")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(doctor, "_PROBE", "import json, dataclasses; print('[]')")
    assert doctor.probe() == ([], "")


@pytest.mark.parametrize(("missing", "code"), [([], 0), (["bindless resources"], 2)])
def test_the_exit_code_tells_whether_pica_can_run(run, monkeypatch, missing, code):
    device = {"name": "a\x1b[31m\ncard", "type": "hardware", "driver": "", "tier": 3, "uuid": "0a" * 16}
    device["missing"] = missing
    monkeypatch.setattr(doctor, "probe", lambda: ([device], ""))
    got, out, err = run("doctor")
    assert (got, err) == (code, "")
    assert re.search(rf"^0 +a.* {'0a' * 16} ", out, re.MULTILINE)
    assert "a\\x1b[31m\\ncard" in out and "\x1b" not in out
    monkeypatch.setattr(doctor, "probe", lambda: ([], "the process ended with -6"))
    assert run("doctor")[0] == 2


def test_tiers_and_what_each_lacks():
    lines = doctor.tier_lines([{"tier": 1}, {"tier": 3}, {"tier": 3}])
    assert [line[:6] for line in lines] == ["tier 1", "tier 3", "Embree"]
    assert "lacks ray generation" in lines[0] and "lacks nothing" in lines[1]


@pytest.mark.parametrize(
    ("tier", "missing", "runs", "not_there"),
    [
        (3, "no", "every preset and the path tracer", "raster"),
        (0, None, "whose rays Embree traces", "raster"),
        (0, "no", "the preset raster, which others become (visibility.primary=raster, shadows.method=maps", "every"),
    ],
)
def test_what_runs_on_a_device(monkeypatch, tier, missing, runs, not_there):
    from pica.tracing import embree

    monkeypatch.setattr(embree, "missing", lambda: missing)
    (line,) = doctor.stage_lines([{"name": "card", "tier": tier, "missing": []}])
    assert line.startswith("card runs ") and runs in line and not_there not in line
    assert doctor.stage_lines([{"name": "card", "tier": tier, "missing": ["bindless resources"]}]) == []


def test_a_hidden_feature_is_a_device_without_ray_tracing():
    run = run_doctor(PICA_HIDE_RAY_TRACING="1")
    assert run.returncode == 0
    assert "tier 0: raster only" in run.stdout and "Ready" in run.stdout

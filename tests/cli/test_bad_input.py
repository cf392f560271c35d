"""The real command on bad input: one line, exit code 2, no traceback, no file."""

import os
import subprocess
import sys

import pytest

FAULTS = {
    "missing file": (["missing.gltf"], "missing.gltf"),
    "unknown scene": (["nowhere"], "built-in"),
    "broken file": (["broken.glb"], "broken.glb"),
    "no picture": (["cornell", "--size", "0x0"], "--size 0x0"),
    "unknown setting": (["cornell", "--set", "shadows.tint=red"], "shadows.tint"),
    "missing environment": (["cornell", "--env", "missing.hdr"], "missing.hdr"),
    "broken environment": (["cornell", "--env", "broken.hdr"], "broken.hdr"),
    "unknown device": (["cornell", "--device", "no such device"], "no such device"),
    "no driver": (["cornell"], "pica doctor"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_one_line_and_code_2(fault, tmp_path):
    arguments, says = FAULTS[fault]
    (tmp_path / "broken.glb").write_bytes(b"glTF but not really")
    (tmp_path / "broken.hdr").write_bytes(b"#?RADIANCE nonsense")
    none = {"VK_DRIVER_FILES": "/nonexistent", "VK_ICD_FILENAMES": "/nonexistent"} if fault == "no driver" else {}
    run = subprocess.run(
        [sys.executable, "-m", "pica", "render", *arguments, "-o", "out.png"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120,
        env=os.environ | none,
    )
    assert (run.returncode, run.stdout) == (2, "")
    assert len(run.stderr.splitlines()) == 1, run.stderr
    assert run.stderr.startswith("pica: ") and says in run.stderr
    assert not (tmp_path / "out.png").exists()

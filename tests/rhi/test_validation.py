"""PICA_VALIDATE: what validation says is heard."""

import os
import subprocess
import sys

import pytest

from pica.rhi.validation import KNOWN

MISTAKES = """
import slangpy as spy
from pica.rhi import validation
from pica.rhi.device import Device

device = Device()
device.compute("path_tracer/average.slang")
assert validation.said() == [], "nothing to say of pica"
for _ in range(2):
    encoder = device.handle.create_command_encoder()
    encoder.begin_compute_pass()
    encoder.finish()
print(*validation.said(), *validation.said(), sep="\\n")
commands = device.handle.create_command_encoder().finish()
for _ in range(2):
    device.handle.submit_command_buffer(commands)
print(*validation.said(), sep="\\n")
"""


def told(value: str | None) -> list[str]:
    """What `said` gave, and nothing else may be on stdout; what is known to mean nothing is not on stderr either."""
    environment = {name: text for name, text in os.environ.items() if name != "PICA_VALIDATE"}
    environment |= {} if value is None else {"PICA_VALIDATE": value}
    done = subprocess.run(
        [sys.executable, "-c", MISTAKES], env=environment, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    lines = [line for line in done.stdout.splitlines() if line]
    assert all(line.startswith(("layer: ", "driver: ")) for line in lines)
    assert not any(part in done.stderr for part in KNOWN)
    assert all(line[:80] in " ".join(done.stderr.split()) for line in lines)
    return lines


@pytest.mark.device
def test_mistakes_are_heard_where_they_are_asked_for():
    """Khronos' layer need not be installed; Slang-RHI brings its own."""
    assert told(None) == told("") == told("0") == []
    own, *khronos = told("1")
    assert own.startswith("layer: ICommandEncoder::finish: The command encoder must not be in a render, compute")
    assert all("CommandBuffer" in line for line in khronos)

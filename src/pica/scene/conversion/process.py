"""Starts the process that converts a file, and reads the glTF that it writes."""

import json
import os
import signal
import subprocess
import sys
import warnings
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pica
from pica.errors import SceneError
from pica.files import open_file
from pica.scene import gltf
from pica.scene.conversion.formats import Format
from pica.scene.conversion.worker import LENGTH_BYTES
from pica.scene.limits import Budget, Limits
from pica.scene.model import Scene
from pica.text import printable

_LONGEST_REPLY = 1 << 20
"""Bytes of the JSON of a reply."""
_ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "PXR_WORK_THREAD_LIMIT": "1", "MALLOC_ARENA_MAX": "2"}
"""Threads take address space, which is limited."""


def read(
    path: Path, kind: Format, budget: Budget, limits: Limits, allow_outside: bool, up: str | None, variant: str | None
) -> Scene:
    """Read a file of a format that is converted. `up`: the axis that points up, whatever the file says.

    Raises SceneError, one line with the file and the fault; warns about content that is left out.
    """
    name = printable(path)
    try:
        kind.check_installed()
        with open_file(path, "the file"):  # before a process is started for nothing
            pass
        request = {"path": str(path), "limits": asdict(limits), "allow_outside": allow_outside, "up": up}
        answer, content = _converted(request)
        for device, inode, length in answer["files"]:
            budget.read_file((device, inode), length)
        budget.take(bytes=len(content))
    except SceneError as error:
        raise SceneError(f"{name}: {error}") from None
    for text in answer["warnings"]:
        warnings.warn(f"{name}: {text}", stacklevel=3)
    return gltf.read(path, budget, allow_outside, variant, content)


def _converted(request: dict[str, Any]) -> tuple[dict[str, Any], bytes]:
    """The worker's answer, and the content of a .glb. Raises SceneError."""
    source = str(Path(pica.__file__).parents[1])
    paths = os.pathsep.join(filter(None, [source, os.environ.get("PYTHONPATH")]))
    try:
        process = subprocess.Popen(
            [sys.executable or "python", "-P", "-m", "pica.scene.conversion.worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=os.environ | _ONE_THREAD | {"PYTHONPATH": paths},
        )
    except OSError as error:
        raise SceneError(f"the process that reads it cannot be started ({error.strerror})") from None
    with process:
        try:
            assert process.stdin is not None and process.stdout is not None
            process.stdin.write(json.dumps(request).encode())
            process.stdin.close()
            length = int.from_bytes(process.stdout.read(LENGTH_BYTES), "little")
            text = process.stdout.read(min(length, _LONGEST_REPLY))
            if not length or len(text) < length:
                raise SceneError(_why_it_ended(process.wait()))
            answer = json.loads(text)
            if "fault" in answer:
                raise SceneError(answer["fault"])
            content = process.stdout.read(answer["size"])
            if len(content) < answer["size"]:
                raise SceneError(_why_it_ended(process.wait()))
            return answer, content
        except BrokenPipeError:
            raise SceneError(_why_it_ended(process.wait())) from None
        finally:
            process.kill()


def _why_it_ended(code: int) -> str:
    if hasattr(signal, "SIGPROF") and code == -signal.SIGPROF:
        return "takes more time to read than its bytes account for"
    return f"cannot be read (the process that reads it ended with code {code})"

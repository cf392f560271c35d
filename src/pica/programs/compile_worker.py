"""The worker process of compiler.Compiler: compiles programs, to fill the shader cache."""

import ctypes
import os
import pickle
import signal
import sys
from contextlib import suppress
from typing import Any, BinaryIO

from pica.errors import DeviceError, MaterialTypeError, PicaError, ShaderError, ShapeError
from pica.programs.machine_code import make_machine_code
from pica.programs.material_types import fault_of
from pica.rhi.device import Device

_PR_SET_PDEATHSIG = 1
"""linux/prctl.h."""


def main(parent: int, beside_frames: bool) -> None:
    """Read the adapter's name, then answer each (recipe, types) with the fault, or None; all of it pickled.

    `parent`: the process that owns the worker. When it ends for any reason, so does this one: on Linux at once,
    elsewhere after the current program.
    """
    end_with_parent(parent)
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # output of libraries must not mix with answers
    if beside_frames and hasattr(os, "nice"):
        os.nice(10)  # they go first
    serve(sys.stdin.buffer, answers)


def end_with_parent(parent: int) -> None:
    """Have the system kill this process with the thread that started it, on Linux."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:  # it had ended before
            os._exit(0)


def serve(tasks: BinaryIO, answers: BinaryIO) -> None:
    """Until the input ends."""
    adapter = pickle.load(tasks)
    device: Device | None = None
    with suppress(PicaError, RuntimeError):  # each task reports it
        device = Device(adapter)
    # Slang-RHI caches layouts by address, which another program may get once one is freed; then it crashes.
    linked: list[Any] = []
    while True:
        try:
            recipe, types = pickle.load(tasks)
        except EOFError:
            return
        fault: PicaError | None = None
        try:
            device = device or Device(adapter)
            linked.append(recipe.link(device, types))
            made = recipe.make(device, linked[-1])
            make_machine_code(device, made)
            # Slang-RHI's capture of a ray tracing pipeline lacks parts that NVIDIA's driver shares with another live
            # one: the renderer could not make its own from that and would compile for seconds
            # (docs/how-it-works/architecture.md).
            del made
        except (MaterialTypeError, ShapeError, ShaderError) as error:
            fault = error
        except (PicaError, RuntimeError) as error:
            fault = fault_of(types, error) or DeviceError(str(error))
        pickle.dump(fault, answers)
        answers.flush()

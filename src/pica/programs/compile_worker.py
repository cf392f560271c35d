"""The other end of compiler.Compiler: makes the programs that it is told to, so that the shader cache has them."""

import os
import pickle
import sys
from typing import Any, BinaryIO

import slangpy as spy

from pica.errors import DeviceError, PicaError
from pica.rhi.binding import empty_root
from pica.rhi.device import Device


def main() -> None:
    """Answer each pickled (adapter, recipe, types) on standard input with the fault, or None."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # whatever a library prints is no answer
    if hasattr(os, "nice"):
        os.nice(10)  # frames go first
    serve(sys.stdin.buffer, answers)


def serve(tasks: BinaryIO, answers: BinaryIO) -> None:
    """Until the input ends."""
    device: Device | None = None
    while True:
        try:
            adapter, recipe, types = pickle.load(tasks)
        except EOFError:
            return
        fault: PicaError | None = None
        try:
            device = device or Device(adapter)
            made = recipe.make(device, recipe.link(device, types))
            if device.is_software:
                _run_empty(device, made)
            # What Slang-RHI captures of a ray tracing pipeline lacks whatever NVIDIA's driver shares with another that
            # lives: the renderer could not make its own from that and would compile for seconds (docs/architecture.md).
            del made
        except PicaError as error:
            fault = error
        except RuntimeError as error:
            fault = DeviceError(str(error))
        pickle.dump(fault, answers)
        answers.flush()


def _run_empty(device: Device, made: Any) -> None:
    """Run a program over no threads: lavapipe compiles to machine code at the first run, and caches that too."""
    match made:
        case (program, spy.ComputePipeline() as pipeline):
            root, encoder = empty_root(device.handle, program), device.handle.create_command_encoder()
            compute = encoder.begin_compute_pass()
            compute.bind_pipeline(pipeline, root)
            compute.dispatch((0, 0, 0))
            compute.end()
        case (program, spy.RayTracingPipeline() as pipeline, table):
            root, encoder = empty_root(device.handle, program), device.handle.create_command_encoder()
            rays = encoder.begin_ray_tracing_pass()
            rays.bind_pipeline(pipeline, table, root)
            rays.dispatch_rays(0, (0, 0, 0))
            rays.end()
        case _:  # a draw without vertices compiles nothing, and one with some needs a scene
            return
    device.handle.submit_command_buffer(encoder.finish())
    device.handle.wait_for_idle()

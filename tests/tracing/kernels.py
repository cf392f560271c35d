"""Small shaders written in tests, run on a pica device."""

import itertools

import numpy as np
import slangpy as spy

from pica.rhi.device import Device
from pica.rhi.passes import ComputePass

_numbers = itertools.count()


def kernel(device: Device, source: str, name: str = "kernel") -> ComputePass:
    """A compute pass from source whose entry point is `main`."""
    module = device.handle.load_module_from_source(f"tests_kernel_{next(_numbers)}", source)
    program = device.handle.link_program([module], [module.entry_point("main")])
    pipeline = device.handle.create_compute_pipeline(program)
    return ComputePass(device.handle, name, lambda: (program, pipeline))


def run(device: Device, source: str, threads: int, **values) -> None:
    """Run `main` once and wait for it."""
    compute = kernel(device, source)
    with device.record() as recording:
        compute(recording, (threads, 1, 1), **values)
    device.handle.wait_for_idle()


def read(buffer: spy.Buffer, dtype) -> np.ndarray:
    return buffer.to_numpy().view(np.uint8).reshape(-1).view(dtype)

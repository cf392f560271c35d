"""Machine code of programs, which software devices make late."""

from typing import Any

import slangpy as spy

from pica.rhi import validation
from pica.rhi.binding import empty_root
from pica.rhi.device import Device


def make_machine_code(device: Device, made: Any) -> None:
    """Dispatch a program over no threads: lavapipe generates machine code at the first dispatch, and caches it.

    Does nothing on hardware, whose pipelines are machine code already, and nothing for draws: one without vertices
    compiles nothing, and one with vertices needs a scene. Nor with validation, which rejects empty dispatches. The
    program stays as long as the device, and so this does nothing for renewed ones.
    """
    if not device.is_software or validation.asked() or device.is_renewed:
        return
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
        case _:
            return
    device.shared(_kept).append(program)
    device.handle.submit_command_buffer(encoder.finish())
    device.handle.wait_for_idle()


def _kept(_: Device) -> list[Any]:
    """Programs of whose blocks Slang-RHI has cached the layouts, by address: another program there would crash."""
    return []

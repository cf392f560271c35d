"""One ray effect, two ways to run it: as a ray tracing pipeline, or as ray buffers around a tracer.

An effect is a Slang struct that implements IRayEffect (ray_effect.slang).
"""

import slangpy as spy

from pica.errors import BindingError
from pica.rhi.device import Device
from pica.rhi.slang_files import SlangFile, Source
from pica.tracing.fallbacks import check_traces
from pica.tracing.hit_groups import HitDetail
from pica.tracing.path_pipeline import PathPipeline
from pica.tracing.ray_buffers import BufferEffect, Tracer
from pica.tracing.ray_pipeline import EffectCode, PipelineEffect

PATHS = 1, 1, 2, 4, 8
"""`parts` of paths from pixels: the first ray, the one from there to a light, then twice as many each time."""
ENDED_PATHS = (1,)
"""The same of paths of which most end at their first hit, in a cache: a dispatch for each ray more costs more than it
saves."""

RayEffect = PipelineEffect | PathPipeline | BufferEffect


def ray_effect(
    device: Device,
    module: Source,
    effect: str,
    detail: HitDetail,
    tracer: Tracer | None = None,
    simplified: bool = False,
    with_module: str | None = None,
    parts: tuple[int, ...] = (),
) -> RayEffect:
    """The effect struct `effect` of `module`, run through ray buffers and `tracer`
    if one is given, otherwise as a ray tracing pipeline.

    `simplified`: its surface rays evaluate simplified materials (RTG 19, 19.3.2.1; docs/how-it-works/materials.md);
    camera rays never do. `with_module`: a Slang file with implementations for the effect's `extern` declarations.
    `parts`: for paths, few of them long: how many rays to trace before active paths are compacted, and
    so on (path_pipeline.py; buffers compact after each ray).
    Raises BindingError if the module does not compile (ShaderError: one outside of the package), DeviceError without
    a tracer.
    """
    code = EffectCode(module, effect, detail, simplified, with_module)
    if tracer is None:
        check_traces(device, code.name)
    try:
        if tracer is not None:
            return BufferEffect(device, code, tracer)
        if parts:
            return PathPipeline(device, code, parts)
        return PipelineEffect(device, code)
    except (RuntimeError, spy.SlangCompileError) as error:
        if isinstance(module, SlangFile):
            raise module.fault(error) from None
        raise BindingError(f"{module}: {error}") from error

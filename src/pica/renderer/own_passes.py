"""Passes from Slang files of a program's own, for `Renderer.insert`."""

from pathlib import Path
from typing import TYPE_CHECKING, Any
from weakref import ref

from pica.errors import PicaError, ShaderError, shown
from pica.programs.library import programs
from pica.programs.recipes import MaterialPass
from pica.rhi.device import Device
from pica.rhi.passes import ComputePass, Recording
from pica.rhi.slang_files import SlangFile
from pica.scene.values import checked, choice, instance
from pica.tracing.hit_groups import HitDetail
from pica.tracing.ray_effect import RayEffect, ray_effect

if TYPE_CHECKING:
    from pica.renderer.renderer import Renderer


def compute_pass(
    device: Device, path: str | Path, entry: str = "main", *, materials: bool = False
) -> ComputePass | MaterialPass:
    """A compute pass for `FrameGraph.add`, from an entry point of any Slang file. It may import pica's modules.

    `materials`: it is compiled for coats, sheen and the material types of the scene, which is among its inputs as
    `scene`. Raises ShaderError with file and line for a fault in the file.
    """
    checked("compute_pass: device", instance(Device), device, PicaError)
    file = SlangFile.read(path)
    loaded = file.loaded(device)
    if not any(point.name == entry for point in loaded.entry_points):
        raise ShaderError(f'{file.path}: no entry point {shown(entry)}, which needs [shader("compute")]')
    if materials:
        return programs(device).compute(file, entry)
    return device.compute(file, entry)


class RayPass:
    """A ray effect for `FrameGraph.add`; see `ray_pass`."""

    def __init__(self, renderer: "Renderer", file: SlangFile, struct: str, detail: HitDetail) -> None:
        """As `ray_pass`."""
        self.name = file.path.stem
        self._renderer, self._file, self._struct, self._detail = ref(renderer), file, struct, detail
        self._tracer = renderer.tracer
        self._effect = self._made(renderer)

    def _made(self, renderer: "Renderer") -> RayEffect:
        return ray_effect(renderer.device, self._file, self._struct, self._detail, renderer.tracer)

    def __call__(self, recording: Recording, grid: tuple[int, ...], /, **values: Any) -> None:
        """Record the rays, over a grid of (width, height)."""
        renderer = self._renderer()
        if renderer is not None and renderer.tracer is not self._tracer:  # the settings have changed the tracer
            self._tracer, self._effect = renderer.tracer, self._made(renderer)
        self._effect(recording, (grid[0], grid[1]), **values)


def ray_pass(renderer: "Renderer", path: str | Path, struct: str, detail: HitDetail = "hit") -> RayPass:
    """A ray effect for `FrameGraph.add`, traced as the renderer's own: by pipelines, or by ray buffers and Embree.

    `struct`: the implementation of IRayEffect (tracing/ray_effect.slang) in any Slang file. `detail`: "hit" for hit
    positions, "surface" for materials too. One of its inputs is `scene`. Raises ShaderError with file and line for a
    fault in the file, DeviceError without ray tracing.
    """
    file = SlangFile.read(path)
    checked("ray_pass: detail", choice("hit", "surface"), detail, PicaError)
    if file.loaded(renderer.device).layout.find_type_by_name(struct) is None:
        raise ShaderError(
            f"{file.path}: no struct {shown(struct)}; with a `module` line in the file, it must be public"
        )
    return RayPass(renderer, file, struct, detail)

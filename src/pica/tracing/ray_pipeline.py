"""Ray effects as ray tracing pipelines: a ray generation shader that loops over the effect's rays (tiers 2 and 3)."""

from dataclasses import dataclass
from typing import Any

import slangpy as spy

from pica.gpu_scene.view import SceneView
from pica.programs.library import programs
from pica.programs.material_types import STANDARD_ONLY, Bundle, MaterialTypeSet
from pica.programs.recipes import ForTypes
from pica.programs.scene_features import DIFFUSE_TRANSMISSION, LOBES, supported_features
from pica.programs.shape_types import modules_for
from pica.rhi.binding import ProgramParameters
from pica.rhi.device import Device
from pica.rhi.passes import Recording
from pica.rhi.shader_blocks import blocks_of
from pica.rhi.slang_files import SlangFile, Source, import_path, stem, unique
from pica.tracing.hit_groups import HitDetail, hit_group

_PAYLOAD, _MORE = 64, {LOBES: 12, DIFFUSE_TRANSMISSION: 4}
"""Bytes of shaders/surface.slang: PackedSurface, and what features add."""
_EFFECT_MODULE = "tracing/ray_effect.slang"
_RAY_GENERATION = """
import tracing.ray_pipeline;
import {module};
[shader("raygeneration")]
void main() {{ runPipeline<{effect}, HitDetail.{detail}>(DispatchRaysIndex().xy); }}
"""


@dataclass(frozen=True)
class ShaderSource:
    """A Slang module: source under its own name, or (without text) a file below the package."""

    name: str
    text: str = ""
    effect: Source = ""
    """Where the effect is that it imports."""

    def loaded(self, device: Device) -> spy.SlangModule:
        """The module; a device loads it once."""
        if isinstance(self.effect, SlangFile):
            self.effect.loaded(device)  # which Slang would not find
        return device.module(self.name, self.text or None)


@dataclass(frozen=True)
class RayRecipe:
    """A ray generation shader linked with the hit shaders of some material types: one hit group a type."""

    generation: ShaderSource
    detail: HitDetail
    simplified: bool
    with_module: str | None = None
    """As `ray_effect`'s."""

    def link(
        self, device: Device, variant: MaterialTypeSet
    ) -> tuple[spy.ShaderProgram, list[spy.HitGroupDesc], list[str], int]:
        """The program, its hit groups and their names, bytes of its payload. `variant`: the material types."""
        generation = self.generation.loaded(device)
        shaders = device.module(_EFFECT_MODULE)
        modules = [generation, shaders, *modules_for(device, variant)]
        if self.with_module is not None:
            modules.append(device.module(self.with_module))
        entries = [generation.entry_point("main"), shaders.entry_point(f"{self.detail}Miss")]
        if self.detail == "hit":
            entries.append(shaders.entry_point("hitClosest"))
        groups = []
        for entry in variant:
            if isinstance(entry, Bundle):
                continue
            made = hit_group(device, entry, self.detail, self.simplified)
            modules, entries = [*modules, *made.modules], [*entries, *made.entries]
            groups.append(made.group)
        # Features have a position in the table too, because positions are types' numbers; rays never use it.
        names = [(variant[0] if isinstance(entry, Bundle) else entry).name for entry in variant]
        payload = _PAYLOAD + sum(_MORE.get(feature, 0) for feature in supported_features(variant))
        return device.session.link_program(modules, entries), groups, names, payload

    def make(
        self, device: Device, linked: tuple[spy.ShaderProgram, list[spy.HitGroupDesc], list[str], int]
    ) -> tuple[spy.ShaderProgram, spy.RayTracingPipeline, spy.ShaderTable]:
        """Program, pipeline and shader table."""
        program, groups, names, payload = linked
        pipeline = device.handle.create_ray_tracing_pipeline(
            program=program, hit_groups=groups, max_recursion=1, max_ray_payload_size=payload
        )
        table = device.handle.create_shader_table(
            program=program,
            ray_gen_entry_points=["main"],
            miss_entry_points=[f"{self.detail}Miss"],
            hit_group_names=names,
        )
        return program, pipeline, table


class _RayProgram:
    def __init__(
        self,
        device: Device,
        name: str,
        program: spy.ShaderProgram,
        pipeline: spy.RayTracingPipeline,
        table: spy.ShaderTable,
    ) -> None:
        self._name, self._pipeline, self._table = name, pipeline, table
        self._device, self._program = device.handle, program
        self._parameters: dict[tuple[int, int], ProgramParameters] = {}

    def _parameters_of(self, part: int, variant: int) -> ProgramParameters:
        """One set for each part and variant, because alternating values would be bound again each time."""
        parameters = self._parameters.get((part, variant))
        if parameters is None:
            parameters = self._parameters[part, variant] = ProgramParameters(self._device, self._name, self._program)
        return parameters

    def __call__(self, recording: Recording, grid: tuple[int, int], values: dict[str, Any]) -> None:
        parameters = self._parameters_of(values.get("part", 0), recording.variant)
        parameters.bind_all(values)
        recording.profiler.begin(recording.encoder, self._name)
        encoder = recording.encoder.begin_ray_tracing_pass()
        encoder.bind_pipeline(self._pipeline, self._table, parameters.root)
        encoder.dispatch_rays(0, (grid[0], grid[1], 1))
        encoder.end()
        recording.profiler.end(recording.encoder)


@dataclass(frozen=True)
class EffectCode:
    """What a ray effect is made of, whatever runs it; `ray_effect` has what its parts mean."""

    module: Source
    effect: str
    detail: HitDetail
    simplified: bool = False
    with_module: str | None = None

    @property
    def name(self) -> str:
        """What the profiler calls it."""
        return stem(self.module)

    @property
    def blocks(self) -> frozenset[str]:
        """Names of its parameter blocks."""
        return blocks_of(self.module, *([self.with_module] if self.with_module else [])) | {"scene"}

    def shaders(self, kind: str, text: str, **words: object) -> ShaderSource:
        """The module of entry points that run it. `text`: with {module}, {effect}, {detail} and `words`."""
        source = text.format(module=import_path(self.module), effect=self.effect, detail=self.detail, **words)
        return ShaderSource(f"{unique(self.module)}_{self.effect}_{self.detail}_{kind}", source, self.module)

    def recipe(self, generation: ShaderSource) -> RayRecipe:
        """Of the program with this ray generation shader."""
        return RayRecipe(generation, self.detail, self.simplified, self.with_module)


def types_of(values: dict[str, Any]) -> MaterialTypeSet:
    """The material types of the scene among a pass's parameters."""
    scene: SceneView | None = values.get("scene")
    return STANDARD_ONLY if scene is None else scene.material_types


class RayPipeline:
    """A ray generation shader with the hit shaders for its detail and for the scene's material types."""

    def __init__(self, device: Device, name: str, recipe: RayRecipe) -> None:
        self.name, self.recipe = name, recipe
        recipe.generation.loaded(device)  # a fault shows here, not in the first frame
        self.program = ForTypes(programs(device), recipe, lambda made: _RayProgram(device, name, *made))

    def __call__(self, recording: Recording, grid: tuple[int, int], /, **values: Any) -> None:
        """Record the effect, or its part `part`, over a (width, height) grid with these parameters."""
        scene: SceneView | None = values.get("scene")
        if scene is not None:
            values["tlas"] = scene.rt_scene.structure
        self.program.of(types_of(values))(recording, grid, values)


class PipelineEffect(RayPipeline):
    """The effect as one ray generation shader that loops over its rays (tiers 2 and 3)."""

    def __init__(self, device: Device, code: EffectCode) -> None:
        super().__init__(device, code.name, code.recipe(code.shaders("pipeline", _RAY_GENERATION)))
        self.blocks = code.blocks

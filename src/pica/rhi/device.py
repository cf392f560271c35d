"""The open device: makes buffers, textures and passes, and keeps the shader caches."""

import os
import sys
import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.errors import DeviceError
from pica.rhi.adapters import HELP, DeviceInfo, choose, describe
from pica.rhi.background import Compiler
from pica.rhi.binding import ParameterBlock
from pica.rhi.material_types import STANDARD_ONLY, MaterialTypes, MaterialTypeSet
from pica.rhi.passes import ComputePass, RasterPass, RasterState
from pica.rhi.profiler import Profiler
from pica.rhi.programs import ComputeRecipe, ForTypes, RasterRecipe, Recipe, linked
from pica.rhi.shape_types import ShapeTypes

T = TypeVar("T")
PACKAGE = Path(__file__).resolve().parents[1]
_READ_WRITE = spy.BufferUsage.shader_resource | spy.BufferUsage.unordered_access
_TEXTURE = spy.TextureUsage.shader_resource | spy.TextureUsage.unordered_access


def cache_folder() -> Path:
    """Where compiled shaders are kept between runs; PICA_CACHE overrides the system's usual place."""
    if "PICA_CACHE" in os.environ:
        return Path(os.environ["PICA_CACHE"])
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local")) / "pica" / "cache"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "pica"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "pica"


@dataclass
class DeviceRecording:
    """What passes record into outside of any frame."""

    encoder: spy.CommandEncoder
    profiler: Profiler


class Device:
    """A graphics device with ray tracing pipelines.

    `name`: part of the adapter's name; None takes hardware before software. Raises DeviceError when there
    is no such device or it lacks what pica needs.
    """

    def __init__(self, name: str | None = None) -> None:
        adapter = choose(name)
        self._cache = cache = cache_folder().resolve()
        try:
            cache.mkdir(parents=True, exist_ok=True)
            caches: dict[str, Any] = {"shader_cache_path": cache / "shaders", "module_cache_path": cache / "modules"}
        except OSError:  # a read-only home: slower starts, nothing else
            caches = {}
        try:
            self.handle = spy.Device(
                type=spy.DeviceType.vulkan,
                adapter_luid=adapter.luid,
                compiler_options={"include_paths": [PACKAGE], "warnings_as_errors": []},
                enable_rhi_validation="PICA_VALIDATE" in os.environ,
                enable_hot_reload=False,
                **caches,
            )
        except RuntimeError as error:
            raise DeviceError(
                f"device {adapter.name!r} cannot be opened: {str(error).splitlines()[0]}; {HELP}"
            ) from None
        self._block_programs: dict[str, spy.ShaderProgram] = {}
        self._kept: dict[tuple[Recipe[Any], MaterialTypeSet], Any] = {}
        self._linked: dict[tuple[Recipe[Any], MaterialTypeSet], Any] = {}
        self.for_types: weakref.WeakSet[ForTypes[Any, Any]] = weakref.WeakSet()
        """The passes on this device that follow the material types in use."""
        self.info: DeviceInfo = describe(self.handle, adapter)
        if self.info.missing:
            raise DeviceError(f"device {self.name!r} lacks {', '.join(self.info.missing)}; {HELP}")
        self.memory = 0
        """Bytes of device memory in the buffers, textures and structures that pica made and keeps."""
        self.peak_memory = 0
        """The most that `memory` has been."""

    @property
    def name(self) -> str:
        """The adapter's name."""
        return self.info.name

    @property
    def tier(self) -> int:
        """What the device can trace, 1 to 3 (seed 000, 19.2.2)."""
        return self.info.tier

    @property
    def is_software(self) -> bool:
        """True for a driver that runs on the CPU."""
        return self.info.type == "software"

    @cached_property
    def profiler(self) -> Profiler:
        """GPU times of the passes on this device."""
        return Profiler(self.handle)

    @cached_property
    def material_types(self) -> MaterialTypes:
        """The material types that this device has compiled."""
        return MaterialTypes(self.handle)

    @cached_property
    def shape_types(self) -> ShapeTypes:
        """The shapes that this device has compiled."""
        return ShapeTypes(self.handle)

    def linked(self, types: MaterialTypeSet) -> list[spy.SlangModule]:
        """What to link with a program so that it knows these material types and the shapes among them."""
        return [*self.material_types.linked(types), *self.shape_types.linked(types)]

    @cached_property
    def compiler(self) -> Compiler:
        """The process that compiles what comes to a running renderer."""
        compiler = Compiler(self.name, self._cache)
        weakref.finalize(self, compiler.close)
        return compiler

    @contextmanager
    def record(self) -> Iterator[DeviceRecording]:
        """Record work outside of any frame; it is submitted at the end of the block."""
        recording = DeviceRecording(self.handle.create_command_encoder(), self.profiler)
        yield recording
        self.handle.submit_command_buffer(recording.encoder.finish())

    @cached_property
    def scatter(self) -> ComputePass:
        """Writes rows to their places in tables (tables.py)."""
        return self.compute("rhi/scatter.slang")

    def count_memory(self, size: int) -> None:
        """Book `size` bytes taken (or, negative, given back)."""
        self.memory += size
        self.peak_memory = max(self.peak_memory, self.memory)

    def give_back(self, *resources: spy.Buffer | spy.Texture) -> None:
        """Book resources as no longer needed; each goes when its last user does."""
        for resource in resources:
            self.count_memory(-resource.memory_usage.device)

    def buffer(
        self,
        label: str,
        *,
        data: NDArray[Any] | None = None,
        size: int = 0,
        struct_size: int = 0,
        usage: spy.BufferUsage = _READ_WRITE,
    ) -> spy.Buffer:
        """A buffer with this data, or of `size` bytes; `struct_size` in bytes for structured ones."""
        content: dict[str, Any] = {"size": max(size, 4)}
        if data is not None and data.nbytes:
            content = {"data": np.ascontiguousarray(data)}
        buffer = self.handle.create_buffer(usage=usage, struct_size=struct_size, label=label, **content)
        self.count_memory(buffer.memory_usage.device)
        return buffer

    def structured(self, label: str, data: NDArray[Any], usage: spy.BufferUsage = _READ_WRITE) -> spy.Buffer:
        """A structured buffer with one element per item of the (n,) structured or (n, k) array."""
        size = data.dtype.itemsize if data.dtype.names else data.itemsize * int(np.prod(data.shape[1:], dtype=int))
        flat = np.ascontiguousarray(data).view(np.uint8).reshape(-1)
        if not len(flat):  # an empty buffer still needs an element to be bound
            flat = np.zeros(size, np.uint8)
        return self.buffer(label, data=flat, struct_size=size, usage=usage)

    def texture(
        self,
        label: str,
        texture_format: spy.Format,
        size: tuple[int, int],
        usage: spy.TextureUsage = _TEXTURE,
        layers: int | None = None,
    ) -> spy.Texture:
        """A texture of (width, height) texels without content; an array of textures where `layers` are told."""
        texture = self.handle.create_texture(
            type=spy.TextureType.texture_2d if layers is None else spy.TextureType.texture_2d_array,
            array_length=layers or 1,
            format=texture_format,
            width=size[0],
            height=size[1],
            usage=usage,
            label=label,
        )
        self.count_memory(texture.memory_usage.device)
        return texture

    def sampler(self, **description: Any) -> spy.Sampler:
        """A sampler; keywords as slangpy.SamplerDesc."""
        return self.handle.create_sampler(**description)

    def kept(self, recipe: Recipe[T], types: MaterialTypeSet) -> T:
        """What the recipe makes for these material types, made once a device."""
        key = recipe, types
        if key not in self._kept:
            self.link(recipe, types)
            self._kept[key] = recipe.make(self, self._linked.pop(key))
        found: T = self._kept[key]
        return found

    def link(self, recipe: Recipe[T], types: MaterialTypeSet) -> None:
        """The first part of what `kept` does, for it to find."""
        key = recipe, types
        if key not in self._kept and key not in self._linked:
            self._linked[key] = recipe.link(self, types)

    def retire(self, types: MaterialTypeSet) -> None:
        """Forget the programs for these types, unless a pass still uses them."""
        if types != STANDARD_ONLY and not any(types == user.types for user in self.for_types):
            self._kept = {key: made for key, made in self._kept.items() if key[1] != types}
            self._linked = {key: linked for key, linked in self._linked.items() if key[1] != types}

    def parameter_block(self, module: str, name: str) -> ParameterBlock:
        """The block `name` that `module` (a path below the package) declares."""
        # Slang-RHI remembers a block's layout by its address, which another program's may take once this one is freed.
        if module not in self._block_programs:
            self._block_programs[module] = linked(self, module, [], STANDARD_ONLY)
        return ParameterBlock(self.handle, self._block_programs[module], module, name)

    def compute(self, module: str, entry: str = "main", name: str | None = None) -> ComputePass:
        """A compute pass from a file below the package; `name` is what the profiler calls it."""
        made = self.kept(ComputeRecipe(module, entry), STANDARD_ONLY)
        return ComputePass(self.handle, name or Path(module).stem, *made)

    def compute_for_types(
        self, module: str, entry: str = "main", name: str | None = None
    ) -> ForTypes[tuple[spy.ShaderProgram, spy.ComputePipeline], ComputePass]:
        """As `compute`, for a pass that evaluates materials: call what this gives with the types in use."""
        label = name or Path(module).stem
        return ForTypes(self, ComputeRecipe(module, entry), lambda made: ComputePass(self.handle, label, *made))

    def raster(self, module: str, entries: tuple[str, ...], state: RasterState, name: str | None = None) -> RasterPass:
        """A raster pass from the vertex and, if any, fragment entry points of a file."""
        made = self.kept(RasterRecipe(module, entries, state), STANDARD_ONLY)
        return RasterPass(self.handle, name or Path(module).stem, *made)

    def raster_for_types(
        self, module: str, entries: tuple[str, ...], state: RasterState, name: str | None = None
    ) -> ForTypes[tuple[spy.ShaderProgram, spy.RenderPipeline], RasterPass]:
        """As `raster`, for a pass that evaluates materials: call what this gives with the types in use."""
        label = name or Path(module).stem
        return ForTypes(self, RasterRecipe(module, entries, state), lambda made: RasterPass(self.handle, label, *made))

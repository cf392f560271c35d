"""The open device: makes buffers, textures and passes, and holds the shader caches."""

import shutil
import time
import warnings
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from copy import copy
from functools import partial
from pathlib import Path
from threading import Lock
from typing import Any, TypeVar
from weakref import WeakKeyDictionary, finalize

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.caches.places import LONGEST, MODULES, SHADERS, caches, longest_file
from pica.errors import DeviceError
from pica.rhi import cuda, forked, validation
from pica.rhi.adapters import HELP, TRACES, DeviceInfo, adapter_of, choose, describe
from pica.rhi.binding import ParameterBlock, word_of_rows
from pica.rhi.fair_lock import FairLock
from pica.rhi.handles import most_handles
from pica.rhi.memory_use import MemoryUse
from pica.rhi.passes import ComputePass, DeviceRecording, RasterPass, RasterState, Recording
from pica.rhi.profiler import Profiler
from pica.rhi.recipes import ComputeRecipe, RasterRecipe, Recipe, linked
from pica.rhi.shader_blocks import content_of, forget_files
from pica.rhi.slang_files import Source, stem
from pica.rhi.slang_sessions import COMPILER, PACKAGE, new_session
from pica.rhi.submissions import Submissions
from pica.text import first_line

T = TypeVar("T")
P = TypeVar("P", ComputePass, RasterPass)
_READ_WRITE = spy.BufferUsage.shader_resource | spy.BufferUsage.unordered_access
_BUILD_INPUT = spy.BufferUsage.acceleration_structure_build_input
_SHARE_OF_FILE = 0.4
"""The rest is for staging copies, and for allocations of drivers and Slang-RHI."""
_TEXTURE = spy.TextureUsage.shader_resource | spy.TextureUsage.unordered_access


class Device:
    """A graphics device; `open_device` shares one in a process. One without ray tracing pipelines rasterizes
    (docs/guide/devices.md).

    `name`: part of the adapter's name; None prefers hardware to software. Raises DeviceError if there
    is no such device or it lacks required features.
    """

    def __init__(self, name: str | None = None, existing: spy.Device | None = None) -> None:
        """`existing`: a SlangPy device that the program has opened by itself, and closes by itself."""
        forked.check()
        # Workers could not fill the cache of a device that others have opened.
        self.cache = cache = caches() if existing is None else None
        """Folder of compiled shaders; None: none are stored."""
        adapter = choose(name) if existing is None else adapter_of(existing)
        self._longest_file = longest_file()
        self.handle = existing or _opened(adapter, cache, cuda.is_wanted(adapter))
        self.handles = most_handles(adapter, existing is not None)
        """Of textures, at most."""
        self.session = self.handle.slang_session if existing is None else new_session(self.handle, cache)
        """Loads and links shaders."""
        forked.watch()
        self.lock = FairLock(self._check)
        """For `with`: exclusive use of the device, for a frame at most so that other threads get theirs.
        Raises DeviceError if the device is closed or belongs to another process."""
        self._callbacks: list[Callable[[], object]] = []
        self._closing = finalize(self, _close, self.handle if existing is None else None, self._callbacks)
        self.key = _key_of(adapter, existing)
        """Identifies the adapter, or an existing device."""
        self._block_programs: dict[tuple[str, str], spy.ShaderProgram] = {}
        self._products: dict[tuple[Recipe[Any], Hashable], Any] = {}
        self._linked: dict[tuple[Recipe[Any], Hashable], Any] = {}
        self._plans: WeakKeyDictionary[ComputePass | RasterPass, Recipe[Any]] = WeakKeyDictionary()
        self._shared: dict[Callable[[Device], Any], Any] = {}
        self.info: DeviceInfo = describe(self.handle, adapter)
        if self.info.missing:
            raise DeviceError(f"device {self.name!r} lacks {', '.join(self.info.missing)}; {HELP}")
        if self.is_software and self._longest_file < LONGEST:
            raise DeviceError(
                f"device {self.name!r} keeps its memory in a file, which may have {self._longest_file >> 20} MiB here "
                f"(ulimit -f), and {LONGEST >> 20} are needed"
            )
        self.submissions = Submissions(self.handle, polls=not self.is_software)
        self.profiler = Profiler(self.handle)
        """GPU times of the passes on this device."""
        self._memory = MemoryUse()
        self._scope_memory = MemoryUse()
        """The part of `_memory` that was allocated through this object; see `memory_scope`."""
        self._root: Device | None = None
        """Of a memory scope, the device it was made from."""
        self._opened: Device | None = None
        """Of one with renewed programs, the device that was opened."""

    def close(self) -> None:
        """Wait for the device and release it; any later use of its objects is an error."""
        if self.closed:
            return
        opened = self._opened or self._root or self
        with self.lock:
            if _OPEN.get(self.key) is opened:
                del _OPEN[self.key]
            self._closing()
            for each in (opened, self):
                for products in (each._block_programs, each._products, each._linked, each._shared):
                    products.clear()

    @property
    def closed(self) -> bool:
        """Whether it was closed."""
        return not self._closing.alive

    def at_close(self, call: Callable[[], object]) -> None:
        """Call this when the device is closed or dropped; it must not hold a reference to the device."""
        self._callbacks.append(call)

    def _check(self) -> None:
        forked.check()
        if self.closed:
            raise DeviceError(f"device {self.name!r}: it is closed, and so is all that was made on it")

    @property
    def name(self) -> str:
        """The adapter's name."""
        return self.info.name

    @property
    def tier(self) -> int:
        """Ray tracing tier, 0 to 3 (RTG 19, 19.2.2)."""
        return self.info.tier

    @property
    def traces_rays(self) -> bool:
        """Whether it has ray tracing pipelines; otherwise it has no acceleration structures."""
        return self.tier >= TRACES

    @property
    def built_from(self) -> spy.BufferUsage:
        """Usage of buffers that acceleration structures are built from."""
        return _READ_WRITE | _BUILD_INPUT if self.traces_rays else _READ_WRITE

    @property
    def is_software(self) -> bool:
        """True for a driver that runs on the CPU."""
        return self.info.type == "software"

    def shared(self, kind: "Callable[[Device], T]") -> T:
        """One object per device for upper layers: `kind(device)`, made when first requested."""
        if kind not in self._shared:
            self._shared[kind] = kind(self._root or self)
        product: T = self._shared[kind]
        return product

    @contextmanager
    def record(self) -> Iterator[DeviceRecording]:
        """Record work outside of any frame; it is submitted at the end of the block."""
        with self.lock:
            recording = DeviceRecording(self.handle.create_command_encoder(), self.profiler)
            yield recording
            self.submissions.submit(recording.encoder)

    def submit(self, recording: Recording) -> int:
        """Submit what is recorded; returns its number. The recording goes on with another encoder."""
        submission = self.submissions.submit(recording.encoder)
        recording.encoder = self.handle.create_command_encoder()
        return submission

    def finish(self, recording: Recording) -> float:
        """As `submit`, and wait for it; returns the seconds."""
        started = time.perf_counter()
        self.submissions.wait(self.submit(recording))
        return time.perf_counter() - started

    @property
    def scatter(self) -> ComputePass:
        """Writes rows to their places in tables (tables.py)."""
        return self.shared(_scatter)

    def memory_scope(self) -> "Device":
        """The same device as a memory scope: memory that its users allocate and do not give back is booked as released
        once the scope is dropped. Resources of one lifetime belong in one scope."""
        scope = copy(self)
        scope._root = self._root or self
        scope._scope_memory = MemoryUse()
        release = partial(self._memory.release, scope._scope_memory)
        finalize(scope, self.lock.defer, release).atexit = False
        return scope

    def renewed(self, package: Path = PACKAGE) -> "Device":
        """The same device without any program or shared object: it makes them of the Slang files of `package` as they
        are now. What was made before keeps its own."""
        renewed = self.memory_scope()
        renewed._opened, renewed._root = self._opened or self._root or self, None
        renewed.session = new_session(self.handle, self.cache, package)
        renewed._products, renewed._linked, renewed._shared = {}, {}, {}
        renewed._plans = WeakKeyDictionary()
        forget_files()
        return renewed

    @property
    def is_renewed(self) -> bool:
        """Whether `renewed` has made it: its programs may be freed before the device is."""
        return self._opened is not None

    @property
    def memory(self) -> int:
        """Bytes of device memory in the buffers, textures and structures that pica has allocated."""
        self.lock.run_deferred()
        return self._memory.now

    @property
    def peak_memory(self) -> int:
        """The most that `memory` has been."""
        return self._memory.peak

    def count_memory(self, size: int) -> None:
        """Book `size` bytes as allocated (or, if negative, as released). Raises DeviceError as `_check_room`."""
        self._check_room(size)
        self._memory.count(size)
        self._scope_memory.count(size)

    def _check_room(self, size: int) -> None:
        """Raises DeviceError before a software device needs more than its file may have: that would end the process."""
        if size > 0 and self.is_software and self._memory.now + size > _SHARE_OF_FILE * self._longest_file:
            fault = f"no room for {size:,} bytes more: it keeps its memory in a file (ulimit -f)"
            raise DeviceError(f"device {self.name!r} has {fault}")

    def give_back(self, *resources: spy.Buffer | spy.Texture) -> None:
        """Book resources as released; each is freed with its last user."""
        for resource in resources:
            self.count_memory(-resource.memory_usage.device)

    @contextmanager
    def allocating(self, what: str) -> Iterator[None]:
        """Raises DeviceError if the device cannot allocate memory for resources made within the block."""
        try:
            yield
        except RuntimeError as error:
            raise DeviceError(f"device {self.name!r} has no memory for {what}") from error

    def buffer(
        self,
        label: str,
        *,
        data: NDArray[Any] | None = None,
        size: int = 0,
        struct_size: int = 0,
        usage: spy.BufferUsage = _READ_WRITE,
    ) -> spy.Buffer:
        """A buffer with this data, or of `size` bytes; `struct_size` in bytes for structured ones.

        A shader may read it as Buffer<uint4> if that is a multiple of 16, as Buffer<uint3> if it is 12, else as
        Buffer<uint> (rhi/rows.slang)."""
        content: dict[str, Any] = {"size": max(size, 4)}
        if data is not None and data.nbytes:
            size = data.nbytes
            content = {"data": np.require(data, requirements=["C", "W"])}  # SlangPy takes no read-only arrays
        self._check_room(size)
        with self.allocating(f"{label}, {size:,} bytes"):
            buffer = self.handle.create_buffer(
                usage=usage, struct_size=struct_size, format=word_of_rows(struct_size)[0], label=label, **content
            )
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
        mips: int = 1,
    ) -> spy.Texture:
        """A texture of (width, height) texels without content; an array of textures if `layers` is given.

        `mips`: number of mip levels."""
        with self.allocating(f"{label}, {size[0]}x{size[1]} texels"):
            texture = self.handle.create_texture(
                type=spy.TextureType.texture_2d if layers is None else spy.TextureType.texture_2d_array,
                array_length=layers or 1,
                mip_count=mips,
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

    def product(self, recipe: Recipe[T], variant: Hashable = ()) -> T:
        """The product of a recipe for a variant, made once per device."""
        key = recipe, variant
        if key not in self._products:
            self.link(recipe, variant)
            self._products[key] = recipe.make(self, self._linked.pop(key))
        product: T = self._products[key]
        return product

    def link(self, recipe: Recipe[T], variant: Hashable = ()) -> None:
        """The first, slow part of `product`."""
        key = recipe, variant
        if key not in self._products and key not in self._linked:
            self._linked[key] = recipe.link(self, variant)

    def has(self, recipe: Recipe[Any], variant: Hashable = ()) -> bool:
        """Whether `product` has the product already."""
        return (recipe, variant) in self._products

    @property
    def planned(self) -> list[Recipe[Any]]:
        """Recipes of `compute` and `raster` passes that are still in use and not made yet."""
        used = [recipe for user, recipe in self._plans.items() if not user.is_replaced]
        return [recipe for recipe in dict.fromkeys(used) if not self.has(recipe)]

    def forget(self, variant: Hashable) -> None:
        """Release the products for a variant."""
        for products in (self._products, self._linked):
            for key in [key for key in products if key[1] == variant]:
                del products[key]

    def module(self, name: str, text: str | None = None, path: Path | None = None) -> spy.SlangModule:
        """A Slang module: a file below the package, or a text under another name and an optional `path`."""

        def load() -> spy.SlangModule:
            session = self.session
            return session.load_module(name) if text is None else session.load_module_from_source(name, text, path)

        try:
            return load()
        except (RuntimeError, spy.SlangCompileError) as error:
            if self.cache is None or "error[" in str(error):  # a fault of the source, not of the cache
                raise
            kept = self.cache / MODULES
            shutil.rmtree(kept, ignore_errors=True)
            warnings.warn(f"{kept} is damaged and was removed: modules are compiled anew", stacklevel=2)
            return load()

    def parameter_block(self, module: str, name: str) -> ParameterBlock:
        """The block `name` that `module` (a path below the package) declares."""
        # Slang-RHI caches a block's layout by its address, which another program may get once this one is freed.
        # So they stay, with all that their session has loaded, and are used again while their files are the same.
        key = module, content_of(module)
        if key not in self._block_programs:
            self._block_programs[key] = linked(self, module, [])
        return ParameterBlock(self.handle, self._block_programs[key], module, name)

    def compute(self, module: Source, entry: str = "main", name: str | None = None) -> ComputePass:
        """A compute pass from a file; `name` is its name in the profiler.

        Its program is made at first use, or before by `programs.preparation`. Raises DeviceError then if the file
        does not compile.
        """
        return self.compute_of(ComputeRecipe(module, entry), name or stem(module))

    def compute_of(self, recipe: Recipe[Any], name: str) -> ComputePass:
        """The same of a recipe that depends on no material types."""
        plain = recipe if isinstance(recipe, ComputeRecipe) else None
        return self._planned(recipe, ComputePass(self.handle, name, partial(self.product, recipe), plain))

    def raster(self, module: str, entries: tuple[str, ...], state: RasterState, name: str | None = None) -> RasterPass:
        """A raster pass from the vertex and, if any, fragment entry points of a file; as `compute`."""
        recipe = RasterRecipe(module, entries, state)
        return self._planned(recipe, RasterPass(self.handle, name or Path(module).stem, partial(self.product, recipe)))

    def _planned(self, recipe: Recipe[Any], made: P) -> P:
        self._plans[made] = recipe
        return made


def _scatter(device: Device) -> ComputePass:
    return device.compute("rhi/scatter.slang")


def _opened(adapter: spy.AdapterInfo, cache: Path | None, share: bool = False) -> spy.Device:
    """`share`: with CUDA."""
    try:
        return spy.Device(
            type=spy.DeviceType.vulkan,
            adapter_luid=adapter.luid,
            enable_cuda_interop=share,
            compiler_options=COMPILER,
            enable_rhi_validation=validation.asked(),
            enable_debug_layers=validation.asked(),
            enable_hot_reload=False,
            bindless_options=spy.BindlessDesc(texture_count=most_handles(adapter, is_existing=False)),
            shader_cache_path=cache and cache / SHADERS,
            module_cache_path=cache and cache / MODULES,
        )
    except RuntimeError as error:
        if share:
            warnings.warn(f"device {adapter.name!r}: tensors go through the host ({first_line(error)})", stacklevel=2)
            return _opened(adapter, cache)
        fault = f"cannot be opened: {str(error).splitlines()[0]}"
        raise DeviceError(f"device {adapter.name!r} {fault}; {HELP}") from None


def _key_of(adapter: spy.AdapterInfo, existing: spy.Device | None) -> bytes:
    return bytes(adapter.luid) if existing is None else f"existing {id(existing)}".encode()


def _close(handle: spy.Device | None, callbacks: list[Callable[[], object]]) -> None:
    if not forked.is_child():
        for call in callbacks:
            call()
        if handle is not None:
            handle.close()


_OPEN: dict[bytes, Device] = {}
_OPENING = Lock()


def open_device(device: Device | spy.Device | str | None = None) -> Device:
    """The process's open device for an adapter, opened at the first call; it stays open until the
    process ends or `Device.close`. `device`: as Device's name; a Device is returned as it is, and a SlangPy device that
    the program has opened itself is used and left open."""
    if isinstance(device, Device):
        return device
    forked.check()
    with _OPENING:
        existing = device if isinstance(device, spy.Device) else None
        name = device if isinstance(device, str) else None
        key = _key_of(choose(name) if existing is None else adapter_of(existing), existing)
        if key not in _OPEN:
            _OPEN[key] = Device(name, existing)
        return _OPEN[key]

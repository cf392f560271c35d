"""Recipes: everything that a program is made of, independent of a device.

So another process can make the same program from an equal recipe and store it in the shader cache.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import slangpy as spy

from pica.errors import DeviceError
from pica.rhi.passes import RasterState
from pica.rhi.slang_files import SlangFile, Source

if TYPE_CHECKING:
    from pica.rhi.device import Device

MadeOut = TypeVar("MadeOut", covariant=True)


class Recipe(Protocol[MadeOut]):
    """How to make a program, in one or several variants. Hashable and picklable; equal recipes make the same.

    In two parts, so that a renderer can do them in different frames.
    """

    def link(self, device: "Device", variant: Any) -> Any:
        """The input of `make`; slow unless cached."""

    def make(self, device: "Device", linked: Any) -> MadeOut:
        """The rest; takes seconds unless cached."""


@dataclass(frozen=True)
class ComputeRecipe:
    """A compute entry point of a file."""

    module: Source
    entry: str = "main"
    with_module: str | None = None
    """A Slang file with implementations for the `extern` declarations of the first."""

    @property
    def sources(self) -> tuple[Source, ...]:
        """Its files."""
        return (self.module,) if self.with_module is None else (self.module, self.with_module)

    def link(self, device: "Device", variant: Sequence[spy.SlangModule]) -> spy.ShaderProgram:
        """`variant`: modules to link with it. Raises DeviceError when the file does not compile."""
        more = [device.module(self.with_module)] if self.with_module is not None else []
        return linked(device, self.module, [self.entry], [*variant, *more])

    def make(self, device: "Device", linked: spy.ShaderProgram) -> tuple[spy.ShaderProgram, spy.ComputePipeline]:
        """Program and pipeline."""
        return linked, device.handle.create_compute_pipeline(linked)


@dataclass(frozen=True)
class RasterRecipe:
    """A vertex and a fragment entry point of a file below the package, and their fixed-function state."""

    module: str
    entries: tuple[str, ...]
    state: RasterState

    @property
    def sources(self) -> tuple[Source, ...]:
        """Its files."""
        return (self.module,)

    def link(self, device: "Device", variant: Sequence[spy.SlangModule]) -> spy.ShaderProgram:
        """`variant`: modules to link with it. Raises DeviceError when the file does not compile."""
        return linked(device, self.module, list(self.entries), variant)

    def make(self, device: "Device", linked: spy.ShaderProgram) -> tuple[spy.ShaderProgram, spy.RenderPipeline]:
        """Program and pipeline."""
        return linked, self.state.pipeline(device.handle, linked)


def linked(
    device: "Device", module: Source, entries: list[str], more: Sequence[spy.SlangModule] = ()
) -> spy.ShaderProgram:
    """The program of a file's entry points and further modules; DeviceError when the file does not compile, ShaderError
    when it is one outside of the package."""
    try:
        loaded = device.module(module) if isinstance(module, str) else module.loaded(device)
        kind = [device.module("rhi/software_device.slang")] if device.is_software else []
        return device.session.link_program([loaded, *kind, *more], [loaded.entry_point(entry) for entry in entries])
    except (RuntimeError, spy.SlangCompileError) as error:
        if isinstance(module, SlangFile):
            raise module.fault(error) from None
        raise DeviceError(f"{module}: {error}") from error

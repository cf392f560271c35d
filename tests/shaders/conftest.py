"""Calls Slang functions from Python: one device for all shader tests."""

from collections.abc import Callable
from pathlib import Path

import pytest
import slangpy as spy
from slangpy.core.calldata import SLANG_PATH

import pica

ShaderLoader = Callable[[str], spy.Module]


@pytest.fixture(scope="session")
def device() -> spy.Device:
    """A Vulkan device that finds pica's shaders."""
    include_paths = [Path(pica.__file__).parent, SLANG_PATH]
    return spy.Device(type=spy.DeviceType.vulkan, compiler_options={"include_paths": include_paths})


@pytest.fixture(scope="session")
def load(device: spy.Device) -> ShaderLoader:
    """Turn Slang source into a module whose functions take and return arrays."""
    count = 0

    def load_source(source: str) -> spy.Module:
        nonlocal count
        count += 1
        return spy.Module(device.load_module_from_source(f"test_module_{count}", source))

    return load_source

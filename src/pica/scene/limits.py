"""Limits on loading a scene, so that a small untrusted file cannot exhaust the memory or run for minutes."""

from collections.abc import Hashable
from dataclasses import dataclass, fields

import numpy as np

from pica.errors import SceneError
from pica.names import checked_names

FREE_BYTES = 10**9
"""Allowance of any load, however small its files: a flat picture of 16384x8192 pixels is a few kilobytes as PNG."""

MESH_COMPRESSION = 8
"""How much of the compression of meshes `Limits.expansion` does not count: Draco reaches 7 with all attributes, and 16
without normals."""

OBJECT_BYTES = 1 << 12
"""Memory of a node, a material or another frequent object: Python objects of 2 to 3 kB."""


@checked_names(SceneError)
@dataclass(frozen=True)
class Limits:
    """Limits on one load, including its environment; checked before memory is allocated.

    `math.inf` removes a limit. Raises SceneError unless all are numbers of at least 0.
    """

    bytes: float = 16e9
    """Bytes of memory for all arrays, pictures and nodes, including temporary ones. A
    workstation's size; the largest common glTF scenes need a quarter of it."""
    vertices: float = 100_000_000
    """Vertices of all meshes, and again of deformed or emissive ones, for each placed copy. Their
    attributes need 7 GB; scans of buildings have 50 million."""
    instances: float = (1 << 24) - 1
    """Parts of meshes with one material, for each instance by nodes and EXT_mesh_gpu_instancing. More
    cannot be traced: an instance's number has 24 bits (VkAccelerationStructureInstanceKHR::instanceCustomIndex)."""
    pixels: float = 1 << 31
    """Pixels of all pictures: 128 of 4096x4096, which need 8 GB."""
    expansion: float = 500
    """Maximum expansion of the files' bytes, for loads of more than 1 GB. Quantized meshes without normals
    reach 40, JPEG pictures 20, smooth ones as WebP 200; more indicates an attack on memory."""

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            number = isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)
            if not (number and value >= 0):
                raise SceneError(f"limits: {field.name} must be a number of at least 0, not {value!r}")


class Budget:
    """The amounts that a load has used."""

    def __init__(self, limits: Limits | None = None) -> None:
        if not isinstance(limits, Limits | None):
            raise SceneError(f"limits: {limits!r} is not a pica.Limits")
        self._limits = limits or Limits()
        self._taken = dict.fromkeys((field.name for field in fields(Limits)), 0)
        self._files: set[Hashable] = set()
        self._file_bytes = self._decompressed = 0

    def read_file(self, file: Hashable, length: int) -> None:
        """Count a file that is read. Its memory counts each time; its possible expansion once, by the key `file`.

        Raises SceneError, like the other methods: the amount and the limit, without the name of the object.
        """
        if file not in self._files:
            self._files.add(file)
            self._file_bytes += length
        self.take(bytes=length)

    @property
    def file_bytes(self) -> int:
        """The sum of the files' sizes so far, each once."""
        return self._file_bytes

    def decompressed(self, length: int) -> None:
        """After a part of the files has become `length` bytes of a mesh."""
        self._decompressed += length

    def take_picture(self, pixels: int, taken: int) -> None:
        """Count a picture of so many bytes."""
        self.take(pixels=pixels, bytes=taken)

    def take(self, **amounts: int) -> None:
        """Count amounts, by the names of Limits, before they are allocated."""
        for name, amount in amounts.items():
            total = self._taken[name] = self._taken[name] + amount
            limit = getattr(self._limits, name)
            if total > limit:
                raise _too_much(name, amount, total, f"the limit is {_amount(name, limit)}", name)
            if name == "bytes" and total > FREE_BYTES and total > self._limits.expansion * self._expandable:
                times = self._limits.expansion * self._expandable / max(self._file_bytes, 1)
                why = f"files of {self._file_bytes} bytes may become {times:g} times that, or 1 GB"
                raise _too_much(name, amount, total, why, "expansion")

    @property
    def _expandable(self) -> int:
        """Bytes of the files, with compressed meshes as they are without compression."""
        return max(self._file_bytes, min(self._decompressed, MESH_COMPRESSION * self._file_bytes))


def _too_much(name: str, amount: int, total: int, why: str, limit: str) -> SceneError:
    taken = f"would take {_amount(name, amount)}"
    if total > 1.01 * amount:
        taken += f", {_amount(name, total)} with all before"
    says = f"pica.load(…, limits=pica.Limits({limit}=…)) or --limit {limit}=… says otherwise"
    return SceneError(f"{taken}; {why}, unless {says}")


def _amount(name: str, amount: float) -> str:
    if name != "bytes":
        return f"{amount:,} {name}"
    return f"{amount / 1e9:.3g} GB of memory" if amount >= 1e9 else f"{amount / 1e6:.4g} MB of memory"

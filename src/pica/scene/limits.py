"""What loading a scene may take, so that a small file from a stranger cannot fill the memory or run for minutes."""

from collections.abc import Hashable
from dataclasses import dataclass, fields

import numpy as np

from pica.errors import SceneError
from pica.names import checked_names

FREE_BYTES = 10**9
"""What any load may take, however small its files: a flat picture of 16384x8192 pixels is a few kilobytes as PNG."""

OBJECT_BYTES = 1 << 12
"""What a node, a material or another thing of which a scene has many counts as: Python objects of 2 to 3 kB."""


@checked_names(SceneError)
@dataclass(frozen=True)
class Limits:
    """What one load may take at most, its environment included; counted before memory is taken.

    `math.inf` takes a limit away. Raises SceneError for what is no number of at least 0.
    """

    bytes: float = 16e9
    """Bytes of memory that all arrays, pictures and nodes take, those included that are only needed meanwhile. A
    workstation's share; the largest scenes that are common in glTF take a quarter of it."""
    vertices: float = 100_000_000
    """Vertices of all meshes, and again of those that a node deforms or that shine, for each placed copy. Their
    attributes take 7 GB; scans of buildings have 50 million."""
    instances: float = (1 << 24) - 1
    """Parts of meshes with one material, once for each place that nodes and EXT_mesh_gpu_instancing give them. More
    cannot be traced: an instance's number has 24 bits (VkAccelerationStructureInstanceKHR::instanceCustomIndex)."""
    pixels: float = 1 << 31
    """Pixels of all pictures: 128 of 4096x4096, which take 8 GB."""
    expansion: float = 500
    """Bytes that one byte of the files may become, where a load takes more than 1 GB. Quantized meshes without normals
    become 40, JPEG pictures 20, smooth ones as WebP 200; what becomes more is made to fill the memory."""

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            number = isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)
            if not (number and value >= 0):
                raise SceneError(f"limits: {field.name} must be a number of at least 0, not {value!r}")


class Budget:
    """What a load has taken of its limits so far."""

    def __init__(self, limits: Limits | None = None) -> None:
        if not isinstance(limits, Limits | None):
            raise SceneError(f"limits: {limits!r} is not a pica.Limits")
        self._limits = limits or Limits()
        self._taken = dict.fromkeys((field.name for field in fields(Limits)), 0)
        self._files: set[Hashable] = set()
        self._file_bytes = 0

    def read_file(self, file: Hashable, length: int) -> None:
        """Count a file that is read. Its memory counts each time; what may become of it once, by the key `file`.

        Raises SceneError, like the others here: what would be taken and what the limit is, without who asks for it.
        """
        if file not in self._files:
            self._files.add(file)
            self._file_bytes += length
        self.take(bytes=length)

    def take_picture(self, pixels: int, taken: int) -> None:
        """Count a picture that takes so many bytes."""
        self.take(pixels=pixels, bytes=taken)

    def take(self, **amounts: int) -> None:
        """Count amounts, by the names of Limits, before they are taken."""
        for name, amount in amounts.items():
            total = self._taken[name] = self._taken[name] + amount
            limit = getattr(self._limits, name)
            if total > limit:
                raise _too_much(name, amount, total, f"the limit is {_amount(name, limit)}", name)
            if name == "bytes" and total > FREE_BYTES and total > self._limits.expansion * self._file_bytes:
                why = f"files of {self._file_bytes} bytes may become {self._limits.expansion:g} times that, or 1 GB"
                raise _too_much(name, amount, total, why, "expansion")


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

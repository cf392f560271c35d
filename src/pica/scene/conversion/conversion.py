"""What converters share: the glTF file that they write, the files that they may read, and limits."""

import signal
import sys
from collections.abc import Hashable
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from pica.errors import SceneError
from pica.scene.conversion.formats import FORMATS
from pica.scene.gltf.asset_files import AssetFiles
from pica.scene.gltf_export.container import Asset
from pica.scene.limits import Budget, Limits

FREE_BYTES, _MEMORY_FACTOR = 1 << 30, 300
"""Memory of a conversion: this, and so many times the files' bytes. 3MF, which is compressed, was measured to take 250
times its bytes, and OBJ 12 times."""
_FREE_SECONDS, _BYTE_SECONDS = 8.0, 2e-5
"""Processor time of a conversion: this, and so much for each byte of the files, 20 times what was measured."""
_MOST_WARNINGS = 20
Z_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
"""The rotation of +Z to +Y."""


class CountingBudget(Budget):
    """A budget that notes the files and lets the process take time and memory in proportion to them."""

    def __init__(self, limits: Limits) -> None:
        super().__init__(limits)
        self.files: dict[Hashable, int] = {}
        self._most_memory, self._seconds = limits.bytes, _FREE_SECONDS
        self._start = memory_in_use()
        self._set_limits()

    def read_file(self, file: Hashable, length: int) -> None:
        """As Budget has it."""
        super().read_file(file, length)
        self.files[file] = max(length, self.files.get(file, 0))
        self._set_limits()

    def _set_limits(self) -> None:
        """After them the system ends this process, or allocations fail."""
        if sys.platform == "win32":
            return
        import resource

        size = sum(self.files.values())
        left = signal.setitimer(signal.ITIMER_PROF, 0)[0]
        used = self._seconds - left if left else 0.0  # it was not set before
        self._seconds = _FREE_SECONDS + _BYTE_SECONDS * size
        signal.setitimer(signal.ITIMER_PROF, max(self._seconds - used, 0.01))
        if sys.platform == "linux":
            most = self._start + int(min(FREE_BYTES + _MEMORY_FACTOR * size, FREE_BYTES + self._most_memory))
            _, hard = resource.getrlimit(resource.RLIMIT_AS)
            resource.setrlimit(resource.RLIMIT_AS, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))


class Conversion:
    """One file on its way to glTF. `up`: the axis that the user says points up, "y" or "z"; None: the file's own.

    Converters add nodes, meshes and so on to `asset`, and call `show` at the end."""

    def __init__(self, path: Path, budget: Budget, allow_outside: bool, up: str | None) -> None:
        self.path, self.budget, self.allow_outside = path, budget, allow_outside
        self.given_up = up
        self.custom_up = FORMATS[path.suffix.lower()].up
        """The axis that points up in such files by custom; None: they say it."""
        self.files = AssetFiles(path, budget, allow_outside)
        self.asset = Asset(Path("converted.glb"), generator="")
        self.warnings: list[str] = []

    def warn(self, text: str) -> None:
        """Warn once of content that is left out; after twenty warnings no more."""
        if text not in self.warnings and len(self.warnings) <= _MOST_WARNINGS:
            more = "there is more that is left out; further warnings are left out"
            self.warnings.append(text if len(self.warnings) < _MOST_WARNINGS else more)

    def file(self, name: str, what: str) -> bytes | None:
        """The content of a file that the asset names, as glTF's uri; None, with a warning, if it cannot be read."""
        try:
            return self.files.read(quote(name.replace("\\", "/"), safe="/:"), what)
        except SceneError as error:
            self.warn(f"{error}; left out")
            return None

    def show(self, nodes: list[int], up: str, unit: float, extras: dict[str, Any] | None = None) -> None:
        """The scene: root nodes in a space of this up axis, a unit of which is `unit` metres."""
        is_z_up = (self.given_up or up) == "z"
        matrix = (Z_UP if is_z_up else np.eye(4)) @ np.diag([unit, unit, unit, 1.0])
        if not np.array_equal(matrix, np.eye(4)):
            name = "z is up" if is_z_up else "unit"
            nodes = [
                self.asset.add("nodes", {"name": name, "matrix": matrix.T.reshape(-1).tolist(), "children": nodes})
            ]
        given = self.asset.extras({}, extras or {})
        self.asset.add("scenes", {"name": self.path.stem, "nodes": nodes, "extras": given})


def memory_in_use() -> int:
    """Bytes of this process's address space; 0 where the system does not tell."""
    if sys.platform != "linux":
        return 0
    import resource

    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[0]) * resource.getpagesize()

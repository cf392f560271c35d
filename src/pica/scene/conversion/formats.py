"""The formats that are converted, by the suffixes of their files."""

from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from pica.errors import SceneError

GLTF = (".gltf", ".glb")


@dataclass(frozen=True)
class Format:
    """How files of a format are read."""

    converter: str
    """The module whose `convert` reads it."""
    up: str | None
    """The axis that points up by custom; None: files say it."""
    packages: tuple[str, ...] = ()
    """Modules of Python packages that are not among pica's own dependencies."""
    extra: str = ""
    """The extra of pica that has them."""

    def check_installed(self) -> None:
        """Raises SceneError, with what to install."""
        missing = [package for package in self.packages if find_spec(package) is None]
        if missing:
            raise SceneError(f'its format needs the extra {self.extra!r}: pip install "pica[{self.extra}]"')


_MESHES, _USD = "pica.scene.mesh_files", "pica.scene.usd"
_USD_FILE = Format(_USD, None, ("pxr",), "usd")
FORMATS = {
    ".obj": Format(_MESHES, "y"),
    ".ply": Format(_MESHES, "y"),
    ".stl": Format(_MESHES, "z"),
    ".3mf": Format(_MESHES, "z", ("lxml", "networkx"), "meshes"),
    ".dae": Format(_MESHES, None, ("collada",), "meshes"),
    ".usd": _USD_FILE,
    ".usda": _USD_FILE,
    ".usdc": _USD_FILE,
    ".usdz": _USD_FILE,
}
SUFFIXES = (*GLTF, *FORMATS)


def format_of(path: Path) -> Format | None:
    """The format of a file that is to be converted; None for others, which are read as glTF."""
    return FORMATS.get(path.suffix.lower())

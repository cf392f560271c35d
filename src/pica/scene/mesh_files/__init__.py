"""Files of single meshes, by trimesh: OBJ, PLY, STL, 3MF and COLLADA."""

import re
from importlib import import_module
from pathlib import Path

from pica.scene.conversion.conversion import Conversion
from pica.text import first_line


def import_libraries(path: Path) -> None:
    """Import what reads the file, which takes longer than reading it."""
    import_module("pica.scene.mesh_files.reading")
    for library in {".3mf": ("lxml.etree", "networkx"), ".dae": ("collada",)}.get(path.suffix.lower(), ()):
        import_module(library)


def convert(conversion: Conversion) -> None:
    """Add the file's meshes. Raises SceneError, or whatever the library does."""
    from pica.scene.mesh_files.reading import add_meshes  # which imports the library

    add_meshes(conversion)


def described(error: Exception) -> str:
    """An error of the library, in one line."""
    return re.sub(r"\w*Error: ", "", first_line(error))

"""Reading glTF 2.0 (https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html; sections are cited from there)."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pica.errors import SceneError
from pica.scene.gltf.container import Document
from pica.scene.gltf.extensions import check_extensions
from pica.scene.gltf.nodes import build_scene
from pica.scene.gltf.source import read_source
from pica.scene.limits import Budget
from pica.scene.model import Scene
from pica.scene.source import Source
from pica.text import printable


def read(
    path: str | Path,
    budget: Budget | None = None,
    allow_outside: bool = False,
    variant: str | None = None,
    content: bytes | None = None,
) -> Scene:
    """Read a .gltf or .glb file with all files that it refers to, which must be in its folder unless `allow_outside`.

    `variant`: a name of its KHR_materials_variants. `content`: that of a .glb, which is read instead of the file.

    Raises SceneError, one line with the file, the place in its JSON and the fault; warns about ignored content.
    """
    with _faults_named(path), Document(Path(path), budget, allow_outside, variant, content) as document:
        check_extensions(document)
        scene = build_scene(document)
        scene.source = read_source(document, converted=content is not None)
        return scene


def source(path: str | Path, budget: Budget | None = None, allow_outside: bool = False) -> Source:
    """What a file says of itself, by its JSON alone: also of files that need unsupported extensions.

    Raises SceneError as `read`.
    """
    with _faults_named(path), Document(Path(path), budget, allow_outside) as document:
        return read_source(document)


@contextmanager
def _faults_named(path: str | Path) -> Iterator[None]:
    try:
        yield
    except SceneError as error:
        raise SceneError(f"{printable(path)}: {error}") from None
    except MemoryError:
        raise SceneError(f"{printable(path)}: takes more memory than there is") from None

"""Reading glTF 2.0 (https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html; sections are cited from there)."""

from pathlib import Path

from pica.errors import SceneError
from pica.scene.gltf.container import Document
from pica.scene.gltf.extensions import check_extensions
from pica.scene.gltf.nodes import build_scene
from pica.scene.limits import Budget
from pica.scene.model import Scene
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
    try:
        with Document(Path(path), budget, allow_outside, variant, content) as document:
            check_extensions(document)
            return build_scene(document)
    except SceneError as error:
        raise SceneError(f"{printable(path)}: {error}") from None
    except MemoryError:
        raise SceneError(f"{printable(path)}: takes more memory than there is") from None

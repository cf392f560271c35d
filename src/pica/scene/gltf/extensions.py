"""Which extensions of glTF are read."""

from pica.errors import SceneError
from pica.scene.gltf.container import Document
from pica.text import one_line

SUPPORTED = frozenset(
    {
        "EXT_mesh_gpu_instancing",
        "EXT_texture_webp",
        "KHR_lights_punctual",
        "KHR_materials_anisotropy",
        "KHR_materials_clearcoat",
        "KHR_materials_emissive_strength",
        "KHR_materials_ior",
        "KHR_materials_iridescence",
        "KHR_materials_sheen",
        "KHR_materials_specular",
        "KHR_materials_transmission",
        "KHR_materials_unlit",
        "KHR_mesh_quantization",
        "KHR_texture_transform",
    }
)

_MOST_NAMED, _LONGEST = 12, 80


def check_extensions(document: Document) -> None:
    """Raise SceneError for a required extension that is not supported; warn once about all others (3.12)."""
    required = unsupported(document, "extensionsRequired")
    if required:
        raise SceneError(f"needs {required}, which is not supported; export the file without")
    used = unsupported(document, "extensionsUsed")
    if used:
        document.warn(f"ignores what is not supported: {used}")


def unsupported(document: Document, key: str) -> str:
    """The extensions under a key of the file, such as "extensionsRequired", that are not read, in one line."""
    names = [name for name in dict.fromkeys(document.root.texts(key)) if name not in SUPPORTED]
    more = f" and {len(names) - _MOST_NAMED} more" if len(names) > _MOST_NAMED else ""
    return ", ".join(one_line(name, _LONGEST) for name in names[:_MOST_NAMED]) + more

"""Which extensions of glTF are read."""

from pica.errors import SceneError
from pica.scene.gltf.container import Document

SUPPORTED = frozenset(
    {
        "EXT_mesh_gpu_instancing",
        "EXT_texture_webp",
        "KHR_lights_punctual",
        "KHR_materials_emissive_strength",
        "KHR_materials_ior",
        "KHR_materials_specular",
        "KHR_materials_transmission",
        "KHR_materials_unlit",
        "KHR_mesh_quantization",
        "KHR_texture_transform",
    }
)


def check_extensions(document: Document) -> None:
    """Raise SceneError for a required extension that is not supported; warn once about all others (3.12)."""
    required = unsupported(document, "extensionsRequired")
    if required:
        raise SceneError(f"needs {', '.join(required)}, which is not supported; export the file without")
    used = unsupported(document, "extensionsUsed")
    if used:
        document.warn(f"ignores what is not supported: {', '.join(used)}")


def unsupported(document: Document, key: str) -> list[str]:
    """The extensions under a key of the file, such as "extensionsRequired", that are not read."""
    names = dict.fromkeys(document.root.texts(key))
    return [" ".join(name.split()) for name in names if name not in SUPPORTED]

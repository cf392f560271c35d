"""Which extensions of glTF are read."""

from typing import Any

from pica.errors import SceneError
from pica.scene.gltf.container import Document
from pica.text import one_line

SUPPORTED = frozenset(
    {
        "EXT_mesh_gpu_instancing",
        "EXT_meshopt_compression",
        "EXT_texture_avif",
        "EXT_texture_webp",
        "KHR_animation_pointer",
        "KHR_draco_mesh_compression",
        "KHR_lights_punctual",
        "KHR_materials_anisotropy",
        "KHR_materials_clearcoat",
        "KHR_materials_diffuse_transmission",
        "KHR_materials_dispersion",
        "KHR_materials_emissive_strength",
        "KHR_materials_ior",
        "KHR_materials_iridescence",
        "KHR_materials_pbrSpecularGlossiness",
        "KHR_materials_sheen",
        "KHR_materials_specular",
        "KHR_materials_transmission",
        "KHR_materials_unlit",
        "KHR_materials_variants",
        "KHR_materials_volume",
        "KHR_materials_volume_scatter",
        "KHR_mesh_quantization",
        "KHR_meshopt_compression",
        "KHR_node_visibility",
        "KHR_texture_basisu",
        "KHR_texture_transform",
        "KHR_xmp_json_ld",
        "MSFT_texture_dds",
    }
)

IGNORED = {
    "EXT_lights_image_based": "its environment is left out, another one can be given",
    "MSFT_lod": "the finest level of detail is shown",
}
"""Extensions whose files are read without them even if they are required, and what a warning says of each."""

_MOST_NAMED, _LONGEST = 12, 80


def check_extensions(document: Document) -> None:
    """Raise SceneError for a required extension that is not supported; warn once about all others (3.12), be they
    listed as used or not."""
    required = unsupported(document.root.texts("extensionsRequired"))
    if required:
        raise SceneError(f"needs {required}, which is not supported; export the file without")
    names = [*document.root.texts("extensionsUsed"), *_present(document.root.values)]
    used = unsupported(names)
    if used:
        document.warn(f"ignores what is not supported: {used}")
    for name, effect in IGNORED.items():
        if name in names:
            document.warn(f"ignores {name}: {effect}")


def treatments(document: Document) -> dict[str, str]:
    """By extension that the file uses or requires, what is done with it."""
    required = set(document.root.texts("extensionsRequired"))
    names = [*document.root.texts("extensionsUsed"), *required, *_present(document.root.values)]
    return {name: _treatment(name, name in required) for name in sorted(set(names))}


def _treatment(name: str, required: bool) -> str:
    if name in SUPPORTED:
        return "supported"
    if name in IGNORED:
        return f"ignored: {IGNORED[name]}"
    return "refused: required and not supported" if required else "ignored: not supported"


def _present(root: dict[str, Any]) -> list[str]:
    """The extensions of objects of the file; extras are left to applications."""
    names: dict[str, None] = {}
    below: list[Any] = [root]
    while below:
        part = below.pop()
        if type(part) is dict:
            extensions = part.get("extensions")
            if type(extensions) is dict:
                names |= dict.fromkeys(extensions)
            below += [value for key, value in part.items() if key != "extras" and type(value) in (dict, list)]
        elif part and type(part[0]) in (dict, list):  # lists of numbers are not looked through
            below += [value for value in part if type(value) in (dict, list)]
    return list(names)


def unsupported(extensions: list[str]) -> str:
    """The extensions that are neither supported nor ignored by purpose, in one line."""
    names = [name for name in dict.fromkeys(extensions) if name not in SUPPORTED and name not in IGNORED]
    more = f" and {len(names) - _MOST_NAMED} more" if len(names) > _MOST_NAMED else ""
    return ", ".join(one_line(name, _LONGEST) for name in names[:_MOST_NAMED]) + more

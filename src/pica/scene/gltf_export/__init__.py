"""Writing glTF 2.0, so that `pica.scene.gltf` reads the same scene again; its modules have the same names."""

import warnings
from pathlib import Path

from pica.errors import SceneError, shown
from pica.scene.gltf_export.animations import add_animations
from pica.scene.gltf_export.container import Asset
from pica.scene.gltf_export.environments import background_entry, environment_entry
from pica.scene.gltf_export.nodes import add_nodes
from pica.scene.model import Scene
from pica.text import printable


def write(scene: Scene, path: str | Path) -> None:
    """As Scene.save."""
    target = _checked(path)
    scene.check()
    for mesh in dict.fromkeys(node.mesh for node in scene.nodes() if node.mesh is not None):
        mesh.check()
    asset = Asset(target)
    if scene.source is not None:
        asset.describe(copyright=scene.source.copyright, xmp=scene.source.xmp)
    rows, materials = add_nodes(asset, scene)
    add_animations(asset, scene.animations, rows, materials)
    entry = {
        "name": scene.name,
        "nodes": [rows[root] for root in scene.roots],
        "extras": asset.extras(
            {},
            {
                "environment": environment_entry(asset, scene.environment),
                "background": background_entry(asset, scene.background),
            },
        ),
    }
    asset.add("scenes", entry)
    if scene.variants:
        asset.leave_out("materials of variants that are not shown", len(scene.variants))
    asset.write()
    for text in asset.left_out():
        warnings.warn(f"{printable(target)}: {text}", stacklevel=3)


def _checked(path: str | Path) -> Path:
    try:
        target = Path(path)
    except TypeError:
        raise SceneError(f"save: {shown(path)} is not the path of a file") from None
    if target.suffix.lower() not in (".glb", ".gltf"):
        raise SceneError(f"save: {shown(str(target))} must end in .glb or .gltf")
    return target

"""Nodes: the hierarchy, and the content of each (3.5)."""

from typing import Any

import numpy as np

from pica.scene.animation import Channel, Pose
from pica.scene.field_channel import FieldChannel
from pica.scene.gltf_export.cameras import add_camera
from pica.scene.gltf_export.container import Asset
from pica.scene.gltf_export.instances import instancing
from pica.scene.gltf_export.lights import area_light, punctual_light, visibility
from pica.scene.gltf_export.materials import Materials
from pica.scene.gltf_export.meshes import Meshes
from pica.scene.gltf_export.skins import add_skin
from pica.scene.model import Scene
from pica.scene.node import Node
from pica.scene.skin import Skin

_DEFAULT = Pose()


def add_nodes(asset: Asset, scene: Scene) -> tuple[dict[Node, int], Materials]:
    """Add all nodes of a scene; returns their indices, parents first, and the materials of their meshes."""
    rows = {node: row for row, node in enumerate(scene.nodes())}
    channels = [channel for animation in scene.animations for channel in animation.channels]
    moved = {channel.node for channel in channels if isinstance(channel, Channel) and channel.path != "weights"}
    changed = {channel.holder for channel in channels if isinstance(channel, FieldChannel)}
    meshes, skins = Meshes(asset), dict[Skin, int | None]()
    for node in rows:
        entry = {
            "name": node.name,
            "children": [rows[child] for child in node.children],
            **_place(node, node in moved),
            "camera": add_camera(asset, node, node in changed),
        }
        mesh = meshes.get(node)
        instances = None
        pica = visibility(node) | {"light": area_light(node)}
        if mesh is not None and node.mesh is not None:
            if node.instances is not None and len(node.instances):
                instances, pica["instances"] = instancing(asset, node.instances)
            elif node.instances is not None:
                mesh = None
            entry |= _deformation(asset, node, rows, skins) if mesh is not None else {}
        entry["mesh"] = mesh
        entry["extensions"] = asset.extensions(
            KHR_lights_punctual=punctual_light(asset, node, node in changed), EXT_mesh_gpu_instancing=instances
        )
        entry["extras"] = asset.extras(node.extras, pica)
        asset.add("nodes", entry)
    return rows, meshes.materials


def _place(node: Node, is_moved: bool) -> dict[str, Any]:
    """The keys for a node's transform: its components if they are all of it, and if an animation sets them."""
    pose = node.pose
    if pose is not None and (is_moved or np.array_equal(pose.matrix(), node.transform)):
        parts = {name: getattr(pose, name) for name in ("translation", "rotation", "scale")}
        return {name: part.tolist() for name, part in parts.items() if (part != getattr(_DEFAULT, name)).any()}
    if np.array_equal(node.transform, np.eye(4)):
        return {}
    return {"matrix": node.transform.T.reshape(-1).tolist()}


def _deformation(
    asset: Asset, node: Node, rows: dict[Node, int], skins: dict[Skin, int | None]
) -> dict[str, Any]:  # fmt: skip
    """The keys for the skin and the weights of a node's mesh."""
    keys: dict[str, Any] = {}
    targets = 0 if node.mesh is None else node.mesh.target_count
    if targets:
        keys["weights"] = (np.zeros(targets) if node.weights is None else node.weights).tolist()
    if node.skin is not None:
        if node.skin not in skins:
            skins[node.skin] = add_skin(asset, node.skin, rows)
        keys["skin"] = skins[node.skin]
    return keys

"""Skinning and morphing on the GPU (deform.slang)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.gpu_scene.deformation.vertex_writer import SHAPE, VertexWriter, rest_shapes, shapes
from pica.gpu_scene.geometry_store import PlacedSection
from pica.rhi.device import Device
from pica.rhi.passes import Recording
from pica.scene.model import Node, Section


class Skinning(VertexWriter):
    """Writes vertices as a node's weights and joints have them."""

    shader = "deform"

    def __init__(self, device: Device, node: Node, sections: list[PlacedSection]) -> None:
        self._node = node
        super().__init__(device, sections)
        joints = 0 if node.skin is None else len(node.skin.joints)
        targets = 0 if node.weights is None else len(node.weights)
        self._shared = {
            "matrices": device.structured("joint matrices", np.zeros((max(3 * joints, 1), 4), np.float32)),
            "weights": device.structured("morph weights", np.zeros(max(targets, 1), np.float32)),
        }

    def _upload(self, recording: Recording) -> None:
        if self._node.skin is not None:
            rows = self._node.skin.joint_matrices()[:, :3].astype(np.float32).reshape(-1, 4)
            recording.encoder.upload_buffer_data(self._shared["matrices"], 0, rows)
        if self._node.weights is not None and len(self._node.weights):
            recording.encoder.upload_buffer_data(self._shared["weights"], 0, self._node.weights.astype(np.float32))

    def _section_parameters(self, section: Section) -> dict[str, Any]:
        device, count = self._device, len(section.positions)
        skinned = self._node.skin is not None and section.joints is not None and section.weights is not None
        influences = section.joints.shape[1] if skinned and section.joints is not None else 0
        joints = section.joints if influences and section.joints is not None else np.zeros(1)
        joint_weights = section.weights if influences and section.weights is not None else np.zeros(1)
        targets = _targets(section) if self._node.weights is not None else np.zeros(0, SHAPE)
        faces = np.zeros((count, 3), np.uint32)
        faces[section.indices] = section.indices[:, None]
        return {
            "base": device.structured("base shape", rest_shapes(section)),
            "targets": device.structured("morph targets", targets),
            "joints": device.structured("joints", joints.reshape(-1).astype(np.uint32)),
            "jointWeights": device.structured("joint weights", joint_weights.reshape(-1).astype(np.float32)),
            "faces": device.structured("faces", faces if section.flat else faces[:1]),
            "targetCount": len(targets) // count,
            "influences": influences,
            "flat": int(section.flat),
        }


def _targets(section: Section) -> NDArray[np.void]:
    if section.morph_positions is None:
        return np.zeros(0, SHAPE)
    nothing = np.zeros_like(section.morph_positions)
    offsets = (
        nothing if values is None else values
        for values in (section.morph_positions, section.morph_normals, section.morph_tangents)
    )
    return shapes(*(values.reshape(-1, 3) for values in offsets))

"""Skinning and morphing on the GPU, one node's mesh at a time, and the upkeep of its bottom-level structures."""

from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.gpu_scene.geometry import GeometryBuffers, PlacedSection
from pica.gpu_scene.looseness import Looseness
from pica.rhi.device import Device
from pica.rhi.passes import ComputePass, Recording
from pica.scene.model import Node, Section

# deform.slang: Shape
SHAPE = np.dtype([("position", "f4", 3), ("normal", "f4", 3), ("tangent", "f4", 3)])
_CHECK_EVERY = 8
"""Refits between two looks at how loose the boxes have become."""


class Deformation:
    """Keeps the vertices of a node that deforms its mesh, and their structures, up to date."""

    def __init__(
        self, device: Device, deform: ComputePass, node: Node, geometry: GeometryBuffers, rebuild_at: float
    ) -> None:
        """`deform`: the pass of deform.slang. `rebuild_at`: GeometrySettings.rebuild_at."""
        self._device = device
        self._node = node
        self._rebuild_at = rebuild_at
        mesh = geometry.mesh(node)
        self._geometry = geometry
        self._structures = [part.geometry for part in mesh.parts]
        joints = 0 if node.skin is None else len(node.skin.joints)
        self._matrices = device.structured("joint matrices", np.zeros((max(3 * joints, 1), 4), np.float32))
        targets = 0 if node.weights is None else len(node.weights)
        self._weights = device.structured("morph weights", np.zeros(max(targets, 1), np.float32))
        self._deform = deform
        self._sections = [(p, _parameters(device, p, node)) for p in mesh.sections]
        self._looseness = Looseness([p.section for p in mesh.sections], node)
        self._refits: int | None = None

    def forget(self) -> None:
        """The node goes: book its buffers as given back."""
        buffers = [v for _, parameters in self._sections for v in parameters.values() if isinstance(v, spy.Buffer)]
        self._device.give_back(self._matrices, self._weights, *buffers)

    def __call__(self, recording: Recording) -> None:
        """Record the deformation to the node's present weights and joints, and a refit or a rebuild."""
        if self._node.skin is not None:
            rows = self._node.skin.joint_matrices()[:, :3].astype(np.float32).reshape(-1, 4)
            recording.encoder.upload_buffer_data(self._matrices, 0, rows)
        if self._node.weights is not None and len(self._node.weights):
            recording.encoder.upload_buffer_data(self._weights, 0, self._node.weights.astype(np.float32))
        for placed, parameters in self._sections:
            self._deform(
                recording,
                (len(placed.section.positions), 1, 1),
                matrices=self._matrices,
                weights=self._weights,
                positions=self._geometry.positions,
                previousPositions=self._geometry.previous_positions,
                vertices=self._geometry.vertices,
                **parameters,
            )

    def update_structures(self, recording: Recording) -> None:
        """Record the refit or rebuild of the bottom level, after every node's vertices are in place."""
        refits = self._refits or 0
        look = refits % _CHECK_EVERY == _CHECK_EVERY - 1
        rebuild = self._refits is None or not self._rebuild_at or (look and self._looseness.now() > self._rebuild_at)
        for structure in self._structures:
            update = structure.build if rebuild else structure.refit
            update(recording.encoder, self._geometry.positions, self._geometry.indices)
        if rebuild and self._rebuild_at:
            self._looseness.reset()
        self._refits = 0 if rebuild else refits + 1


def _parameters(device: Device, placed: PlacedSection, node: Node) -> dict[str, Any]:
    section = placed.section
    count = len(section.positions)
    skinned = node.skin is not None and section.joints is not None and section.weights is not None
    influences = section.joints.shape[1] if skinned and section.joints is not None else 0
    joints = section.joints if influences and section.joints is not None else np.zeros(1)
    joint_weights = section.weights if influences and section.weights is not None else np.zeros(1)
    targets = _targets(section) if node.weights is not None else np.zeros(0, SHAPE)
    faces = np.zeros((count, 3), np.uint32)
    faces[section.indices] = section.indices[:, None]
    return {
        "base": device.structured("base shape", _shapes(section.positions, section.normals, section.tangents[:, :3])),
        "targets": device.structured("morph targets", targets),
        "joints": device.structured("joints", joints.reshape(-1).astype(np.uint32)),
        "jointWeights": device.structured("joint weights", joint_weights.reshape(-1).astype(np.float32)),
        "faces": device.structured("faces", faces if section.flat else faces[:1]),
        "vertexCount": count,
        "targetCount": len(targets) // count,
        "influences": influences,
        "flat": int(section.flat),
        "firstVertex": placed.first_vertex,
        "firstPrevious": placed.first_previous,
    }


def _shapes(*parts: NDArray[np.float32]) -> NDArray[np.void]:
    shapes = np.zeros(len(parts[0]), SHAPE)
    for name, values in zip(("position", "normal", "tangent"), parts, strict=True):
        shapes[name] = values
    return shapes


def _targets(section: Section) -> NDArray[np.void]:
    if section.morph_positions is None:
        return np.zeros(0, SHAPE)
    nothing = np.zeros_like(section.morph_positions)
    offsets = (
        nothing if values is None else values
        for values in (section.morph_positions, section.morph_normals, section.morph_tangents)
    )
    return _shapes(*(values.reshape(-1, 3) for values in offsets))

"""Skins and blend shapes (UsdSkel, https://openusd.org/release/api/_usd_skel__intro.html)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd, UsdGeom, UsdSkel

from pica.errors import SceneError
from pica.scene.gltf.deformation import normalized
from pica.scene.usd.animations import Animations, decomposed
from pica.scene.usd.stage import Stage

_SHOWN = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
_MOST_JOINTS = 1 << 16


class Deformation:
    """What moves the points of a prim."""

    def __init__(self, stage: Stage, query: UsdSkel.SkinningQuery, skeleton: UsdSkel.Skeleton) -> None:
        self._stage, self.query, self.skeleton = stage, query, skeleton
        self.shapes = [str(name) for name in query.GetBlendShapeOrder() or ()] if query.HasBlendShapes() else []

    def of_points(self, prim: Usd.Prim, count: int) -> tuple[dict[str, Any], list[dict[str, Any]]]:
        """Joints and weights, (points, 4) in each set, and the offsets of each blend shape, (points, 3)."""
        attributes: dict[str, Any] = {}
        if self.query.HasJointInfluences():
            indices, weights = self.query.ComputeVaryingJointInfluences(count, self._stage.time)
            shape = count, self.query.GetNumInfluencesPerComponent()
            if len(indices) != shape[0] * shape[1] or len(weights) != len(indices):
                raise SceneError("jointIndices and jointWeights do not fit its points")
            rows = np.asarray(indices, np.int64).reshape(shape)
            if rows.size and not (rows.min() >= 0 and rows.max() < _MOST_JOINTS):
                raise SceneError(f"jointIndices: {int(rows.max())} is no joint")
            joints, shares = normalized(rows, np.maximum(np.asarray(weights, np.float32).reshape(shape), 0))
            missing = ((0, 0), (0, -joints.shape[1] % 4))
            joints, shares = np.pad(joints, missing), np.pad(shares, missing)
            for number in range(joints.shape[1] // 4):
                columns = slice(4 * number, 4 * number + 4)
                attributes[f"JOINTS_{number}"] = joints[:, columns]
                attributes[f"WEIGHTS_{number}"] = shares[:, columns]
        targets = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(prim))
        return attributes, [
            {"POSITION": self._offsets(targets.GetBlendShape(row), count)} for row in range(len(self.shapes))
        ]

    def _offsets(self, shape: UsdSkel.BlendShape, count: int) -> NDArray[np.float64]:
        offsets = np.zeros((count, 3))
        given = np.asarray(shape.GetOffsetsAttr().Get() or np.zeros((0, 3)), float).reshape(-1, 3)
        rows = shape.GetPointIndicesAttr().Get()
        indices = np.arange(len(given)) if rows is None or not len(rows) else np.asarray(rows, np.intp)
        if len(indices) != len(given) or (len(indices) and not (indices.min() >= 0 and indices.max() < count)):
            raise SceneError("the offsets of a blend shape do not fit its points")
        if shape.GetInbetweens():
            self._stage.conversion.warn("in-betweens of blend shapes are left out")
        offsets[indices] = given
        return offsets


class Skeletons:
    """The skeletons of a stage, and what they deform."""

    def __init__(self, stage: Stage, animations: Animations) -> None:
        self._stage, self._asset, self._animations = stage, stage.conversion.asset, animations
        self._cache = UsdSkel.Cache()
        self._deformations: dict[Sdf.Path, Deformation] = {}
        self._entries: dict[Sdf.Path, dict[str, Any]] = {}
        """The nodes of skeletons."""
        self._bound: list[tuple[dict[str, Any], int, Deformation]] = []
        for prim in stage.usd.Traverse(_SHOWN):
            if not prim.IsA(UsdSkel.Root):
                continue
            root = UsdSkel.Root(prim)
            self._cache.Populate(root, _SHOWN)
            for binding in self._cache.ComputeSkelBindings(root, _SHOWN):
                for query in binding.GetSkinningTargets():
                    deformation = Deformation(stage, query, binding.GetSkeleton())
                    self._deformations[query.GetPrim().GetPath()] = deformation

    def get(self, prim: Usd.Prim) -> Deformation | None:
        """What deforms a prim."""
        return self._deformations.get(prim.GetPath()) if prim.IsA(UsdGeom.Mesh) else None

    def add(self, prim: Usd.Prim, entry: dict[str, Any], index: int, deformation: Deformation | None) -> None:
        """A node of a skeleton, or of a mesh that is deformed."""
        if prim.IsA(UsdSkel.Skeleton):
            self._entries[prim.GetPath()] = entry
        if deformation is not None and "mesh" in entry:
            self._bound.append((entry, index, deformation))

    def finish(self) -> None:
        """Add joints and skins, once all nodes are there."""
        joints: dict[Sdf.Path, list[int]] = {}
        for entry, index, deformation in self._bound:
            path = deformation.skeleton.GetPath()
            query = self._cache.GetSkelQuery(deformation.skeleton)
            if path not in self._entries or not query:
                self._stage.conversion.warn(f"{path}: a skeleton that is not shown; its skins are left out")
                continue
            if deformation.query.HasJointInfluences():
                if path not in joints:
                    joints[path] = self._joints(query, self._entries[path])
                entry["skin"] = self._skin(deformation, query, joints[path])
            if deformation.shapes:
                self._weigh(entry, index, deformation, query)

    def _joints(self, query: UsdSkel.SkeletonQuery, entry: dict[str, Any]) -> list[int]:
        """Nodes of the joints, below the skeleton's."""
        names, topology = query.GetJointOrder(), query.GetTopology()
        animation = query.GetAnimQuery()
        given = list(animation.GetJointTransformTimeSamples()) if animation else []
        times = self._animations.sampled(given, curved=False) if len(given) > 1 else [self._stage.time.GetValue()]
        matrices = np.array([np.array(query.ComputeJointLocalTransforms(Usd.TimeCode(time))) for time in times])
        matrices = matrices.reshape(len(times), -1, 4, 4)
        if matrices.shape[1] != len(names):
            raise SceneError(f"{query.GetPrim().GetPath()}: its transforms do not fit its {len(names)} joints")
        nodes: list[int] = []
        for row, name in enumerate(names):
            pose = decomposed(matrices[:, row].transpose(0, 2, 1))
            node: dict[str, Any] = {"name": str(name).rsplit("/", 1)[-1]}
            if pose is None:
                self._stage.conversion.warn(f"{query.GetPrim().GetPath()}: joints with shear keep their first pose")
                node["matrix"] = matrices[0, row].reshape(-1).tolist()
            else:
                node |= {path: keys[0].tolist() for path, keys in pose._asdict().items()}
            nodes.append(self._asset.add("nodes", node))
            if pose is not None and len(times) > 1:
                self._animations.add(nodes[-1], times, pose._asdict())
            parent = topology.GetParent(row)
            holder = entry if parent < 0 else self._asset.entry("nodes", nodes[parent])
            holder.setdefault("children", []).append(nodes[-1])
        return nodes

    def _skin(self, deformation: Deformation, query: UsdSkel.SkeletonQuery, joints: list[int]) -> int:
        """The skin of a prim: its own order of joints, and its own space."""
        bind = np.array(deformation.skeleton.GetBindTransformsAttr().Get() or [], float).reshape(-1, 4, 4)
        names = [str(name) for name in query.GetJointOrder()]
        order = [str(name) for name in deformation.query.GetJointOrder() or names]
        unknown = set(order) - set(names)
        if len(bind) != len(names) or unknown:
            fault = f"no joint {min(unknown)!r}" if unknown else f"{len(bind)} bindTransforms for {len(names)} joints"
            raise SceneError(f"{deformation.skeleton.GetPath()}: {fault}")
        rows = [names.index(name) for name in order]
        own = np.array(deformation.query.GetGeomBindTransform(self._stage.time)).T
        singular = np.abs(np.linalg.det(bind[rows])) < 1e-30
        inverse = np.linalg.inv(np.where(singular[:, None, None], np.eye(4), bind[rows].transpose(0, 2, 1)))
        entry = {"joints": [joints[row] for row in rows], "inverseBindMatrices": self._asset.accessor(inverse @ own)}
        return self._asset.add_once("skins", entry)

    def _weigh(self, entry: dict[str, Any], index: int, deformation: Deformation, query: UsdSkel.SkeletonQuery) -> None:
        """Weights of blend shapes, which the skeleton's animation has by their names."""
        animation = query.GetAnimQuery()
        names = [str(name) for name in animation.GetBlendShapeOrder() or ()] if animation else []
        given = list(animation.GetBlendShapeWeightTimeSamples()) if animation else []
        times = self._animations.sampled(given, curved=False) if len(given) > 1 else [self._stage.time.GetValue()]
        keys = np.zeros((len(times), len(deformation.shapes)))
        for row, time in enumerate(times):
            weights = animation.ComputeBlendShapeWeights(Usd.TimeCode(time)) if animation else None
            found = dict(zip(names, weights or (), strict=False))
            keys[row] = [found.get(name, 0.0) for name in deformation.shapes]
        entry["weights"] = keys[0].tolist()
        if len(times) > 1:
            self._animations.add(index, times, {"weights": keys})

"""Point instancers: copies of meshes, by EXT_mesh_gpu_instancing."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Usd, UsdGeom

from pica.scene.gltf_export.instances import instancing
from pica.scene.usd.stage import Stage

_INSTANCE_BYTES = 1000


def add_copies(stage: Stage, prim: Usd.Prim, mesh_of: Callable[[Usd.Prim], int | None]) -> list[int]:
    """Nodes of the copies of each mesh of an instancer, relative to it."""
    instancer, time = UsdGeom.PointInstancer(prim), stage.time
    indices = np.asarray(instancer.GetProtoIndicesAttr().Get(time) or [], np.intp)
    stage.conversion.budget.take(instances=len(indices), bytes=len(indices) * _INSTANCE_BYTES)
    matrices = _matrices(instancer, time, len(indices))
    if matrices is None:
        stage.conversion.warn(f"{prim.GetPath()}: its arrays do not fit each other; left out")
        return []
    mask = instancer.ComputeMaskAtTime(time)
    shown = np.ones(len(indices), bool) if not len(mask) else np.asarray(mask, bool)
    if instancer.GetPositionsAttr().GetNumTimeSamples() > 1:
        stage.conversion.warn("the motion of point instancers is left out")
    nodes = []
    for number, path in enumerate(instancer.GetPrototypesRel().GetForwardedTargets()):
        rows = np.flatnonzero((indices == number) & shown)
        prototype = prim.GetStage().GetPrimAtPath(path)
        if not len(rows) or not prototype:
            continue
        for part, matrix in _parts(stage, prototype):
            mesh = mesh_of(part)
            if mesh is not None:
                nodes.append(_node(stage, part.GetName(), mesh, matrices[rows] @ matrix))
    return nodes


def _matrices(instancer: UsdGeom.PointInstancer, time: Usd.TimeCode, count: int) -> NDArray[np.float64] | None:
    """(copies, 4, 4) of all copies; None where arrays have other lengths."""
    positions = np.array(instancer.GetPositionsAttr().Get(time) or np.zeros((0, 3)), float).reshape(-1, 3)
    turns = instancer.GetOrientationsAttr().Get(time)
    scales = instancer.GetScalesAttr().Get(time)
    if len(positions) != count or (turns and len(turns) != count) or (scales and len(scales) != count):
        return None
    matrices = np.tile(np.eye(4), (count, 1, 1))
    if turns:
        for row, turn in enumerate(turns):
            matrices[row, :3, :3] = np.array(Gf.Matrix3d(Gf.Quatd(turn))).T
    if scales:
        matrices[:, :3, :3] *= np.array(scales, float)[:, None, :]
    matrices[:, :3, 3] = positions
    return matrices


def _parts(stage: Stage, prototype: Usd.Prim) -> list[tuple[Usd.Prim, NDArray[np.float64]]]:
    """The prims of a prototype, and their matrices with its own."""
    cache = UsdGeom.XformCache(stage.time)
    above = np.array(cache.GetParentToWorldTransform(prototype)).T
    inverse = np.linalg.inv(above) if abs(np.linalg.det(above)) > 1e-30 else np.eye(4)
    predicate = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
    return [
        (prim, inverse @ np.array(cache.GetLocalToWorldTransform(prim)).T)
        for prim in Usd.PrimRange(prototype, predicate)
        if prim.IsA(UsdGeom.Gprim)
    ]


def _node(stage: Stage, name: str, mesh: int, matrices: NDArray[np.float64]) -> int:
    extension, accessor = instancing(stage.conversion.asset, matrices)
    entry: dict[str, Any] = {"name": name, "mesh": mesh}
    if extension is not None:
        entry["extensions"] = stage.conversion.asset.extensions(EXT_mesh_gpu_instancing=extension)
    else:
        entry["extras"] = stage.conversion.asset.extras({}, {"instances": accessor})
    return stage.conversion.asset.add("nodes", entry)

"""Prims become nodes, each with what it shows."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom, UsdShade

from pica.errors import SceneError
from pica.scene.conversion.conversion import Z_UP, Conversion
from pica.scene.limits import OBJECT_BYTES
from pica.scene.usd.animations import Animations
from pica.scene.usd.cameras import camera_entry
from pica.scene.usd.domes import dome_environment
from pica.scene.usd.instancers import add_copies
from pica.scene.usd.lights import DOMES, Lights
from pica.scene.usd.materials import Materials
from pica.scene.usd.meshes import Meshes
from pica.scene.usd.skeletons import Skeletons
from pica.scene.usd.stage import Stage

_HIDDEN_PURPOSES = (UsdGeom.Tokens.proxy, UsdGeom.Tokens.guide)
_SHOWN = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)


def add_stage(conversion: Conversion) -> None:
    """Add the nodes of a stage. Raises SceneError, or whatever the library does."""
    stage = Stage(conversion)
    builder = _Nodes(stage)
    for prim in stage.usd.GetPseudoRoot().GetFilteredChildren(_SHOWN):
        builder.add(prim)
    builder.finish()


class _Nodes:
    """Builds the hierarchy."""

    def __init__(self, stage: Stage) -> None:
        self._stage, self._asset = stage, stage.conversion.asset
        self._unit = float(UsdGeom.GetStageMetersPerUnit(stage.usd))
        if not 0 < self._unit < 1e9:
            raise SceneError(f"metersPerUnit: {self._unit:g} is no unit")
        self._root = (Z_UP if stage.up == "z" else np.eye(4)) @ np.diag([self._unit] * 3 + [1.0])
        self._meshes = Meshes(stage, Materials(stage))
        self._lights, self._animations = Lights(stage), Animations(stage)
        self._skeletons = Skeletons(stage, self._animations)
        self._environment: dict[str, Any] | None = None
        self._has_dome = False
        self._roots: list[int] = []

    def finish(self) -> None:
        """After all prims."""
        self._skeletons.finish()
        self._animations.finish()
        extras = {} if self._environment is None else {"environment": self._environment}
        self._stage.conversion.show(self._roots, self._stage.up, self._unit, extras)

    def add(self, top: Usd.Prim) -> None:
        """Add a root prim with all below it."""
        stack: list[tuple[Usd.Prim, dict[str, Any] | None, bool]] = [(top, None, True)]
        while stack:
            prim, parent, visible = stack.pop()
            if _is_data(prim):
                continue
            visible = visible and self._is_visible(prim)
            entry, index = self._node(prim, visible)
            if parent is None or (prim.IsA(UsdGeom.Xformable) and UsdGeom.Xformable(prim).GetResetXformStack()):
                self._roots.append(index)
            else:
                parent.setdefault("children", []).append(index)
            if prim.IsA(UsdGeom.PointInstancer):
                if visible:
                    copies = add_copies(self._stage, prim, self._meshes.get)
                    entry.setdefault("children", []).extend(copies)
                continue  # what is below are prototypes
            stack += [(child, entry, visible) for child in reversed(prim.GetFilteredChildren(_SHOWN))]

    def _is_visible(self, prim: Usd.Prim) -> bool:
        if not prim.IsA(UsdGeom.Imageable):
            return True
        imageable = UsdGeom.Imageable(prim)
        visibility = imageable.GetVisibilityAttr()
        if visibility.GetNumTimeSamples() > 1:
            self._stage.conversion.warn("visibility over time is left out")
        purpose = imageable.GetPurposeAttr().Get()
        return visibility.Get(self._stage.time) != UsdGeom.Tokens.invisible and purpose not in _HIDDEN_PURPOSES

    def _node(self, prim: Usd.Prim, visible: bool) -> tuple[dict[str, Any], int]:
        """The entry of a prim, without its children, and its index."""
        self._stage.conversion.budget.take(bytes=OBJECT_BYTES)
        entry: dict[str, Any] = {"name": prim.GetName()}
        times: list[float] = []
        pose = deformation = None
        if prim.IsA(UsdGeom.Xformable):
            xform = UsdGeom.Xformable(prim)
            times = self._animations.times(xform)
            pose = self._animations.pose(xform, times) if times else None
            if pose is None:
                matrix = xform.GetLocalTransformation(self._stage.time)
                entry |= _matrix(np.array(matrix))
            else:
                first = {"translation": pose.translation, "rotation": pose.rotation, "scale": pose.scale}
                entry |= {path: keys[0].tolist() for path, keys in first.items()}
        entry["camera"] = camera_entry(self._stage, prim, self._unit)
        kind = str(prim.GetTypeName())
        if kind.endswith(("Light", "Camera")) and _changes(prim):
            self._stage.conversion.warn(f"prims of type {kind} keep the values of the start time code")
        if visible:
            deformation = self._skeletons.get(prim)
            entry["mesh"] = self._meshes.get(prim, deformation)
            if prim.GetTypeName() in DOMES:
                self._add_dome(prim)
            else:
                entry |= self._lights.get(prim, self._scale(prim))
        index = self._asset.add("nodes", entry)
        if pose is not None:
            self._animations.add(index, times, pose._asdict())
        kept = self._asset.entry("nodes", index)
        self._skeletons.add(prim, kept, index, deformation)
        return kept, index

    def _scale(self, prim: Usd.Prim) -> float:
        """Metres of a unit at a light."""
        if not prim.GetTypeName().endswith("Light"):
            return 1.0
        return float(abs(np.linalg.det((self._root @ self._stage.world(prim).T)[:3, :3])) ** (1 / 3))

    def _add_dome(self, prim: Usd.Prim) -> None:
        if self._has_dome:
            self._stage.conversion.warn(f"{prim.GetPath()}: one dome light is read, further ones are left out")
            return
        self._has_dome = True
        self._environment = dome_environment(self._stage, prim, self._root @ self._stage.world(prim).T)


def _is_data(prim: Usd.Prim) -> bool:
    """Whether a prim is part of others and no node: a shader, a material, faces, or a scope with nothing else."""
    if prim.IsA(UsdShade.Shader) or prim.IsA(UsdShade.NodeGraph) or prim.IsA(UsdGeom.Subset):
        return True
    if prim.GetTypeName() not in ("Scope", ""):
        return False
    children = prim.GetFilteredChildren(_SHOWN)
    return all(child.IsA(UsdShade.Shader) or child.IsA(UsdShade.NodeGraph) for child in children)


def _changes(prim: Usd.Prim) -> bool:
    """Whether values besides the transform and the visibility change over time."""
    given = (each for each in prim.GetAuthoredAttributes() if not str(each.GetName()).startswith(("xformOp:", "visib")))
    return any(each.ValueMightBeTimeVarying() for each in given)


def _matrix(rows: NDArray[np.float64]) -> dict[str, Any]:
    """A node's matrix: USD's rows are glTF's columns."""
    return {} if np.array_equal(rows, np.eye(4)) else {"matrix": rows.reshape(-1).tolist()}

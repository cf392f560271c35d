"""Meshes: polygons, their primvars and the parts of their materials."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom, UsdShade

from pica.errors import SceneError
from pica.scene.conversion.triangles import fans
from pica.scene.gltf_export.container import INDICES, VERTICES
from pica.scene.normals import vertex_normals
from pica.scene.usd.curves import read_curves
from pica.scene.usd.geometry import Geometry, Part, part
from pica.scene.usd.materials import BoundMaterial, Materials
from pica.scene.usd.points import read_points
from pica.scene.usd.primitives import read_primitive
from pica.scene.usd.primvars import Primvar, Sizes, color_primvars, coordinate_primvars, fitting, read_primvar, rows_of
from pica.scene.usd.skeletons import Deformation
from pica.scene.usd.stage import Stage
from pica.scene.usd.subdivision import Polygons, subdivide

LEVELS = 2
"""Of subdivision."""
_MOST_FACES = 1_000_000
"""Of a mesh after subdivision; larger ones get fewer levels."""
_VERTEX_BYTES = 300
"""Memory for a corner while it is read."""
_READ = ("Mesh", "BasisCurves", "Points", "Sphere", "Cube", "Plane", "Cylinder", "Cone", "Capsule")
_LEFT_OUT = ("NurbsCurves", "HermiteCurves", "NurbsPatch", "TetMesh", "Volume")


class Meshes:
    """The meshes of a stage; prims of the same prototype share one."""

    def __init__(self, stage: Stage, materials: Materials) -> None:
        self._stage, self._materials = stage, materials
        self._asset = stage.conversion.asset
        self._added: dict[tuple[Any, ...], int | None] = {}

    def get(self, prim: Usd.Prim, deformation: Deformation | None = None) -> int | None:
        """The index of a prim's mesh; None where it has no triangles."""
        kind = prim.GetTypeName()
        if kind in _LEFT_OUT:
            self._stage.conversion.warn(f"prims of type {kind} are left out")
        if kind not in _READ:
            return None
        points = prim.GetAttribute("points")
        if points and points.GetNumTimeSamples() > 1:
            self._stage.conversion.warn("the motion of points is left out")
        source = prim.GetPrimInPrototype() if prim.IsInstanceProxy() else prim
        bound = self._bindings(prim)
        key = source.GetPath(), *(material for _, material in bound), id(deformation) if deformation else 0
        if key not in self._added:
            try:
                self._added[key] = self._mesh(prim, bound, deformation)
            except SceneError as error:
                raise SceneError(f"{prim.GetPath()}: {error}") from None
        return self._added[key]

    def _bindings(self, prim: Usd.Prim) -> list[tuple[NDArray[np.intp] | None, BoundMaterial]]:
        """Faces and materials of the parts; None for faces that are in no other part."""
        gprim = UsdGeom.Gprim(prim)
        two_sided = bool(gprim.GetDoubleSidedAttr().Get(self._stage.time))
        subsets = UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets() if prim.GetTypeName() == "Mesh" else []
        bound: list[tuple[NDArray[np.intp] | None, BoundMaterial]] = []
        for subset in subsets:
            faces = _integers(subset.GetIndicesAttr(), self._stage.time)
            bound.append((faces, self._materials.bound(subset.GetPrim(), two_sided)))
        bound.append((None, self._materials.bound(prim, two_sided)))
        return bound

    def _mesh(
        self,
        prim: Usd.Prim,
        bound: list[tuple[NDArray[np.intp] | None, BoundMaterial]],
        deformation: Deformation | None,
    ) -> int | None:
        is_mesh = prim.GetTypeName() == "Mesh"
        geometry = self._polygons(prim, deformation) if is_mesh else self._shape(prim)
        if geometry is None or not len(geometry.counts):
            return None
        faces_of = self._subdivided(prim, geometry, deformation) if is_mesh else np.arange(len(geometry.counts))
        if geometry.smooth:
            geometry.attributes["NORMAL"] = _smooth_normals(geometry)
        shown = np.ones(len(geometry.counts), bool)
        if is_mesh:
            holes = _integers(UsdGeom.Mesh(prim).GetHoleIndicesAttr(), self._stage.time)
            shown[np.isin(faces_of, holes)] = False
        primitives = []
        for faces, material in bound:
            rows = shown & np.isin(faces_of, faces) if faces is not None else shown
            shown = shown & ~rows
            made = self._part(geometry, np.flatnonzero(rows), material)
            primitives += [] if made is None else [made]
        if not primitives:
            return None
        # Equal meshes are one, as those of references that are no instances.
        return self._asset.add_once("meshes", {"name": prim.GetName(), "primitives": primitives})

    def _shape(self, prim: Usd.Prim) -> Geometry | None:
        """Curves, points and primitives."""
        if prim.GetTypeName() == "BasisCurves":
            return read_curves(self._stage, prim)
        if prim.GetTypeName() == "Points":
            return read_points(self._stage, prim)
        geometry = read_primitive(prim, self._stage.time)
        if geometry is not None:
            sizes = Sizes.of_mesh(len(geometry.points), len(geometry.corners), len(geometry.counts))
            geometry.attributes["UV:st"] = geometry.attributes.pop("st")
            geometry.attributes |= color_primvars(prim, self._stage.time, sizes)
        return geometry

    def _polygons(self, prim: Usd.Prim, deformation: Deformation | None) -> Geometry:
        mesh, time = UsdGeom.Mesh(prim), self._stage.time
        given = mesh.GetPointsAttr().Get(time)
        points = np.zeros((0, 3)) if given is None or not len(given) else rows_of(given)
        counts = _integers(mesh.GetFaceVertexCountsAttr(), time)
        corners = _integers(mesh.GetFaceVertexIndicesAttr(), time)
        if (counts < 0).any() or counts.sum() != len(corners):
            raise SceneError(f"faceVertexCounts: ask for {int(counts.sum())} corners, and there are {len(corners)}")
        if len(corners) and not (corners.min() >= 0 and corners.max() < len(points)):
            raise SceneError(f"faceVertexIndices: name point {int(corners.max())} of {len(points)}")
        self._stage.conversion.budget.take(vertices=len(points), bytes=len(corners) * _VERTEX_BYTES)
        geometry = Geometry(points, counts, corners)
        geometry.left_handed = mesh.GetOrientationAttr().Get(time) == UsdGeom.Tokens.leftHanded
        sizes = Sizes.of_mesh(len(points), len(corners), len(counts))
        geometry.attributes |= coordinate_primvars(prim, time, sizes) | color_primvars(prim, time, sizes)
        normals = read_primvar(prim, "normals", time, sizes)
        if normals is None and mesh.GetNormalsAttr().HasValue():
            values = rows_of(mesh.GetNormalsAttr().Get(time))
            normals = fitting("normals", values, None, str(mesh.GetNormalsInterpolation()), sizes)
        if normals is not None and normals.values.shape[1] == 3:
            geometry.attributes["NORMAL"] = normals
        if deformation is not None:
            geometry.of_points, geometry.targets = deformation.of_points(prim, len(points))
        return geometry

    def _subdivided(self, prim: Usd.Prim, geometry: Geometry, deformation: Deformation | None) -> NDArray[np.intp]:
        """Subdivide as the mesh says; the face that each one comes from."""
        mesh, time = UsdGeom.Mesh(prim), self._stage.time
        scheme = mesh.GetSubdivisionSchemeAttr().Get(time)
        faces = np.arange(len(geometry.counts))
        if scheme in (UsdGeom.Tokens.none, UsdGeom.Tokens.bilinear) or "NORMAL" in geometry.attributes:
            return faces
        geometry.smooth = True
        corner_count = len(geometry.corners)
        levels = next((n for n in range(LEVELS, 0, -1) if corner_count * 4 ** (n - 1) <= _MOST_FACES), 0)
        if scheme == UsdGeom.Tokens.loop or deformation is not None:
            self._stage.conversion.warn("subdivision by Loop's scheme and of deformed meshes is left out")
            return faces
        if levels < LEVELS:
            self._stage.conversion.warn(f"meshes of more than {_MOST_FACES // 4:,} faces are subdivided less")
        self._stage.conversion.budget.take(
            vertices=corner_count * 4**levels // 2, bytes=corner_count * 4**levels * _VERTEX_BYTES
        )
        face_of = np.repeat(faces, geometry.counts)
        expanded = {
            name: primvar.values[primvar.rows(geometry.corners, face_of)]
            for name, primvar in geometry.attributes.items()
            if primvar.interpolation not in ("constant", "uniform")
        }
        data = np.column_stack([np.zeros((corner_count, 0)), *expanded.values()])
        polygons = Polygons(
            geometry.counts,
            geometry.corners,
            geometry.points.astype(np.float64),
            data,
            faces,
            *self._creases(mesh, len(geometry.points)),
        )
        for _ in range(levels):
            polygons = subdivide(polygons)
        geometry.points, geometry.counts, geometry.corners = polygons.vertices, polygons.counts, polygons.corners
        column = 0
        for name, values in expanded.items():
            width = values.shape[1]
            part_of = polygons.corner_data[:, column : column + width].astype(np.float32)
            geometry.attributes[name] = Primvar(part_of, np.arange(len(part_of)), "faceVarying")
            column += width
        for name, primvar in geometry.attributes.items():
            if primvar.interpolation == "uniform":
                geometry.attributes[name] = Primvar(primvar.values, primvar.indices[polygons.face], "uniform")
        return polygons.face

    def _creases(self, mesh: UsdGeom.Mesh, count: int) -> tuple[Any, Any, Any]:
        """Edges, their sharpness, and that of vertices."""
        time = self._stage.time
        lengths = _integers(mesh.GetCreaseLengthsAttr(), time)
        indices = _integers(mesh.GetCreaseIndicesAttr(), time)
        sharp = _numbers(mesh.GetCreaseSharpnessesAttr(), time)
        at_corners = np.zeros(count)
        corners = _integers(mesh.GetCornerIndicesAttr(), time)
        corner_sharp = _numbers(mesh.GetCornerSharpnessesAttr(), time)
        known = (lengths >= 2).all() and lengths.sum() == len(indices) and len(corners) == len(corner_sharp)
        everything = np.concatenate([indices, corners])
        if not known or (len(everything) and not (everything.min() >= 0 and everything.max() < count)):
            raise SceneError("creaseIndices, creaseLengths and cornerIndices do not fit each other")
        at_corners[corners] = corner_sharp
        last = np.cumsum(lengths) - 1
        first = np.delete(np.arange(len(indices)), last)
        edges = np.stack([indices[first], indices[first + 1]], axis=1) if len(first) else np.zeros((0, 2), np.intp)
        if len(sharp) == len(lengths):
            sharp = np.repeat(sharp, np.maximum(lengths - 1, 0))
        if len(sharp) != len(edges):
            raise SceneError(f"creaseSharpnesses: {len(sharp)} for {len(edges)} edges")
        return edges, sharp, at_corners

    def _part(self, geometry: Geometry, faces: NDArray[np.intp], bound: BoundMaterial) -> dict[str, Any] | None:
        """A primitive of some faces with a material."""
        wanted = {"NORMAL": "NORMAL"} | {f"UV:{name}": f"TEXCOORD_{row}" for row, name in enumerate(bound.uv_names)}
        named = {key: geometry.attributes[name] for name, key in wanted.items() if name in geometry.attributes}
        if bound.takes_colors:
            named |= {name: geometry.attributes[name] for name in ("COLOR", "OPACITY") if name in geometry.attributes}
        own = Geometry(
            geometry.points,
            geometry.counts,
            geometry.corners,
            named,
            geometry.of_points,
            left_handed=geometry.left_handed,
        )
        made = part(own, None if len(faces) == len(geometry.counts) else faces)
        if made is None:
            return None
        attributes = _finished(made)
        asset = self._asset
        primitive: dict[str, Any] = {
            "attributes": {name: asset.accessor(values, VERTICES) for name, values in attributes.items()},
            "indices": asset.accessor(made.triangles.reshape(-1), INDICES),
            "material": bound.with_opacity
            if "OPACITY" in made.attributes and bound.with_opacity is not None
            else bound.number,
        }
        if geometry.targets:
            primitive["targets"] = [
                {
                    name: asset.accessor(offsets[made.points].astype(np.float32), VERTICES)
                    for name, offsets in target.items()
                }
                for target in geometry.targets
            ]
        return primitive


def _finished(made: Part) -> dict[str, NDArray[Any]]:
    """Attributes as glTF has them."""
    attributes = dict(made.attributes)
    for name in [name for name in attributes if name.startswith("TEXCOORD")]:
        attributes[name] = np.column_stack([attributes[name][:, 0], 1 - attributes[name][:, 1]])
    color, opacity = attributes.pop("COLOR", None), attributes.pop("OPACITY", None)
    if color is not None or opacity is not None:
        count = len(attributes["POSITION"])
        color = np.ones((count, 3), np.float32) if color is None else color[:, :3]
        opacity = np.ones((count, 1), np.float32) if opacity is None else opacity[:, :1]
        attributes["COLOR_0"] = np.clip(np.column_stack([color, opacity]), 0, 1).astype(np.float32)
    return attributes


def _smooth_normals(geometry: Geometry) -> Primvar:
    """Averages of the faces round each point."""
    triangles = geometry.corners[fans(geometry.counts)].astype(np.uint32)
    ordered = triangles[:, ::-1] if geometry.left_handed else triangles
    normals = vertex_normals(geometry.points.astype(np.float32), ordered)
    return Primvar(normals, np.arange(len(normals)), "vertex")


def _integers(attribute: Usd.Attribute, time: Usd.TimeCode) -> NDArray[np.intp]:
    given = attribute.Get(time)
    return np.zeros(0, np.intp) if given is None else np.asarray(given, np.intp)


def _numbers(attribute: Usd.Attribute, time: Usd.TimeCode) -> NDArray[np.float64]:
    given = attribute.Get(time)
    return np.zeros(0) if given is None else np.asarray(given, np.float64)

"""Meshes as trimesh reads them become nodes and meshes of glTF."""

import io
import re
from collections.abc import Callable
from html import unescape
from typing import Any

import numpy as np
from numpy.typing import NDArray
from trimesh.exchange.dae import load_collada
from trimesh.exchange.obj import load_obj
from trimesh.exchange.ply import load_ply
from trimesh.exchange.stl import load_stl
from trimesh.exchange.threemf import load_3MF
from trimesh.resolvers import Resolver
from trimesh.visual.material import PBRMaterial

from pica.color import srgb_decode
from pica.errors import SceneError
from pica.scene.conversion.conversion import Conversion
from pica.scene.conversion.pictures import Pictures
from pica.scene.conversion.triangles import fans
from pica.scene.gltf_export.container import INDICES, VERTICES
from pica.scene.mesh_files import mtl
from pica.scene.mesh_files.faces import with_absolute_indices, with_ears
from pica.scene.mesh_files.ply import with_triangles
from pica.scene.normals import vertex_normals

Geometry = dict[str, Any]
"""What trimesh's loaders give of one mesh."""

_LOADERS: dict[str, Callable[..., Geometry]] = {
    ".obj": load_obj, ".ply": load_ply, ".stl": load_stl, ".3mf": load_3MF, ".dae": load_collada,
}  # fmt: skip
_METRES = {
    "micron": 1e-6, "millimeter": 1e-3, "millimeters": 1e-3, "centimeter": 1e-2, "inch": 0.0254, "foot": 0.3048,
    "meter": 1.0, "meters": 1.0,
}  # fmt: skip
"""Units of 3MF (3MF Core Specification 1.3, 3.4), and as trimesh has them of COLLADA."""
_WHITE = {"pbrMetallicRoughness": {"metallicFactor": 0.0}, "doubleSided": True}
_SMOOTHING = re.compile(rb"^s\s+(?!off|0\s*$)\S", re.MULTILINE)
"""A smoothing group of OBJ."""
_INDENT = re.compile(rb"^ +", re.MULTILINE)
_LIBRARY = re.compile(rb"\nmtllib ++(.*\S)")
_AFTER_NAME = re.compile(r"(?<=\.mtl)\s+", re.IGNORECASE)
_ABOUT = re.compile(rb"<(copyright|authoring_tool)>([^<]*)</")
"""Of COLLADA (COLLADA 1.4.1, contributor)."""
_UP_AXIS = re.compile(rb"<up_axis>\s*([XYZ])_UP")


def add_meshes(conversion: Conversion) -> None:
    """Add a node for each mesh of the file. Raises SceneError, or whatever trimesh does."""
    MeshReader(conversion).add()


class _Files(Resolver):
    """The files that trimesh may read: materials of OBJ as text, and pictures of COLLADA."""

    def __init__(self, conversion: Conversion, libraries: list[str]) -> None:
        self._conversion, self._libraries = conversion, libraries
        self.materials: dict[str, mtl.Lines] = {}
        self.has_pictures = False
        """Otherwise pictures of materials are trimesh's own."""

    def get(self, key: str) -> bytes:
        """The content of a file; of OBJ the names of all materials. Raises KeyError where it cannot be read."""
        if self._libraries:
            return self._names()
        content = self._conversion.file(key, "image")
        if content is None:
            raise KeyError(key)
        self.has_pictures = True
        return content

    def _names(self) -> bytes:
        """As MTL: mtl.py reads all else."""
        for name in self._libraries:
            content = self._conversion.file(name, "mtllib")
            self.materials |= mtl.parse((content or b"").decode("utf-8", "replace"))
        return "".join(f"newmtl {name}\n" for name in self.materials).encode()

    def keys(self) -> list[str]:
        """None can be listed."""
        return []

    def write(self, name: str, data: Any) -> None:
        """Nothing is written."""

    def namespaced(self, namespace: str) -> "Resolver":
        """Of another folder."""
        return self


class MeshReader:
    """Reads one file."""

    def __init__(self, conversion: Conversion) -> None:
        self._conversion, self._asset = conversion, conversion.asset
        self._content = conversion.files.read_asset()
        self._kind = conversion.path.suffix.lower()
        self._pictures = Pictures(conversion)
        libraries: list[str] = []
        if self._kind == ".obj":
            self._content = with_ears(with_absolute_indices(_tidied(self._content)))
            libraries = _libraries(self._content)
        elif self._kind == ".ply":
            self._content = with_triangles(self._content, conversion.budget)
        self._files = _Files(conversion, libraries)
        self._collada: dict[int, int] = {}

    def add(self) -> None:
        """As add_meshes."""
        more = {"split_objects": True} if self._kind == ".obj" else {}
        stream = io.BytesIO(self._content)
        loaded = _LOADERS[self._kind](stream, resolver=self._files, file_type=self._kind[1:], **more)
        self._materials = mtl.Materials(self._conversion, self._pictures, self._files.materials)
        geometries: dict[str, Geometry] = loaded.get("geometry", {"": loaded})
        graph = loaded.get("graph") or [{"geometry": name} for name in geometries]
        meshes: dict[str, int | None] = {}
        nodes = []
        for placed in graph:
            name = placed.get("geometry")
            if name not in geometries:
                continue
            if name not in meshes:
                meshes[name] = self._mesh(name, geometries[name])
            matrix = np.asarray(placed.get("matrix", np.eye(4)), np.float64)
            entry: dict[str, Any] = {"name": str(placed.get("frame_to", name)), "mesh": meshes[name]}
            if not np.array_equal(matrix, np.eye(4)):
                entry["matrix"] = matrix.T.reshape(-1).tolist()
            nodes.append(self._asset.add("nodes", entry))
        if all(mesh is None for mesh in meshes.values()):
            raise SceneError("holds no triangles")
        if self._kind == ".dae":
            self._describe()
        self._conversion.show(nodes, self._up(), self._unit(loaded))

    def _describe(self) -> None:
        """Keep the first contributor's copyright and program."""
        first = {key: text for key, text in reversed(_ABOUT.findall(self._content))}
        texts = (unescape(first.get(key, b"").decode("utf-8", "replace")) for key in (b"copyright", b"authoring_tool"))
        rights, program = map(str.strip, texts)
        self._asset.describe(rights, program)

    def _up(self) -> str:
        """The axis that points up in the file."""
        found = _UP_AXIS.search(self._content) if self._kind == ".dae" else None
        if found and found[1] == b"X":
            self._conversion.warn("its X axis points up, which is left as it is")
        custom = self._conversion.custom_up or "y"
        return "z" if found and found[1] == b"Z" else custom

    def _unit(self, loaded: Geometry) -> float:
        """Metres."""
        holders = [loaded, *loaded.get("geometry", {}).values()]
        text = next((each["metadata"]["units"] for each in holders if "units" in each.get("metadata", {})), "meters")
        if text.endswith(" * meters"):
            return float(text.removesuffix(" * meters"))
        if text not in _METRES:
            raise SceneError(f"{text!r} is not a unit; there are {', '.join(_METRES)}")
        return _METRES[text]

    def _mesh(self, name: str, geometry: Geometry) -> int | None:
        """The index of a mesh; None where it has no triangles."""
        positions = np.asarray(geometry.get("vertices", ()), np.float32)
        if positions.ndim != 2 or "faces" not in geometry or not len(geometry["faces"]):
            self._conversion.warn("points without triangles are left out")
            return None
        triangles = _triangles(geometry["faces"], len(positions))
        self._conversion.budget.take(vertices=len(positions), bytes=12 * triangles.size)
        visual = geometry.get("visual")
        attributes: dict[str, NDArray[Any]] = {"POSITION": positions}
        normals = geometry.get("vertex_normals")
        if self._kind == ".obj" and normals is None and _SMOOTHING.search(self._content):
            normals = _smooth(positions, triangles)
        if normals is not None and np.shape(normals) == positions.shape:
            attributes["NORMAL"] = np.asarray(normals, np.float32)
        uv = getattr(visual, "uv", None)
        if uv is not None and len(uv) == len(positions):
            attributes["TEXCOORD_0"] = _pointing_down(np.asarray(uv, np.float32))
        colors = _linear(geometry.get("vertex_colors"), len(positions))
        if colors is not None:
            attributes["COLOR_0"] = colors
        faces = _linear(geometry.get("face_colors"), len(triangles))
        if faces is not None and colors is None:  # vertices of triangles of different colours are not shared
            attributes = {key: values[triangles.reshape(-1)] for key, values in attributes.items()}
            attributes["COLOR_0"] = np.repeat(faces, 3, axis=0)
            triangles = np.arange(triangles.size, dtype=np.uint32).reshape(-1, 3)
        primitive = {
            "attributes": {key: self._asset.accessor(values, VERTICES) for key, values in attributes.items()},
            "indices": self._asset.accessor(triangles.reshape(-1), INDICES),
            "material": self._material(visual),
        }
        return self._asset.add("meshes", {"name": name, "primitives": [primitive]})

    def _material(self, visual: Any) -> int:
        material = getattr(visual, "material", None)
        if isinstance(material, PBRMaterial):
            if id(material) not in self._collada:
                self._collada[id(material)] = self._asset.add("materials", self._physical(material))
            return self._collada[id(material)]
        index = self._materials.get(material.name) if self._kind == ".obj" and material is not None else None
        if index is not None:
            return index
        texture = self._picture(getattr(material, "image", None))
        base = {"metallicFactor": 0.0} | ({} if texture is None else {"baseColorTexture": texture})
        return self._asset.add_once("materials", _WHITE | {"pbrMetallicRoughness": base})

    def _physical(self, material: PBRMaterial) -> dict[str, Any]:
        """Of COLLADA, as trimesh converts its Phong model."""
        color = np.asarray(material.baseColorFactor, np.float64) / 255  # trimesh has bytes
        opacity = float(color[3]) if len(color) > 3 else 1.0
        emission = np.zeros(3) if material.emissiveFactor is None else np.asarray(material.emissiveFactor, float)
        return {
            "name": material.name or "",
            "pbrMetallicRoughness": {
                "baseColorFactor": [*color[:3].tolist(), opacity],
                "baseColorTexture": self._picture(material.baseColorTexture),
                "metallicFactor": float(material.metallicFactor or 0.0),
                "roughnessFactor": float(
                    np.clip(1.0 if material.roughnessFactor is None else material.roughnessFactor, 0, 1)
                ),
            },
            "normalTexture": self._picture(material.normalTexture),
            "emissiveTexture": self._picture(material.emissiveTexture),
            "emissiveFactor": np.clip(emission[:3], 0, 1).tolist(),
            "alphaMode": "BLEND" if opacity < 1 else "OPAQUE",
            "doubleSided": True,
        }

    def _picture(self, image: Any) -> dict[str, Any] | None:
        """The texture of a picture that trimesh has opened."""
        if image is None or not self._files.has_pictures:
            return None
        stream = io.BytesIO()
        image.save(stream, "PNG")
        return self._pictures.texture(self._pictures.add(stream.getvalue(), self._kind))


def _tidied(content: bytes) -> bytes:
    """OBJ after the end of a line, whose lines begin with a word, go on without a backslash and have no tabs."""
    content = b"\n" + content.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ").replace(b"\t", b" ")
    return _INDENT.sub(b"", content) if b"\n " in content else content


def _libraries(content: bytes) -> list[str]:
    """The files of materials of an OBJ file, whose names may have spaces; a statement may name several."""
    lines = [line.decode("utf-8", "replace") for line in _LIBRARY.findall(content)]
    return list(dict.fromkeys(name for line in lines for name in _AFTER_NAME.split(line)))


def _triangles(faces: Any, vertex_count: int) -> NDArray[np.uint32]:
    """(triangles, 3) of faces of any number of corners. Raises SceneError for vertices that are not there."""
    if isinstance(faces, np.ndarray) and faces.ndim == 2:
        counts, corners = np.full(len(faces), faces.shape[1]), faces.reshape(-1)
    else:
        counts = np.array([len(face) for face in faces])
        corners = np.concatenate([np.asarray(face) for face in faces])
    if corners.size and not (corners.min() >= 0 and corners.max() < vertex_count):
        raise SceneError(f"a face names vertex {int(corners.max())}, but there are {vertex_count}")
    return corners[fans(counts)].astype(np.uint32)


def _pointing_down(uv: NDArray[np.float32]) -> NDArray[np.float32]:
    """(vertices, 2) of coordinates whose v points up."""
    return np.column_stack([uv[:, 0], 1 - uv[:, 1]])


def _smooth(positions: NDArray[np.float32], triangles: NDArray[np.uint32]) -> NDArray[np.float32]:
    """(vertices, 3) averages of the triangles round each place; texture coordinates may split vertices there."""
    _, first, of_place = np.unique(positions, axis=0, return_index=True, return_inverse=True)
    of_place = of_place.reshape(-1)
    return vertex_normals(positions[first], of_place[triangles].astype(np.uint32))[of_place]


def _linear(colors: Any, count: int) -> NDArray[np.float32] | None:
    """(count, 4) from 0 to 1 of colours as pictures have them; None where there are none."""
    values = np.asarray(() if colors is None else colors)
    if values.ndim != 2 or len(values) != count or values.shape[1] not in (3, 4):
        return None
    scaled = values.astype(np.float32) / (1 if values.dtype.kind == "f" else np.iinfo(values.dtype).max)
    alpha = scaled[:, 3:] if values.shape[1] == 4 else np.ones((count, 1), np.float32)
    return np.column_stack([srgb_decode(scaled[:, :3]), np.clip(alpha, 0, 1)]).astype(np.float32)

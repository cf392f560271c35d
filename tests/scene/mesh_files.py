"""Cubes and spheres in files of several formats, for the tests."""

import io
import zipfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
import trimesh
from numpy.typing import NDArray

from pica.color import srgb_encode


class Shape(NamedTuple):
    """Triangles with normals of vertices; flat ones share no vertices."""

    positions: NDArray[np.float32]
    normals: NDArray[np.float32]
    triangles: NDArray[np.int64]
    uv: NDArray[np.float32]
    """v up, as all these formats have it."""
    colors: NDArray[np.uint8]
    """sRGB."""


def cube() -> Shape:
    """A cube of 1 m with a corner that is cut off, so that no two axes are alike."""
    corners = trimesh.creation.box().vertices * (1, 1.25, 0.75) + (0, 0.2, 0)
    faces = trimesh.creation.box().faces
    positions = np.float32(corners[faces].reshape(-1, 3))
    return _shape(positions, np.arange(36).reshape(-1, 3), flat=True)


def sphere() -> Shape:
    """A coarse one with smooth normals."""
    made = trimesh.creation.icosphere(subdivisions=2, radius=0.6)
    return _shape(np.float32(made.vertices), np.asarray(made.faces), flat=False)


def _shape(positions: NDArray[np.float32], triangles: NDArray[np.int64], flat: bool) -> Shape:
    if flat:
        edges = positions[triangles]
        normals = np.repeat(np.cross(edges[:, 1] - edges[:, 0], edges[:, 2] - edges[:, 0]), 3, axis=0)
    else:
        normals = positions
    normals = np.float32(normals / np.linalg.norm(normals, axis=1, keepdims=True))
    colors = np.uint8(np.clip(positions * 120 + 128, 0, 255))
    return Shape(positions, normals, triangles, positions[:, :2] + np.float32(0.5), colors)


def obj(shape: Shape, more: str = "", before: str = "", normals: bool = True) -> str:
    """OBJ; `before`: lines before the faces."""
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in shape.positions]
    lines += [f"vt {u:.9g} {v:.9g}" for u, v in shape.uv]
    lines += [f"vn {x:.9g} {y:.9g} {z:.9g}" for x, y, z in shape.normals] if normals else []
    corner = "{0}/{0}/{0}" if normals else "{0}/{0}"
    faces = ["f " + " ".join(corner.format(index + 1) for index in face) for face in shape.triangles.tolist()]
    return "\n".join([more, *lines, before, *faces, ""])


def ply(shape: Shape, colors: bool = False, binary: bool = True) -> bytes:
    """PLY with normals."""
    fields = [(name, "<f4") for name in ("x", "y", "z", "nx", "ny", "nz")]
    fields += [(name, "u1") for name in ("red", "green", "blue")] if colors else []
    vertices = np.zeros(len(shape.positions), fields)
    values = np.column_stack([shape.positions, shape.normals, *([shape.colors] if colors else [])])
    for column, (name, _) in enumerate(fields):
        vertices[name] = values[:, column]
    faces = np.zeros(len(shape.triangles), [("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, shape.triangles
    kind = "binary_little_endian" if binary else "ascii"
    header = ["ply", f"format {kind} 1.0", f"element vertex {len(vertices)}"]
    header += [f"property {'float' if dtype == '<f4' else 'uchar'} {name}" for name, dtype in fields]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header", ""]
    if binary:
        return "\n".join(header).encode() + vertices.tobytes() + faces.tobytes()
    rows = [" ".join(f"{value:.9g}" for value in row) for row in vertices.tolist()]
    rows += [f"3 {a} {b} {c}" for a, b, c in shape.triangles.tolist()]
    return "\n".join([*header[:-1], *rows, ""]).encode()


def stl(shape: Shape, binary: bool = True) -> bytes:
    """STL."""
    mesh = trimesh.Trimesh(shape.positions, shape.triangles, process=False)
    export = trimesh.exchange.stl.export_stl if binary else trimesh.exchange.stl.export_stl_ascii
    content = export(mesh)
    return content if isinstance(content, bytes) else content.encode()


def threemf(shape: Shape, unit: str = "millimeter") -> bytes:
    """3MF, of an object that is placed by its item."""
    scale = {"millimeter": 1000, "meter": 1}[unit]
    vertices = "".join(f'<vertex x="{x:.9g}" y="{y:.9g}" z="{z:.9g}"/>' for x, y, z in shape.positions * scale)
    triangles = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in shape.triangles.tolist())
    namespace = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
    model = (
        f'<model unit="{unit}" xmlns="{namespace}"><resources><object id="1" type="model"><mesh><vertices>{vertices}'
        f"</vertices><triangles>{triangles}</triangles></mesh></object></resources>"
        f'<build><item objectid="1" transform="1 0 0 0 1 0 0 0 1 0 0 0"/></build></model>'
    )
    return packed({"3D/3dmodel.model": model.encode()})


def packed(files: dict[str, bytes]) -> bytes:
    """A zip archive."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, each in files.items():
            archive.writestr(name, each)
    return content.getvalue()


def collada(shape: Shape) -> bytes:
    """COLLADA, white."""
    mesh = trimesh.Trimesh(shape.positions, shape.triangles, vertex_normals=shape.normals, process=False)
    mesh.visual.face_colors = (255, 255, 255, 255)
    content: bytes = trimesh.exchange.dae.export_collada(mesh)
    return content


def linear(colors: NDArray[np.uint8]) -> NDArray[np.float32]:
    """As glTF has them."""
    from pica.color import srgb_decode

    return srgb_decode(colors / np.float32(255))


def encoded(colors: NDArray[np.float32]) -> NDArray[np.uint8]:
    """As pictures have them."""
    return np.uint8(np.round(srgb_encode(colors) * 255))


def write(folder: Path, name: str, shape: Shape) -> Path:
    """A file of the format that its suffix tells, with the shape's normals where the format has them."""
    content = {
        ".obj": lambda: obj(shape).encode(),
        ".ply": lambda: ply(shape),
        ".stl": lambda: stl(shape),
        ".3mf": lambda: threemf(shape),
        ".dae": lambda: collada(shape),
    }
    path = folder / name
    path.write_bytes(content[path.suffix]())
    return path

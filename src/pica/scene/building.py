"""Builds sections from user arrays; missing attributes are generated."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pica.errors import SceneError
from pica.scene.arrays import floats, integers, place_of, shares
from pica.scene.material import Material
from pica.scene.mesh import Section
from pica.scene.normals import are_unit, face_normals, in_strips, perpendicular, unit_normals, vertex_normals
from pica.scene.tangents import generate_tangents
from pica.scene.values import LARGEST, Check, UnfitError, checked, flag, instance

Attributes = dict[str, NDArray[Any]]
"""By the names that glTF has for them, one row a vertex."""


def _colors(values: Any) -> NDArray[np.float32]:
    """(vertices, 3 or 4) from 0 to 1."""
    colors = shares("vertices", "channels")(values)
    if colors.shape[1] not in (3, 4):
        raise UnfitError(f"has the shape {colors.shape}, not (vertices, 3) or (vertices, 4)")
    return colors


_GIVEN: dict[str, tuple[str, Check[NDArray[np.float32]]]] = {
    "normals": ("NORMAL", floats("vertices", 3)),
    "uv": ("TEXCOORD_0", floats("vertices", 2)),
    "uv1": ("TEXCOORD_1", floats("vertices", 2)),
    "colors": ("COLOR_0", _colors),
    "tangents": ("TANGENT", floats("vertices", 4)),
}


def section_from_arrays(
    positions: ArrayLike, indices: ArrayLike, material: Material | None, smooth: bool, **given: ArrayLike | None
) -> Section:
    """As Section.from_arrays; `given` by the names in _GIVEN."""
    attributes: Attributes = {"POSITION": checked("section: positions", floats("vertices", 3), positions)}
    triangles = checked("section: indices", integers(np.uint32, "triangles", 3), indices)
    count = len(attributes["POSITION"])
    bad = triangles >= count
    if bad.any():
        raise SceneError(f"section: indices: {place_of(bad)}names vertex {triangles[bad][0]} of {count}")
    for name, values in given.items():
        attribute, check = _GIVEN[name]
        if values is not None:
            attributes[attribute] = checked(f"section: {name}", check, values)
            if len(attributes[attribute]) != count:
                rows = len(attributes[attribute])
                raise SceneError(f"section: {name}: for {rows} vertices, but there are {count} positions")
    if "TANGENT" in attributes and "NORMAL" not in attributes:
        raise SceneError("section: tangents: they stand on normals, so give both")
    chosen = _default_material() if material is None else checked("section: material", instance(Material), material)
    return complete(attributes, triangles, chosen, checked("section: smooth", flag, smooth))


def _default_material() -> Material:
    return Material(metallic=0.0)


def tangent_uvs(material: Material) -> tuple[int, Sequence[float]] | None:
    """The texture coordinates for tangents, and their Texture.transform; None: no tangents are needed.

    Of several textures it is the base's normal map, unless a file has tangents."""
    for texture in (material.normal_texture, material.coat_normal_texture, material.anisotropy_texture):
        if texture is not None:
            return texture.uv_set, texture.transform
    return None if material.anisotropy is None else (0, (1, 0, 0, 0, 1, 0))


def complete(
    attributes: Attributes, triangles: NDArray[np.uint32], material: Material, smooth: bool = False
) -> Section:
    """A section of the given attributes; missing ones are generated. `smooth`: missing normals are averages of the
    triangles round each vertex; False: those of the triangles, whose vertices are not shared."""
    positions = attributes["POSITION"]
    flat = "NORMAL" not in attributes and not smooth
    if not flat:
        if "NORMAL" not in attributes:
            attributes["NORMAL"] = vertex_normals(positions, triangles)
        attributes["NORMAL"] = unit_normals(attributes["NORMAL"], positions, triangles)
    else:  # glTF 2.0, 3.7.2.1: flat normals, and tangents in the file do not count
        attributes.pop("TANGENT", None)
        normals = np.repeat(face_normals(positions, triangles), 3, axis=0)
        attributes = _taken(attributes, triangles.reshape(-1).astype(np.intp)) | {"NORMAL": normals}
        triangles = np.arange(triangles.size, dtype=np.uint32).reshape(-1, 3)
    follow = tangent_uvs(material)
    if "TANGENT" not in attributes and follow is not None:
        uvs = texture_coordinates(attributes, *follow)
        tangents, source, triangles = generate_tangents(attributes["POSITION"], attributes["NORMAL"], uvs, triangles)
        attributes = _taken(attributes, source) | {"TANGENT": tangents}
    count = len(attributes["POSITION"])
    return Section(
        positions=attributes["POSITION"],
        normals=attributes["NORMAL"],
        tangents=unit_tangents(attributes.get("TANGENT"), attributes["NORMAL"]),
        uv0=attributes.get("TEXCOORD_0", np.zeros((count, 2), np.float32)),
        uv1=attributes.get("TEXCOORD_1", np.zeros((count, 2), np.float32)),
        colors=_rgba(attributes.get("COLOR_0", np.ones((count, 4), np.float32))),
        indices=triangles,
        material=material,
        flat=flat,
        joints=attributes.get("JOINTS"),
        weights=attributes.get("WEIGHTS"),
        morph_positions=_by_target(attributes.get("MORPH_POSITION")),
        morph_normals=_by_target(attributes.get("MORPH_NORMAL")),
        morph_tangents=_by_target(attributes.get("MORPH_TANGENT")),
    )


def _by_target(offsets: NDArray[np.float32] | None) -> NDArray[np.float32] | None:
    """(targets, vertices, 3) from (vertices, targets, 3)."""
    return None if offsets is None else np.ascontiguousarray(offsets.transpose(1, 0, 2))


def _taken(attributes: Attributes, vertices: NDArray[np.intp]) -> Attributes:
    return {name: values[vertices] for name, values in attributes.items()}


def texture_coordinates(attributes: Attributes, uv_set: int, transform: Sequence[float]) -> NDArray[np.float32]:
    """(vertices, 2) where a texture is read."""
    uvs = attributes.get(f"TEXCOORD_{uv_set}", np.zeros((len(attributes["POSITION"]), 2), np.float32))
    matrix = np.array(transform).reshape(2, 3)
    moved = uvs.astype(np.float64) @ matrix[:, :2].T + matrix[:, 2]
    return np.clip(moved, -LARGEST, LARGEST).astype(np.float32)


def unit_tangents(tangents: NDArray[np.float32] | None, normals: NDArray[np.float32]) -> NDArray[np.float32]:
    """(vertices, 4) unit tangents; arbitrary ones at a right angle to the normal if undefined."""
    if tangents is None:
        return in_strips(lambda rows: _spare_tangents(normals[rows]), len(normals), 4)
    return in_strips(lambda rows: _unit_tangents(tangents[rows], normals[rows]), len(normals), 4)


def _unit_tangents(tangents: NDArray[np.float32], normals: NDArray[np.float32]) -> NDArray[np.float32]:
    lengths = np.linalg.norm(tangents[:, :3].astype(np.float64), axis=1, keepdims=True)
    unit = np.column_stack(
        [tangents[:, :3] / np.where(lengths > 0, lengths, 1), np.where(tangents[:, 3:] < 0, -1, 1).astype(np.float32)]
    )
    unit[:, :3] = np.where(are_unit(tangents[:, :3]), tangents[:, :3], unit[:, :3])
    return np.where(lengths > 0, unit, _spare_tangents(normals)).astype(np.float32)


def _spare_tangents(normals: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.column_stack([perpendicular(normals), np.ones(len(normals), np.float32)])


def _rgba(colors: NDArray[np.float32]) -> NDArray[np.float32]:
    if colors.shape[1] == 4:
        return colors
    return np.column_stack([colors, np.ones(len(colors), np.float32)])

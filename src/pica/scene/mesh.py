"""Meshes: triangles and other primitives, each with a material."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pica.errors import SceneError, shown
from pica.scene.arrays import floats, integers, place_of, shares
from pica.scene.changes import Followed
from pica.scene.checked_field import CheckedField, check_again, described
from pica.scene.construction import fields_only
from pica.scene.material import Material
from pica.scene.primitives import Primitives
from pica.scene.tracked_field import TrackedField
from pica.scene.values import flag, instance, items, optional, text

_OFFSETS = optional(floats("targets", "vertices", 3))


@fields_only
@dataclass(eq=False)
class Section(Followed):
    """A part of a mesh with one material (a glTF primitive): indexed triangles. One without triangles is invisible.

    Attributes that a file lacks are generated when it is loaded, so all are present. Arrays of the type and shape
    below are not copied: the fields return read-only views of them. Others are converted, with no loss but a
    float's last digits. Tensors of other libraries count as arrays (docs/guide/scaling.md). Raises SceneError, with the
    field's name, for non-finite or invalid values, when a field is set; for inconsistent fields, before the mesh is
    shown.

    To edit visible content, assign: `section.positions = moved` or `section.material = other` is in the next picture.
    Writes into an assigned array take effect once it is assigned again. For vertices that
    move in every frame DynamicVertices is faster.
    """

    positions: TrackedField[NDArray[np.float32]] = TrackedField(floats("vertices", 3))
    """(vertices, 3) metres, object space."""
    normals: TrackedField[NDArray[np.float32]] = TrackedField(floats("vertices", 3))
    """(vertices, 3) unit length."""
    tangents: TrackedField[NDArray[np.float32]] = TrackedField(floats("vertices", 4))
    """(vertices, 4) unit length, w = sign of the bitangent cross(normal, tangent) (glTF 2.0, 3.7.2.1)."""
    uv0: TrackedField[NDArray[np.float32]] = TrackedField(floats("vertices", 2))
    """(vertices, 2) first texture coordinates, v down."""
    uv1: TrackedField[NDArray[np.float32]] = TrackedField(floats("vertices", 2))
    """(vertices, 2) second texture coordinates."""
    colors: TrackedField[NDArray[np.float32]] = TrackedField(shares("vertices", 4))
    """(vertices, 4) linear, 0 to 1, multiplies the base colour; uint8 counts 255ths of that, as in glTF."""
    indices: TrackedField[NDArray[np.uint32]] = TrackedField(integers(np.uint32, "triangles", 3))
    """(triangles, 3), counter-clockwise from the front."""
    material: TrackedField[Material] = TrackedField(instance(Material))
    flat: TrackedField[bool] = TrackedField(flag, False)
    """Normals are those of the triangles, which share no vertices; under deformation they are recomputed."""
    joints: TrackedField[NDArray[np.uint16] | None] = TrackedField(
        optional(integers(np.uint16, "vertices", "joints a vertex")), None
    )
    """(vertices, k) which of the skin's joints a vertex follows; None: no skin can move it."""
    weights: TrackedField[NDArray[np.float32] | None] = TrackedField(
        optional(floats("vertices", "joints a vertex", low=0)), None
    )
    """(vertices, k) how far it follows each: 0 or more, sums of 1."""
    morph_positions: TrackedField[NDArray[np.float32] | None] = TrackedField(_OFFSETS, None)
    """(targets, vertices, 3) metres, offsets that the node's weights scale and add; None: no morph targets."""
    morph_normals: TrackedField[NDArray[np.float32] | None] = TrackedField(_OFFSETS, None)
    """(targets, vertices, 3) offsets to the normals; None: they stay."""
    morph_tangents: TrackedField[NDArray[np.float32] | None] = TrackedField(_OFFSETS, None)
    """(targets, vertices, 3) offsets to the tangents' directions; None: they stay."""

    rows: TrackedField[NDArray[np.uint32] | None] = TrackedField(optional(integers(np.uint32, "vertices")), None)
    """(vertices,) rows of the vertices in a deformer's arrays; None: no deformer has arrays for them."""

    def __post_init__(self) -> None:
        if fault := self._misfit():
            raise SceneError(f"section: {fault}")

    def __repr__(self) -> str:
        return f"<pica.Section: {len(self.indices):,} triangles of material {shown(self.material.name)}>"

    def check(self) -> None:
        """Raises SceneError when the arrays, as they are now, do not fit their fields or each other."""
        check_again(self)
        self.__post_init__()

    @staticmethod
    def from_arrays(
        positions: ArrayLike,
        indices: ArrayLike,
        *,
        normals: ArrayLike | None = None,
        uv: ArrayLike | None = None,
        uv1: ArrayLike | None = None,
        colors: ArrayLike | None = None,
        tangents: ArrayLike | None = None,
        material: Material | None = None,
        smooth: bool = True,
    ) -> "Section":
        """A section of positions (vertices, 3) in metres and indices (triangles, 3); omitted attributes are generated.

        `normals`: (vertices, 3) of any length; by default, averages of the triangles round each vertex or, with
        `smooth` False, those of the triangles, whose vertices are not shared. `uv`, `uv1`: (vertices, 2),
        v down, or zeros. `colors`: (vertices, 3) or with alpha (vertices, 4), linear, floats from 0 to 1 or uint8 for
        255ths, as in glTF; or white. `tangents`: (vertices, 4), only with normals; by default, those of the
        material's normal map, where a vertex may be split in two.
        `material`: white, rough and not a metal if none. Raises SceneError, with the argument's name, for numbers that
        are not finite and for invalid arrays.
        """
        from pica.scene.building import section_from_arrays  # which makes sections

        given = {"normals": normals, "uv": uv, "uv1": uv1, "colors": colors, "tangents": tangents}
        return section_from_arrays(positions, indices, material, smooth, **given)

    def take(self, vertices: NDArray[np.intp], indices: NDArray[np.uint32]) -> "Section":
        """The section with only the given vertices, (count,), in that order; `indices` (triangles, 3) count in them."""
        per_vertex = {name: getattr(self, name) for name in _OPTIONAL_ATTRIBUTES}
        per_target = {name: getattr(self, name) for name in _MORPHED}
        return replace(
            self,
            **{name: getattr(self, name)[vertices] for name in _ATTRIBUTES},
            **{name: values[vertices] for name, values in per_vertex.items() if values is not None},
            **{name: values[:, vertices] for name, values in per_target.items() if values is not None},
            indices=indices,
        )

    def _misfit(self) -> str:
        """The fault of inconsistent fields; empty if there is none."""
        count = len(self.positions)
        for name in (*_ATTRIBUTES, *_OPTIONAL_ATTRIBUTES, *_MORPHED):
            values = getattr(self, name)
            length = count if values is None else values.shape[name in _MORPHED]
            if length != count:
                return f"{name}: for {length} vertices, but there are {count} positions"
        if len(self.indices) and int(self.indices.max()) >= count:
            bad = self.indices >= count
            return f"indices: {place_of(bad)}names vertex {self.indices[bad][0]} of {count}"
        targets = {len(values) for name in _MORPHED if (values := getattr(self, name)) is not None}
        if len(targets) > 1:
            return f"morph_positions: differ from morph_normals or morph_tangents in their number of targets, {targets}"
        return self._misfit_of_weights()

    def _misfit_of_weights(self) -> str:
        if self.joints is None and self.weights is None:
            return ""
        if self.joints is None or self.weights is None:
            return "weights: joints and weights go together, but one is None"
        if self.joints.shape != self.weights.shape:
            return f"weights: have the shape {self.weights.shape}, but joints have {self.joints.shape}"
        sums = self.weights.sum(axis=1)
        off = np.abs(sums - 1) > _WEIGHTS_OFF
        return f"weights: {place_of(off)}does not add up to 1 ({sums[off][0]:g})" if off.any() else ""


_ATTRIBUTES = ("positions", "normals", "tangents", "uv0", "uv1", "colors")
_OPTIONAL_ATTRIBUTES = ("joints", "weights", "rows")
_MORPHED = ("morph_positions", "morph_normals", "morph_tangents")
_WEIGHTS_OFF = 1e-2
"""By how much sums of weights, which files have in as few as eight bits, may differ from 1."""


@fields_only
@dataclass(eq=False)
class Mesh(Followed):
    """Sections and primitives that move together. One without any shows nothing. Raises SceneError for other things."""

    sections: TrackedField[Sequence[Section]] = TrackedField(items(Section), ())
    """A tuple; assign another one to change it."""
    name: CheckedField[str] = CheckedField(text, "")
    primitives: TrackedField[Sequence[Primitives]] = TrackedField(items(Primitives), ())
    """Geometry other than triangles. A node whose mesh has any can be moved, but not skinned or morphed."""

    def __post_init__(self) -> None:
        targets = {0 if s.morph_positions is None else len(s.morph_positions) for s in self.sections}
        if len(targets) > 1:
            raise SceneError(f"{described(self)}: sections: differ in their number of morph targets, {sorted(targets)}")

    @staticmethod
    def from_arrays(
        positions: ArrayLike,
        indices: ArrayLike,
        *,
        normals: ArrayLike | None = None,
        uv: ArrayLike | None = None,
        uv1: ArrayLike | None = None,
        colors: ArrayLike | None = None,
        tangents: ArrayLike | None = None,
        material: Material | None = None,
        smooth: bool = True,
        name: str = "",
    ) -> "Mesh":
        """A mesh of one section of positions (vertices, 3) in metres and indices (triangles, 3).

        Other arguments as in Section.from_arrays. For several materials, `Mesh([Section.from_arrays(...), ...])`.
        """
        given = {"normals": normals, "uv": uv, "uv1": uv1, "colors": colors, "tangents": tangents}
        return Mesh([Section.from_arrays(positions, indices, material=material, smooth=smooth, **given)], name)

    def __repr__(self) -> str:
        triangles, shapes = sum(len(section.indices) for section in self.sections), sum(map(len, self.primitives))
        more = f", {shapes:,} primitives" if shapes else ""
        parts = f"{len(self.sections)} section{'s' * (len(self.sections) != 1)}"
        return f"<pica.Mesh {shown(self.name)}: {triangles:,} triangles in {parts}{more}>"

    def check(self) -> None:
        """Raises SceneError when the sections, as they are now, cannot be shown."""
        check_again(self)
        self.__post_init__()
        for index, part in enumerate(self.parts):
            try:
                part.check()
            except SceneError as fault:
                raise SceneError(f"{described(self)}: part {index}: {fault}") from None

    @property
    def parts(self) -> list[Section | Primitives]:
        """Sections, then primitives."""
        return [*self.sections, *self.primitives]

    @property
    def target_count(self) -> int:
        """How many morph targets the sections have, all the same number."""
        targets = (section.morph_positions for section in self.sections)
        return max((len(positions) for positions in targets if positions is not None), default=0)

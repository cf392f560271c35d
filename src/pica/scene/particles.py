"""Particles: rows of arrays, shown as camera-facing sprites, as ribbons or as copies of a mesh (RTG 19, 19.2.1.3)."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pica.errors import SceneError, shown
from pica.names import checked_names
from pica.scene.arrays import doubles, integers
from pica.scene.checked_field import fitting, read_only
from pica.scene.deformer import FROM_THE_FRONT, CameraFacing, Eye, Floats, unit
from pica.scene.material import Material
from pica.scene.model import Mesh, Node, Section
from pica.scene.values import checked, instance, optional, whole

SMALLEST = 1e-5
"""Scale of a mesh particle of size 0: a copy that is flat has no inverse, which ray tracing needs."""
_MOST = 1 << 24
"""Numbers of particles and points go through 32-bit floats."""
_IDENTITIES = optional(integers(np.int64, "n"))


@checked_names(SceneError)
@dataclass(frozen=True, eq=False)
class Particles:
    """The state of n particles at one moment. Arrays of one row apply to all of them."""

    positions: Floats
    """(n, 3) metres, in the space of the node that shows them."""
    sizes: Floats = field(default_factory=lambda: np.ones(1))
    """(n,) metres from side to side, or (n, 2) width and height; a mesh is scaled by them. 0 hides a particle."""
    colors: Floats = field(default_factory=lambda: np.ones((1, 4)))
    """(n, 4) linear and alpha, 0 to 1; they multiply the material's base colour. Meshes have their own."""
    rotations: Floats = field(default_factory=lambda: np.zeros(1))
    """(n,) radians, counter-clockwise about the direction to the camera; meshes rotate about `axes`."""
    ages: Floats = field(default_factory=lambda: np.zeros(1))
    """(n,) fraction of the lifetime; the first of the second texture coordinates."""
    identities: NDArray[np.int64] | None = None
    """(n,) identity of each row: a change means a new particle, not a motion. None: constant."""
    axes: Floats = field(default_factory=lambda: np.array([[0.0, 1.0, 0.0]]))
    """(n, 3) unit length, rotation axes of meshes."""

    def __post_init__(self) -> None:
        shapes = {"positions": (3,), "colors": (4,), "rotations": (), "ages": (), "axes": (3,)}
        given = {name: fitting(self, name, doubles(), getattr(self, name)) for name in (*shapes, "sizes")}
        count = len(given["positions"]) if given["positions"].ndim else 0
        for name, values in given.items():
            shape = shapes.get(name, values.shape[1:])
            if values.shape[1:] != shape or values.ndim == 0 or len(values) not in (1, count):
                raise SceneError(f"particles: {name} of shape {values.shape} do not go with {count} positions")
            object.__setattr__(self, name, np.broadcast_to(values, (count, *shape)))
        if self.sizes.shape[1:] not in ((), (2,)):
            raise SceneError(f"particles: sizes of shape {self.sizes.shape}; give one or two numbers for each")
        identities = fitting(self, "identities", _IDENTITIES, self.identities)
        object.__setattr__(self, "identities", read_only(identities))
        if self.identities is not None and len(self.identities) != count:
            raise SceneError(f"particles: {len(self.identities)} identities for {count} positions")

    def transforms(self) -> Floats:
        """(n, 4, 4) that place copies of a mesh: scaled by the size, turned about the axis. Two sizes: across, up."""
        sizes = np.maximum(self.sizes.reshape(len(self.positions), -1), SMALLEST)
        x, y, z = self.axes.T
        zero = np.zeros_like(x)
        cross = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
        # Rodrigues' formula
        sin, cos = (f(self.rotations)[:, None, None] for f in (np.sin, np.cos))
        matrices = np.zeros((len(self.positions), 4, 4))
        matrices[:, :3, :3] = np.eye(3) + sin * cross + (1 - cos) * (cross @ cross)
        matrices[:, :3, :3] *= sizes[:, [0, -1, 0]][:, None, :]
        matrices[:, :3, 3], matrices[:, 3, 3] = self.positions, 1
        return matrices

    def place(self, node: Node) -> None:
        """Show every particle as a copy of the node's mesh. Rows that stay rows of the same particles are cheapest."""
        node.place_instances(self.transforms(), self.identities)


class Sprites(CameraFacing):
    """Camera-facing quads in each view, one a particle; `node` shows them. Set `particles` to move them.

    Second texture coordinates are (age, 0). Use a masked or a blended material, visible from both sides.
    """

    def __init__(self, capacity: int, material: Material, name: str = "sprites") -> None:
        """`capacity`: the most particles there will be, 1 to 2^24. Raises SceneError for others."""
        self.capacity = capacity = checked(f"sprites {shown(name)}: capacity", whole(1, _MOST), capacity)
        self._particles = Particles(np.zeros((0, 3)))
        self.version = 1
        """Counts how often `particles` was set."""
        # A rest position is a place in the quad, -0.5 to 0.5 to the right and up, and the number of the particle.
        corners = np.array([(-0.5, 0.5), (-0.5, -0.5), (0.5, -0.5), (0.5, 0.5)])
        number = np.repeat(np.arange(capacity), 4)
        rest = np.column_stack([np.tile(corners, (capacity, 1)), number])
        indices = (4 * np.arange(capacity)[:, None, None] + np.array([[0, 1, 2], [0, 2, 3]])).reshape(-1, 3)
        uv = rest[:, :2] * (1, -1) + 0.5
        node = Node(name, mesh=Mesh([facing_section(rest, uv, indices, material)], name))
        node.deformer = self

    @property
    def particles(self) -> Particles:
        """The particles of the sprites."""
        return self._particles

    @particles.setter
    def particles(self, particles: Particles) -> None:
        checked("sprites: particles", instance(Particles), particles)
        if len(particles.positions) > self.capacity:
            raise SceneError(f"sprites: {len(particles.positions)} particles, but room for {self.capacity}")
        self._particles = particles
        self._renew(version=self.version + 1)
        self.changed()

    def deform(self, section: Section, eye: Eye = FROM_THE_FRONT) -> tuple[Floats, Floats, Floats]:
        """As Deformer. Quads without a particle are points."""
        particles = self._particles
        rest = section.positions.astype(np.float64)
        count = len(particles.positions)
        if not count:
            return _pointing(np.zeros((len(rest), 3)), eye.direction_from(np.zeros((len(rest), 3))), eye.up)
        number = rest[:, 2].astype(np.intp)
        row = np.minimum(number, count - 1)
        center, angle = particles.positions[row], particles.rotations[row][:, None]
        size = np.broadcast_to(particles.sizes.reshape(count, -1), (count, 2))[row] * (number < count)[:, None]
        forward = eye.direction_from(center)
        _, _, tangents = _pointing(center, forward, eye.up)
        right = tangents[:, :3]
        up = np.cross(forward, right)
        turned = np.cos(angle) * right + np.sin(angle) * up
        turned_up = np.cos(angle) * up - np.sin(angle) * right
        places = center + size[:, :1] * rest[:, :1] * turned + size[:, 1:] * rest[:, 1:2] * turned_up
        return places, forward, np.column_stack([turned, np.ones(len(rest))])


class Ribbons(CameraFacing):
    """Strips of triangles along strands of points, which face the camera about the strand; `node` shows them.

    First texture coordinates run across and along the strand from its first point, 0 to 1.
    """

    def __init__(self, strands: int, points: int, material: Material, name: str = "ribbons") -> None:
        """Room for `strands` strands of `points` points each. Raises SceneError for fewer than 1 and 2."""
        self.strands = strands = checked(f"ribbons {shown(name)}: strands", whole(1, _MOST), strands)
        self.points = points = checked(f"ribbons {shown(name)}: points", whole(2, _MOST), points)
        self.positions = np.zeros((strands, points, 3))
        self.widths = np.zeros((strands, points))
        self.colors = np.ones((strands, points, 4))
        self.identities: NDArray[np.int64] = np.arange(strands)
        self.version = 1
        """Counts calls of `set`."""
        # A rest position is a side, -0.5 or 0.5, the number of the point and that of the strand.
        strand, point, side = (
            grid.ravel() for grid in np.meshgrid(np.arange(strands), np.arange(points), (-0.5, 0.5), indexing="ij")
        )
        rest = np.column_stack([side, point, strand])
        first = (2 * (points * np.arange(strands)[:, None] + np.arange(points - 1))).reshape(-1, 1, 1)
        indices = (first + np.array([[0, 1, 3], [0, 3, 2]])).reshape(-1, 3)
        uv = np.column_stack([side + 0.5, point / (points - 1)])
        node = Node(name, mesh=Mesh([facing_section(rest, uv, indices, material)], name))
        node.deformer = self

    def set(
        self,
        positions: ArrayLike,
        widths: ArrayLike,
        colors: ArrayLike = (1.0, 1.0, 1.0, 1.0),
        identities: NDArray[np.int64] | None = None,
    ) -> None:
        """Set the strands: `positions` (strands, points, 3) metres, `widths` (strands, points) metres or
        broadcastable to it, `colors` (strands, points, 4) likewise, `identities` (strands,) as for particles."""
        shape = self.strands, self.points
        places, across, tints = (
            checked(f"ribbons: {name}", doubles(), values)
            for name, values in (("positions", positions), ("widths", widths), ("colors", colors))
        )
        numbers = checked("ribbons: identities", optional(integers(np.int64, self.strands)), identities)
        try:
            places, tints = np.broadcast_to(places, (*shape, 3)), np.broadcast_to(tints, (*shape, 4))
            across = np.broadcast_to(across, shape)
        except ValueError:
            raise SceneError(f"ribbons: arrays do not fit {self.strands} strands of {self.points} points") from None
        self._renew(
            positions=places,
            widths=across,
            colors=tints,
            identities=np.arange(self.strands) if numbers is None else numbers,
            version=self.version + 1,
        )
        self.changed()

    def deform(self, section: Section, eye: Eye = FROM_THE_FRONT) -> tuple[Floats, Floats, Floats]:
        """As Deformer. The tangent is across the ribbon."""
        rest = section.positions.astype(np.float64)
        strand, point = rest[:, 2].astype(np.intp), rest[:, 1].astype(np.intp)
        center = self.positions[strand, point]
        after = self.positions[strand, np.minimum(point + 1, self.points - 1)]
        before = self.positions[strand, np.maximum(point - 1, 0)]
        along = unit(after - before, np.array([0.0, 1.0, 0.0]))
        view = eye.direction_from(center)
        sideways = unit(np.cross(along, np.eye(3)[np.argmin(np.abs(along), axis=1)]), np.array([1.0, 0.0, 0.0]))
        side = unit(np.cross(along, view), sideways)
        places = center + side * (rest[:, :1] * self.widths[strand, point][:, None])
        return places, np.cross(side, along), np.column_stack([side, np.ones(len(rest))])


def facing_section(rest: Floats, uv: Floats, indices: NDArray[np.intp], material: Material) -> Section:
    """A section whose vertices a deformer writes: only its rest positions and texture coordinates are used."""
    count = len(rest)
    return Section(
        positions=rest.astype(np.float32),
        normals=np.tile(np.array((0, 0, 1), np.float32), (count, 1)),
        tangents=np.tile(np.array((1, 0, 0, 1), np.float32), (count, 1)),
        uv0=uv.astype(np.float32),
        uv1=np.zeros((count, 2), np.float32),
        colors=np.ones((count, 4), np.float32),
        indices=indices.astype(np.uint32),
        material=material,
    )


def _pointing(places: Floats, forward: Floats, up: Floats) -> tuple[Floats, Floats, Floats]:
    """Positions, normals and tangents of quads that face `forward`, (n, 3), with `up`, (3,), up on screen."""
    sideways = unit(np.cross(forward, np.eye(3)[np.argmin(np.abs(forward), axis=1)]), np.array([1.0, 0.0, 0.0]))
    right = unit(np.cross(up, forward), sideways)
    return places, forward, np.column_stack([right, np.ones(len(places))])

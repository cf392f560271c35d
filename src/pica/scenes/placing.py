"""Small matrices, meshes put together from sections, and nodes in their places."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pica.scene.light import Light
from pica.scene.model import Mesh, Node, Section
from pica.scenes.basic_meshes import merged, transformed

Matrix = NDArray[np.float64]


def move(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Matrix:
    """(4, 4) translation, metres."""
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def rotate(axis: str, degrees: float) -> Matrix:
    """(4, 4) rotation about "x", "y" or "z", counter-clockwise as seen from the axis' tip."""
    angle = np.radians(degrees)
    first, second = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    matrix = np.eye(4)
    matrix[[first, second], [first, second]] = np.cos(angle)
    matrix[first, second], matrix[second, first] = -np.sin(angle), np.sin(angle)
    return matrix


def stretch(x: float, y: float, z: float) -> Matrix:
    """(4, 4) scale along each axis."""
    return np.diag([x, y, z, 1.0])


def aim(eye: ArrayLike, target: ArrayLike) -> Matrix:
    """(4, 4) placement at `eye` whose -Z points at `target`, for lights; not straight up or down."""
    position = np.asarray(eye, np.float64)
    back = position - np.asarray(target, np.float64)
    back /= np.linalg.norm(back)
    right = np.cross((0.0, 1.0, 0.0), back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = right, np.cross(back, right), back, position
    return matrix


def at(section: Section, *matrices: Matrix) -> Section:
    """The section placed by a product of matrices, the last one applied first."""
    return transformed(section, np.linalg.multi_dot(matrices) if len(matrices) > 1 else matrices[0])


def mesh(name: str, parts: Iterable[Section]) -> Mesh:
    """A mesh with one section for every material among `parts`."""
    by_material: dict[int, list[Section]] = {}
    for part in parts:
        by_material.setdefault(id(part.material), []).append(part)
    return Mesh([merged(group) for group in by_material.values()], name)


def place(parent: Node, name: str, what: Mesh | Light | None = None, transform: Matrix | None = None) -> Node:
    """A new child of `parent` with a mesh, a light or nothing, where `transform` puts it."""
    node = Node(name)
    if isinstance(what, Mesh):
        node.mesh = what
    else:
        node.light = what
    if transform is not None:
        node.transform = transform
    return parent.add(node)


def copied(node: Node, name: str) -> Node:
    """A copy of a node and all below it that shares their meshes and lights."""
    copy = Node(name, mesh=node.mesh, light=node.light, camera=node.camera)
    copy.transform = node.transform
    for child in node.children:
        copy.add(copied(child, child.name))
    return copy

"""How the cost of a frame grows: with the size of the picture, with triangles, lights or rays."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields

import numpy as np

from pica.errors import PicaError, shown
from pica.scene.light import PointLight
from pica.scene.mesh import Section
from pica.scene.model import Node, Scene
from pica.scenes.placing import move
from pica.settings import Settings
from pica.settings.setting import Value

_SIZES = (1 / 3, 2 / 3, 1.0, 4 / 3, 2.0)
"""Widths and heights over those that were asked for."""
_REFINEMENTS = 4
"""Each has four times the triangles."""
_LIGHTS = (0, 1, 4, 16, 64, 256)
_RAYS = (1, 2, 4, 8, 16)


@dataclass(frozen=True)
class Step:
    """One measurement of a sweep."""

    label: str
    size: tuple[int, int]
    settings: Settings


def size(scene: Scene, pixels: tuple[int, int], settings: Settings) -> Iterator[Step]:
    """A third to twice the width and height."""
    for factor in _SIZES:
        width, height = (max(round(length * factor), 1) for length in pixels)
        yield Step(f"{width}x{height}", (width, height), settings)


def triangles(scene: Scene, pixels: tuple[int, int], settings: Settings) -> Iterator[Step]:
    """Each triangle of meshes that do not deform becomes four, again and again; the picture stays."""
    meshes = {id(node.mesh): node.mesh for node in scene.nodes() if node.mesh is not None}.values()
    sections = [section for mesh in meshes for section in mesh.sections if _is_rigid(section)]
    for step in range(_REFINEMENTS):
        if step > 0:
            for section in sections:
                _refine(section)
        count = sum(
            len(section.indices) for node in scene.nodes() if node.mesh is not None for section in node.mesh.sections
        )
        yield Step(f"{count:,}", pixels, settings)


def lights(scene: Scene, pixels: tuple[int, int], settings: Settings) -> Iterator[Step]:
    """0 to 256 point lights more, at random places of the scene's box. Together they always have the same power."""
    low, high = scene.bounds()
    random, added = np.random.default_rng(0), 0
    nodes: list[Node] = []
    for count in _LIGHTS:
        for _ in range(count - added):
            nodes.append(scene.add(Node("light")))
            nodes[-1].transform = move(*random.uniform(low, high))
        added = count
        for node in nodes:
            node.light = PointLight(intensity=float(np.square(high - low).sum()) / count)
        yield Step(str(count), pixels, settings)


def rays(scene: Scene, pixels: tuple[int, int], settings: Settings) -> Iterator[Step]:
    """1 to 16 rays a pixel of ray traced ambient occlusion: what a ray costs that ends at its first hit."""
    for count in _RAYS:
        values: dict[str, Value] = {"ambient_occlusion.mode": "ray_traced", "ambient_occlusion.rays": count}
        yield Step(str(count), pixels, settings.with_values(values))


SWEEPS: dict[str, Callable[[Scene, tuple[int, int], Settings], Iterator[Step]]] = {
    "size": size,
    "triangles": triangles,
    "lights": lights,
    "rays": rays,
}
"""By name: they change the scene where they must and yield what to measure then."""


def check_sweep(name: str) -> None:
    """Raises PicaError if there is no such sweep."""
    if name not in SWEEPS:
        raise PicaError(f"sweep {shown(name)} is not one of {', '.join(SWEEPS)}")


def _is_rigid(section: Section) -> bool:
    return section.joints is None and section.morph_positions is None and section.rows is None


_BY_VERTEX = ("positions", "normals", "tangents", "uv0", "uv1", "colors")


def _refine(section: Section) -> None:
    """Split each triangle at the middles of its edges."""
    corners = section.indices
    edges = np.sort(np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]), axis=1)
    edges, number = np.unique(edges, axis=0, return_inverse=True)
    middles = (number.reshape(3, -1).T + len(section.positions)).astype(np.uint32)
    a, b, c = corners.T
    ab, bc, ca = middles.T
    values = {item.name: getattr(section, item.name) for item in fields(section)}
    for name in _BY_VERTEX:
        ends = values[name][edges].astype(np.float64)
        middle = ends.mean(axis=1)
        if name in ("normals", "tangents"):
            middle[:, :3] /= np.maximum(np.linalg.norm(middle[:, :3], axis=1, keepdims=True), 1e-12)
            middle[:, 3:] = ends[:, 0, 3:]
        values[name] = np.concatenate([values[name], middle.astype(values[name].dtype)])
    faces = [np.stack(face, axis=1) for face in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
    values["indices"] = np.concatenate(faces)
    refined = Section(**values)
    for name in (*_BY_VERTEX, "indices"):
        setattr(section, name, getattr(refined, name))

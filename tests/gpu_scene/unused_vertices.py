"""Renders triangles among vertices that nothing uses; in a process of its own, as a driver may crash on them."""

import sys
from dataclasses import replace

import numpy as np

from pica.rhi.device import Device
from pica.scene.model import Section
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import move
from tests.building import RASTER, RAYS, lambert, placed, render, scene_of, uniform


def with_unused_vertices(section: Section, count: int = 500) -> Section:
    """The same triangles, with other vertices before, between and after theirs."""
    old = len(section.positions)
    random = np.random.default_rng(2)
    places = np.sort(random.choice(old + count, old, replace=False))
    arrays = {}
    for name in ("positions", "normals", "tangents", "uv0", "uv1", "colors"):
        values = getattr(section, name)
        arrays[name] = random.uniform(0 if name == "colors" else -1, 1, (old + count, values.shape[1])).astype(
            np.float32
        )
        arrays[name][places] = values
    return replace(section, **arrays, indices=places.astype(np.uint32)[section.indices])


def main(primary: str) -> None:
    device, values = Device(), {"raster": RASTER, "rays": RAYS}[primary]
    sections = [box(0.7, lambert(0.8, 0.3, 0.2)), plane(3, 3, lambert(0.5))]
    assert max(section.indices.size for section in sections) < 500
    # Its indices come last: read as those of the others they would make triangles all over the picture.
    last = placed(sphere(0.3, lambert(0.9)), move(0.8, 0.3, 0))
    pictures = []
    for change in (lambda section: section, with_unused_vertices):
        nodes = [placed(change(section), move(0, y, 0)) for section, y in zip(sections, (0.35, 0), strict=True)]
        pictures.append(render(device, scene_of(*nodes, last, environment=uniform(1, 1, 1)), values=values))
    assert (pictures[0].aov("instance") == 1).sum() > 50
    np.testing.assert_array_equal(pictures[0].color, pictures[1].color)


if __name__ == "__main__":
    main(sys.argv[1])

"""Progress of unwrapping: a frame may wait for seconds for meshes of many triangles that no cache has."""

from pica.reports import Reports

REPORTS = Reports("unwrapping")
"""(triangles unwrapped, triangles to unwrap), mesh by mesh, first with none of them."""

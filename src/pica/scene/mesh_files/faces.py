"""Faces of OBJ files as trimesh reads them right: with indices from the start, and convex.

Files begin with the end of a line here, so that patterns do, which the library finds three times as fast as with ^.
"""

import re

import numpy as np

from pica.scene.conversion.triangles import ears, not_convex

_POLYGON = re.compile(rb"\nf((?: ++[-\d/]++){5,}+) *\r?$", re.MULTILINE)
"""Of five corners or more: files of quads alone would take long."""
_RELATIVE = re.compile(rb"\nf ++([-\d/ ]*-[-\d/ ]*)")
_STATEMENTS = tuple(re.compile(rb"\n%b " % name) for name in (b"v", b"vt", b"vn"))
_VERTEX = re.compile(rb"\nv +(\S+) +(\S+) +(\S+)")


def with_absolute_indices(content: bytes) -> bytes:
    """The file with indices from the start in place of those that count back from a face's own line. Raises ValueError
    for numbers that are none."""
    faces = list(_RELATIVE.finditer(content))
    if not faces:
        return content
    starts = [face.start() for face in faces]
    before = [np.searchsorted([each.start() for each in name.finditer(content)], starts) for name in _STATEMENTS]
    pieces, end = [], 0
    for face, *counts in zip(faces, *before, strict=True):
        corners = (corner.split(b"/") for corner in face[1].split())
        texts = (b"/".join(map(_absolute, corner, counts)) for corner in corners)
        pieces += [content[end : face.start(1)], b" ".join(texts)]
        end = face.end(1)
    return b"".join([*pieces, content[end:]])


def _absolute(index: bytes, count: np.intp) -> bytes:
    return b"%d" % (count + 1 + int(index)) if index.startswith(b"-") else index


def with_ears(content: bytes) -> bytes:
    """The file with triangles in place of such polygons. Raises ValueError for numbers that are none."""
    polygons = list(_POLYGON.finditer(content))
    if not polygons:
        return content
    vertices = list(_VERTEX.finditer(content))
    positions = np.array([[float(number) for number in each.groups()] for each in vertices]).reshape(-1, 3)
    corners = [polygon[1].split() for polygon in polygons]
    counts = np.array([len(each) for each in corners])
    rows = np.array([int(corner.partition(b"/")[0]) - 1 for each in corners for corner in each])
    if rows.min() < 0 or rows.max() >= len(positions):
        return content  # an error, which its reader tells
    starts = np.cumsum(counts) - counts
    pieces, end = [], 0
    for number in not_convex(counts, positions, rows):
        polygon, own = polygons[number], corners[number]
        triangles = ears(positions[rows[starts[number] :][: counts[number]]])
        pieces.append(content[end : polygon.start()])
        pieces += [b"\nf " + b" ".join(own[corner] for corner in triangle) for triangle in triangles]
        end = polygon.end()
    return b"".join([*pieces, content[end:]])

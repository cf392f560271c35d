"""Faces of PLY files as trimesh reads them right: triangles.

Trimesh refuses binary files whose faces differ in their number of corners, and polygons that have a list beside that of
their corners, such as texture coordinates. It takes every polygon as convex.
"""

import re
from dataclasses import dataclass
from itertools import pairwise
from struct import Struct
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pica.errors import SceneError
from pica.scene.conversion.triangles import triangulated
from pica.scene.limits import Budget

Counts = NDArray[np.intp]

_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "float": "f4", "double": "f8", "float32": "f4", "float64": "f8",
}  # fmt: skip
_ORDERS: dict[str, Literal["=", "<", ">"]] = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
_END = b"end_header"
_FACES = re.compile(rb"(\nelement\s+face\s+)\d+")
_EARLY = "ends early"
_CORNERS = "vertex_indices", "vertex_index"
_CODES = {"<": "<", ">": ">", "=": "=", "|": "="}  # of byte orders, in NumPy and in struct


@dataclass
class _Property:
    name: str
    kind: np.dtype[Any]
    length: np.dtype[Any] | None
    """Of a list: the type of its length."""


@dataclass
class _Element:
    name: str
    count: int
    properties: list[_Property]

    @property
    def lists(self) -> list[int]:
        """The places of its lists."""
        return [place for place, each in enumerate(self.properties) if each.length is not None]

    @property
    def corners(self) -> int:
        """The place of a face's list of corners."""
        named = [place for place in self.lists if self.properties[place].name in _CORNERS]
        return (named or self.lists)[0]

    @property
    def row(self) -> np.dtype[Any]:
        """Of an element without lists."""
        return np.dtype([(each.name, each.kind) for each in self.properties])


@dataclass
class _Triangles:
    """What takes the place of a file's faces."""

    content: bytes
    count: int
    replaced: slice
    """The faces, counted from the header's end."""


def with_triangles(content: bytes, budget: Budget) -> bytes:
    """The file with triangles in place of its polygons; as it is where it has none, or is not understood here.

    Raises SceneError for files that end early, name vertices that are not there or exceed the budget, ValueError for
    numbers that are none.
    """
    start = content.find(b"\n", content.find(_END)) + 1
    header, body = content[:start], memoryview(content)[start:]
    elements = _elements(header) if _END in header else []
    place = next((n for n, each in enumerate(elements) if each.name == "face"), None)
    if place is None or not elements[place].lists or any(each.lists for each in elements[:place]):
        return content
    before, face = elements[:place], elements[place]
    if not any(each.name == "vertex" and {"x", "y", "z"} <= {p.name for p in each.properties} for each in before):
        return content
    read = _read_text if b"format ascii" in header else _read_binary
    made = read(body, before, face, budget)
    if made is None:
        return content
    header = _FACES.sub(rb"\g<1>%d" % made.count, header, count=1)
    return b"".join([header, body[: made.replaced.start], made.content, body[made.replaced.stop :]])


def _elements(header: bytes) -> list[_Element]:
    """None where a line is not understood."""
    found: list[_Element] = []
    order: Literal["=", "<", ">"] | None = None
    for line in header.decode("latin-1").splitlines():
        match line.split():
            case ["format", kind, _] if kind in _ORDERS:
                order = _ORDERS[kind]
            case ["element", name, count] if count.isdecimal() and order:
                found.append(_Element(name, int(count), []))
            case ["property", "list", length, kind, name] if found and {length, kind} <= _TYPES.keys():
                types = (np.dtype(_TYPES[each]).newbyteorder(order or "=") for each in (kind, length))
                found[-1].properties.append(_Property(name, *types))
            case ["property", kind, name] if found and kind in _TYPES:
                found[-1].properties.append(_Property(name, np.dtype(_TYPES[kind]).newbyteorder(order or "="), None))
            case ["element" | "property" | "format", *_]:
                return []
    return found


@dataclass
class _Cut:
    """Triangles of polygons."""

    triangles: Counts
    """(triangles, 3) vertices."""
    faces: Counts
    """(triangles,) polygon of each."""
    within: Counts
    """(triangles, 3) which of its polygon's corners each is."""


def _cut(counts: Counts, corners: NDArray[Any], positions: NDArray[Any]) -> _Cut:
    """`counts`: corners of each polygon."""
    if corners.size and not (corners.min() >= 0 and corners.max() < len(positions)):
        raise SceneError(f"a face names vertex {corners.max()}, but there are {len(positions)}")
    corners = corners.astype(np.intp)
    places = triangulated(counts, positions, corners)
    ends = np.cumsum(counts)
    faces = np.searchsorted(ends, places[:, 0], side="right")
    return _Cut(corners[places], faces, places - (ends - counts)[faces, None])


def _per_corner(counts: Counts, place: int) -> list[int] | None:
    """For each list, how many of its numbers belong to a corner. `counts`: (faces, lists) numbers; `place`: the list of
    corners. None: a list has others."""
    most = counts[:, place].max()
    found = [int(column[counts[:, place].argmax()] // max(most, 1)) for column in counts.T]
    return found if (counts == counts[:, place, None] * found).all() else None


def _read_text(body: memoryview, before: list[_Element], face: _Element, budget: Budget) -> _Triangles | None:
    lines = bytes(body).splitlines(keepends=True)
    first = sum(each.count for each in before)
    if first + face.count > len(lines):
        raise SceneError(_EARLY)
    rows = [_values(face, line.split()) for line in lines[first : first + face.count]]
    counts = np.array([[len(row[place]) for place in face.lists] for row in rows], np.intp)
    place = face.lists.index(face.corners)
    numbers = _per_corner(counts, place) if len(rows) and not (counts[:, place] == 3).all() else None
    if numbers is None:
        return None
    corners = [int(corner) for row in rows for corner in row[face.corners]]
    cut = _cut(counts[:, place], np.array(corners, np.int64), _positions_of_text(lines, before))
    lengths = np.array([sum(map(len, row)) for row in rows])
    budget.take(bytes=int(lengths[cut.faces].sum()))
    each_corner = dict(zip(face.lists, numbers, strict=True))
    made = []
    for triangle, number, within in zip(cut.triangles.tolist(), cut.faces.tolist(), cut.within.tolist(), strict=True):
        words: list[bytes] = []
        for place, values in enumerate(rows[number]):
            if place == face.corners:
                words.append(b"3 %d %d %d" % tuple(triangle))
            elif place in each_corner:
                count = each_corner[place]
                words += [b"%d" % (3 * count), *(v for n in within for v in values[n * count : (n + 1) * count])]
            else:
                words += values
        made.append(b" ".join(words))
    start = sum(map(len, lines[:first]))
    stop = start + sum(map(len, lines[first : first + face.count]))
    return _Triangles(b"\n".join([*made, b""]), len(cut.triangles), slice(start, stop))


def _values(face: _Element, words: list[bytes]) -> list[list[bytes]]:
    """The values of each property of a face."""
    found, at = [], 0
    for each in face.properties:
        count = 1
        if each.length is not None:
            count = int(words[at]) if at < len(words) else -1
            at += 1
        if count < 0 or at + count > len(words):
            raise SceneError(_EARLY)
        found.append(words[at : at + count])
        at += count
    return found


def _positions_of_text(lines: list[bytes], before: list[_Element]) -> NDArray[np.float64]:
    first, vertex = 0, before[0]
    for element in before:
        if element.name == "vertex":
            vertex = element
            break
        first += element.count
    names = [each.name for each in vertex.properties]
    rows = (line.split() for line in lines[first : first + vertex.count])
    found = [[float(row[place]) for place in map(names.index, "xyz")] for row in rows if len(row) >= len(names)]
    if len(found) < vertex.count:
        raise SceneError(_EARLY)
    return np.array(found, np.float64).reshape(-1, 3)


def _read_binary(body: memoryview, before: list[_Element], face: _Element, budget: Budget) -> _Triangles | None:
    positions, start = np.zeros((0, 3)), 0
    for element in before:
        row = element.row
        if start + element.count * row.itemsize > len(body):
            raise SceneError(_EARLY)
        if element.name == "vertex":
            values = np.frombuffer(body, row, element.count, start)
            positions = np.stack([values[axis].astype(np.float64) for axis in "xyz"], axis=1)
        start += element.count * row.itemsize
    if not face.count or _are_triangles(body, start, face):
        return None
    starts, counts, stop = _scan(body, start, face)
    place = face.lists.index(face.corners)
    numbers = _per_corner(counts, place)
    if numbers is None or (counts[:, place] == 3).all():
        return None
    held, polygons = np.frombuffer(body, np.uint8), counts[:, place]
    listed = face.properties[face.corners].kind
    within = np.arange(polygons.sum()) - np.repeat(np.cumsum(polygons) - polygons, polygons)
    first = np.repeat(starts[:, face.corners], polygons)
    corners = _bytes(held, first + within * listed.itemsize, listed.itemsize).view(listed)[:, 0]
    cut = _cut(polygons, corners, positions)
    each_corner = dict(zip(face.lists, numbers, strict=True))
    parts = []
    for place, each in enumerate(face.properties):
        if each.length is None:
            budget.take(bytes=len(cut.triangles) * each.kind.itemsize)
            parts.append(_bytes(held, starts[cut.faces, place], each.kind.itemsize))
            continue
        size = each_corner[place] * each.kind.itemsize
        budget.take(bytes=len(cut.triangles) * (3 * size + each.length.itemsize))
        length = np.array([3 * each_corner[place]], each.length).view(np.uint8)
        parts.append(np.tile(length, (len(cut.triangles), 1)))
        for corner in range(3):
            parts.append(_bytes(held, starts[cut.faces, place] + cut.within[:, corner] * size, size))
    return _Triangles(np.concatenate(parts, axis=1).tobytes(), len(cut.triangles), slice(start, stop))


def _are_triangles(body: memoryview, at: int, face: _Element) -> bool:
    """Whether all faces are, with lists as long as those of the first, as in most files."""
    _, counts, stop = _scan(body, at, _Element(face.name, 1, face.properties))
    size = stop - at
    if counts[0, face.lists.index(face.corners)] != 3 or at + face.count * size > len(body):
        return False
    names, formats, offsets, offset = [], [], [], 0
    for place, each in enumerate(face.properties):
        if each.length is not None:
            names.append(str(place))
            formats.append(each.length)
            offsets.append(offset)
            offset += each.length.itemsize
        offset += each.kind.itemsize * (counts[0, face.lists.index(place)] if each.length is not None else 1)
    fields: Any = {"names": names, "formats": formats, "offsets": offsets, "itemsize": size}
    lengths = np.frombuffer(body, np.dtype(fields), face.count, at)
    return all((lengths[name] == count).all() for name, count in zip(names, counts[0], strict=True))


def _scan(body: memoryview, at: int, face: _Element) -> tuple[Counts, Counts, int]:
    """(faces, properties) where the values of each begin, (faces, lists) their numbers, and where the faces end."""
    single = [0 if each.length is not None else each.kind.itemsize for each in face.properties]
    edges = [0, *(place + 1 for place in face.lists), len(single)]
    gaps = [sum(single[first:end]) for first, end in pairwise(edges)]
    listed = [face.properties[place] for place in face.lists]
    lengths = [Struct(_CODES[each.length.byteorder] + each.length.char) for each in listed if each.length is not None]
    least = sum(gaps) + sum(length.size for length in lengths)
    if at + face.count * least > len(body):
        raise SceneError(_EARLY)
    faces, counts = np.empty(face.count, np.intp), np.empty((face.count, len(listed)), np.intp)
    steps = list(zip(range(len(listed)), gaps[:-1], lengths, (each.kind.itemsize for each in listed), strict=True))
    for number in range(face.count):
        faces[number] = at
        for place, gap, length, size in steps:
            if at + gap + length.size > len(body):
                raise SceneError(_EARLY)
            count = int(length.unpack_from(body, at + gap)[0])
            counts[number, place] = count
            at += gap + length.size + count * size
            if count < 0 or at > len(body):
                raise SceneError(_EARLY)
        at += gaps[-1]
    if at > len(body):
        raise SceneError(_EARLY)
    starts, begin, found = np.empty((face.count, len(single)), np.intp), faces, 0
    for place, each in enumerate(face.properties):
        starts[:, place] = begin + (0 if each.length is None else each.length.itemsize)
        numbers = 1 if each.length is None else counts[:, found]
        begin, found = starts[:, place] + numbers * each.kind.itemsize, found + (each.length is not None)
    return starts, counts, at


def _bytes(held: NDArray[np.uint8], places: Counts, size: int) -> NDArray[np.uint8]:
    """(places, size)."""
    return np.ascontiguousarray(held[places[:, None] + np.arange(size)])

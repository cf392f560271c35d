"""Faces of PLY files as trimesh reads them right: triangles.

Trimesh refuses binary files whose faces differ in their number of corners, and takes every polygon as convex.
"""

import re
from dataclasses import dataclass
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

    def row(self, first: int = 0, end: int | None = None) -> np.dtype[Any]:
        """Of some of its properties, none of them lists."""
        return np.dtype([(each.name, each.kind) for each in self.properties[first:end]])


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
    if place is None or len(elements[place].lists) != 1 or any(each.lists for each in elements[:place]):
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


def _cut(counts: Counts, corners: NDArray[Any], positions: NDArray[Any]) -> tuple[Counts, Counts]:
    """(triangles, 3) vertices, and the face that each is of."""
    if corners.size and not (corners.min() >= 0 and corners.max() < len(positions)):
        raise SceneError(f"a face names vertex {corners.max()}, but there are {len(positions)}")
    corners = corners.astype(np.intp)
    places = triangulated(counts, positions, corners)
    return corners[places], np.searchsorted(np.cumsum(counts), places[:, 0], side="right")


def _read_text(body: memoryview, before: list[_Element], face: _Element, budget: Budget) -> _Triangles | None:
    lines = bytes(body).splitlines(keepends=True)
    first = sum(each.count for each in before)
    if first + face.count > len(lines):
        raise SceneError(_EARLY)
    rows = [line.split() for line in lines[first : first + face.count]]
    place = face.lists[0]
    if any(len(row) <= place or len(row) <= place + int(row[place]) for row in rows):
        raise SceneError(_EARLY)
    counts = np.array([int(row[place]) for row in rows], np.intp)
    if (counts == 3).all():
        return None
    if counts.min() < 0:
        raise SceneError(_EARLY)
    corners = [int(corner) for row, count in zip(rows, counts, strict=True) for corner in row[place + 1 :][:count]]
    triangles, faces = _cut(counts, np.array(corners, np.int64), _positions_of_text(lines, before))
    others = [(row[:place], row[place + 1 + count :]) for row, count in zip(rows, counts, strict=True)]
    lengths = np.array([sum(map(len, [*ahead, *behind])) for ahead, behind in others])
    budget.take(bytes=int(lengths[faces].sum()))
    made = []
    for triangle, number in zip(triangles.tolist(), faces.tolist(), strict=True):
        ahead, behind = others[number]
        made.append(b" ".join([*ahead, b"3 %d %d %d" % tuple(triangle), *behind]))
    start = sum(map(len, lines[:first]))
    stop = start + sum(map(len, lines[first : first + face.count]))
    return _Triangles(b"\n".join([*made, b""]), len(triangles), slice(start, stop))


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
        row = element.row()
        if start + element.count * row.itemsize > len(body):
            raise SceneError(_EARLY)
        if element.name == "vertex":
            values = np.frombuffer(body, row, element.count, start)
            positions = np.stack([values[axis].astype(np.float64) for axis in "xyz"], axis=1)
        start += element.count * row.itemsize
    place = face.lists[0]
    ahead, behind = face.row(0, place).itemsize, face.row(place + 1).itemsize
    listed, length = face.properties[place].kind, face.properties[place].length
    assert length is not None
    layout = _Layout(ahead, length, listed, behind)
    starts, counts = layout.faces(body, start, face.count)
    if (counts == 3).all():
        return None
    held = np.frombuffer(body, np.uint8)
    first = starts + ahead + length.itemsize
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    corners = _bytes(held, np.repeat(first, counts) + within * listed.itemsize, listed.itemsize).view(listed)[:, 0]
    triangles, faces = _cut(counts, corners, positions)
    budget.take(bytes=len(triangles) * layout.size(3))
    ends = first + counts * listed.itemsize
    parts = [
        _bytes(held, starts[faces], ahead),
        np.tile(np.array([3], length).view(np.uint8), (len(triangles), 1)),
        np.ascontiguousarray(triangles.astype(listed)).view(np.uint8),
        _bytes(held, ends[faces], behind),
    ]
    stop = int(ends[-1]) + behind
    return _Triangles(np.concatenate(parts, axis=1).tobytes(), len(triangles), slice(start, stop))


@dataclass
class _Layout:
    """Of a face: bytes of what is ahead of its list, types of the list's length and numbers, bytes behind it."""

    ahead: int
    length: np.dtype[Any]
    listed: np.dtype[Any]
    behind: int

    def size(self, count: int) -> int:
        """Bytes of a face of so many corners."""
        return self.ahead + self.length.itemsize + count * self.listed.itemsize + self.behind

    def faces(self, body: memoryview, at: int, face_count: int) -> tuple[Counts, Counts]:
        """Where each begins, and its number of corners."""
        counts = self._alike(body, at, face_count)
        if counts is not None:
            return at + np.arange(face_count) * self.size(3), counts
        if at + face_count * self.size(0) > len(body):
            raise SceneError(_EARLY)
        starts, counts = np.empty(face_count, np.intp), np.empty(face_count, np.intp)
        for number in range(face_count):
            if at + self.size(0) > len(body):
                raise SceneError(_EARLY)
            count = int(np.frombuffer(body, self.length, 1, at + self.ahead)[0])
            starts[number], counts[number] = at, count
            at += self.size(count)
            if count < 0 or at > len(body):
                raise SceneError(_EARLY)
        return starts, counts

    def _alike(self, body: memoryview, at: int, face_count: int) -> Counts | None:
        """Where all are triangles, as in most files, their numbers of corners."""
        fields: Any = {"names": ["n"], "formats": [self.length], "offsets": [self.ahead], "itemsize": self.size(3)}
        if at + face_count * self.size(3) > len(body):
            return None
        counts = np.frombuffer(body, np.dtype(fields), face_count, at)["n"].astype(np.intp)
        return counts if (counts == 3).all() else None


def _bytes(held: NDArray[np.uint8], places: Counts, size: int) -> NDArray[np.uint8]:
    """(places, size)."""
    return np.ascontiguousarray(held[places[:, None] + np.arange(size)])

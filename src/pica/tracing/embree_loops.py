"""Loops over rays around Embree's packet calls, as machine code, so that they run on every core at once.

Packets of 16 rays, one array a field (RTCRayHit16, rtcore_ray.h), preceded by 16 validity flags: the rows
below index the fields.
"""

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

from pica.tracing.native_code import Code, MachineCode, Number, Row, Variable, machine_code

LANES = 16
ROWS = 22
# Rows of a packet: validity, RTCRay16, then RTCHit16.
_VALID, _RAY, _NEAR, _TIME, _FAR, _MASK, _ID, _FLAGS = 0, 1, 4, 8, 9, 10, 11, 12
_U, _V, _PRIMITIVE, _GEOMETRY, _INSTANCE = 16, 17, 18, 19, 20
_NONE = 0xFFFFFFFF
# Columns of the shaders' Ray (tracing/ray.slang): origin 0-2, minimum 3, direction 4-6, maximum 7, type and
# mask 8, seed 9, cone 10. Of Hit: distance, record, primitive, barycentrics.
RAY_COLUMNS, HIT_COLUMNS = 11, 5
_MINIMUM, _MAXIMUM, _TYPE_AND_MASK = 3, 7, 8
_CAMERA = 0
# Bits of masks: 0 to 7 belong to objects, these two to the sections below.
OPAQUE, CUTOUT = 1 << 8, 1 << 9
_OBJECTS = 0xFF


@dataclass(frozen=True)
class Loops:
    """The functions. They release the interpreter's lock; memory at the addresses must stay valid."""

    nearest: Callable[..., None]
    """(address of rtcIntersect16, scene, arguments for camera rays, rays, hits, queue, count, records, packet, room for
    `count` numbers): find the nearest hits of the `count` rays in the queue, and move misses to its end."""
    shadows: Callable[..., None]
    """(address of rtcIntersect16, of rtcOccluded16, scene, cutouts, rays, hits, queue, count, records, packet): test
    occlusion. Hits of opaque sections are final. Of the others, in the scene `cutouts` (0: there
    are none), the nearest is returned, for its coverage to be evaluated."""
    cull_backs: int
    """Where an RTCFilterFunctionN lies that rejects hits of camera rays on the backs of single-sided sections."""
    code: MachineCode


@cache
def loops() -> Loops:
    """Compiled at first use."""
    code = machine_code({"nearest": (10, _nearest), "shadows": (10, _shadows), "cull_backs": (1, _cull_backs)})
    function = ctypes.CFUNCTYPE(None, *[ctypes.c_size_t] * 10)  # releases the interpreter's lock
    nearest, shadows = (function(code.address(name)) for name in ("nearest", "shadows"))
    return Loops(nearest, shadows, code.address("cull_backs"), code)


class _Packet:
    """16 rays on their way through Embree, from `begin` on in the queue."""

    def __init__(self, code: Code, address: Number, rays: Number, hits: Number, queue: Number, records: Number) -> None:
        self._code, self.address = code, address
        self.bits, self.values = code.uints(address), code.floats(address)
        self.rays, self._hits, self._queue, self._records = rays, hits, code.uints(queue), code.uints(records)

    def ray(self, place: Number) -> Number:
        """Address of the ray at a position in the queue."""
        return self.rays + self._queue[place].word() * (4 * RAY_COLUMNS)

    def hit(self, place: Number) -> Number:
        """Address of its hit."""
        return self._hits + self._queue[place].word() * (4 * HIT_COLUMNS)

    def load(self, begin: Number, count: Number, sections: int) -> None:
        """Load the rays; `sections`: OPAQUE, CUTOUT or both."""
        code, bits = self._code, self.bits
        with code.loop(LANES) as lane:
            bits[_at(_VALID, lane)] = 0
            with code.when(begin + lane < count):
                ray = code.uints(self.ray(begin + lane))
                values = code.floats(self.ray(begin + lane))
                with code.when(values[_MAXIMUM] > values[_MINIMUM]):
                    bits[_at(_VALID, lane)] = _NONE
                for column in range(7):
                    bits[_at(_RAY + column, lane)] = ray[column]
                bits[_at(_FAR, lane)] = ray[_MAXIMUM]
                bits[_at(_MASK, lane)] = ray[_TYPE_AND_MASK] >> 8 & _OBJECTS | sections
            bits[_at(_TIME, lane)] = 0
            bits[_at(_FLAGS, lane)] = 0
            bits[_at(_GEOMETRY, lane)] = _NONE
            bits[_at(_INSTANCE, lane)] = _NONE

    def store(self, begin: Number, count: Number) -> None:
        """Store the hits."""
        code, bits = self._code, self.bits
        with code.loop(LANES) as lane, code.when(begin + lane < count):
            address = self.hit(begin + lane)
            code.floats(address)[0] = -1.0
            geometry = bits[_at(_GEOMETRY, lane)]
            with code.when(bits[_at(_VALID, lane)].differs(0) & geometry.differs(_NONE)):
                hit = code.uints(address)
                hit[0] = bits[_at(_FAR, lane)]
                hit[1] = self._records[bits[_at(_INSTANCE, lane)].word()] + geometry
                for column, row in enumerate((_PRIMITIVE, _U, _V), 2):
                    hit[column] = bits[_at(row, lane)]


def _at(row: int, lane: Number) -> Number:
    return lane + row * LANES


def _nearest(
    code: Code,
    intersect: Number,
    scene: Number,
    culling: Number,
    rays: Number,
    hits: Number,
    queue: Number,
    count: Number,
    records: Number,
    packet: Number,
    room: Number,
) -> None:
    sixteen = _Packet(code, packet, rays, hits, queue, records)
    arguments = Variable(code)
    with code.loop(count, LANES) as begin:
        sixteen.load(begin, count, OPAQUE | CUTOUT)
        arguments.set(culling & 0)
        with code.loop(LANES) as lane, code.when(begin + lane < count):
            kind = code.uints(sixteen.ray(begin + lane))[_TYPE_AND_MASK] & 0xFF
            sixteen.bits[_at(_ID, lane)] = kind
            with code.when(kind.equals(_CAMERA)):
                arguments.set(culling)
        code.call(intersect, packet, scene, packet + 4 * LANES, arguments.get())
        sixteen.store(begin, count)
    _misses_last(code, sixteen, code.uints(queue), count, code.uints(room))


def _misses_last(code: Code, packet: _Packet, queue: Row, count: Number, room: Row) -> None:
    """Reorder the queue, so that shader threads of one wave take the same path."""
    kept, missed = Variable(code), Variable(code)

    def append(row: Row, length: Variable, value: Number) -> None:
        row[length.get()] = value
        length.set(length.get() + 1)

    with code.loop(count) as place:
        ray, distance = queue[place], code.floats(packet.hit(place))[0]
        with code.when(distance < 0.0):
            append(room, missed, ray)
        with code.when((distance < 0.0).equals(0)):
            append(queue, kept, ray)
    with code.loop(missed.get()) as place:
        queue[kept.get() + place] = room[place]


def _shadows(
    code: Code,
    intersect: Number,
    occluded: Number,
    scene: Number,
    cutouts: Number,
    rays: Number,
    hits: Number,
    queue: Number,
    count: Number,
    records: Number,
    packet: Number,
) -> None:
    sixteen = _Packet(code, packet, rays, hits, queue, records)
    bits = sixteen.bits
    no_arguments = cutouts & 0
    with code.loop(count, LANES) as begin:
        sixteen.load(begin, count, OPAQUE)
        code.call(occluded, packet, scene, packet + 4 * LANES, no_arguments)
        with code.loop(LANES) as lane:
            # Occluded rays are disabled, and marked by the number that Embree does not modify.
            blocked = bits[_at(_VALID, lane)].differs(0) & (sixteen.values[_at(_FAR, lane)] < 0.0)
            bits[_at(_ID, lane)] = code.choose(blocked, bits[_at(_VALID, lane)], 0)
            bits[_at(_VALID, lane)] = bits[_at(_VALID, lane)] ^ bits[_at(_ID, lane)]
            bits[_at(_MASK, lane)] = bits[_at(_MASK, lane)] ^ (OPAQUE | CUTOUT)
        with code.when(cutouts.differs(0)):
            code.call(intersect, packet, cutouts, packet + 4 * LANES, no_arguments)
        sixteen.store(begin, count)
        with code.loop(LANES) as lane, code.when(bits[_at(_ID, lane)].differs(0)):
            address = sixteen.hit(begin + lane)
            code.floats(address)[0] = 0.0
            code.uints(address)[1] = _NONE


def _cull_backs(code: Code, arguments: Number) -> None:
    """Embree has ray and normal in object space, where glTF's front stays the front under a mirroring transform.

    RTCFilterFunctionNArguments: valid, user's, context, ray, hit, and their number.
    """

    valid, ray, hit = (code.words(arguments)[word] for word in (0, 3, 4))
    lanes = code.uints(arguments)[10].word()
    types, rays, normals = code.uints(ray), code.floats(ray), code.floats(hit)
    with code.loop(lanes) as lane:
        along = rays[lanes * 4 + lane] * normals[lane]
        for axis in (1, 2):
            along = along + rays[lanes * (4 + axis) + lane] * normals[lanes * axis + lane]
        with code.when((along > 0.0) & types[lanes * (_ID - _RAY) + lane].equals(_CAMERA)):
            code.uints(valid)[lane] = 0

"""Loops over rays around Embree's packet calls, compiled so that they run on every core at once.

Packets of 16 rays, one array a field (RTCRayHit16, rtcore_ray.h): the rows below index the fields. Import it by
kept_loops.py, which says where machine code is kept.
"""

from typing import Any

import numpy as np
from llvmlite import ir
from numba import cfunc, config, njit, types
from numba.extending import intrinsic
from numpy.typing import NDArray

LANES = 16
ROWS = 21
# Rows of a packet: RTCRay16, then RTCHit16.
_NEAR, _TIME, _FAR, _MASK, _ID, _FLAGS = 3, 7, 8, 9, 10, 11
_U, _V, _PRIMITIVE, _GEOMETRY, _INSTANCE = 15, 16, 17, 18, 19
_NONE = 0xFFFFFFFF
# Columns of the shaders' Ray (tracing/ray_effect.slang): origin 0-2, minimum 3, direction 4-6, maximum 7, type and
# mask 8, seed 9, cone 10.
_MINIMUM, _MAXIMUM, _TYPE_AND_MASK = 3, 7, 8
_CAMERA = 0
# Bits of masks: 0 to 7 belong to objects, these two to the sections below.
OPAQUE, CUTOUT = 1 << 8, 1 << 9
_OBJECTS = 0xFF
_KEPT = bool(config.CACHE_DIR)
# With signatures everything is compiled, or read from the cache, when this module is imported.
_WORD, _FLOATS, _BITS, _NUMBERS = types.uintp, types.float32[:, ::1], types.uint32[:, ::1], types.uint32[::1]
_ARRAYS = (_FLOATS, _BITS, _FLOATS, _BITS, _NUMBERS, _NUMBERS, _FLOATS, _BITS)


@intrinsic
def _call(_: Any, function: Any, valid: Any, scene: Any, packet: Any, arguments: Any) -> Any:
    """Call the C function of four pointers at an address."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        pointer = ir.IntType(8).as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [pointer] * 4).as_pointer()
        builder.call(builder.inttoptr(values[0], kind), [builder.inttoptr(v, pointer) for v in values[1:]])
        return context.get_dummy_value()

    return types.void(types.uintp, types.uintp, types.uintp, types.uintp, types.uintp), generate


@intrinsic
def _floats(_: Any, address: Any) -> Any:
    """The address as a pointer to floats."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.inttoptr(values[0], context.get_value_type(signature.return_type))

    return types.CPointer(types.float32)(types.uintp), generate


@cfunc(types.void(types.CPointer(types.uintp)), cache=_KEPT)
def cull_backs(arguments: Any) -> None:
    """Reject hits of camera rays on the backs of single-sided sections (an RTCFilterFunctionN).

    Embree gives ray and normal in the object's space, where the front is glTF's even under a mirroring transform.
    """
    valid, ray, hit = _floats(arguments[0]), _floats(arguments[3]), _floats(arguments[4])
    lanes = arguments[5] & 0xFFFFFFFF
    for lane in range(lanes):
        along = 0.0
        for axis in range(3):
            along += ray[(4 + axis) * lanes + lane] * hit[axis * lanes + lane]
        if along > 0 and ray[_ID * lanes + lane] == _CAMERA:
            valid[lane] = 0


@njit(nogil=True, cache=_KEPT)
def _load(
    rays: NDArray[np.float32],
    ray_bits: NDArray[np.uint32],
    queue: NDArray[np.uint32],
    begin: int,
    end: int,
    sections: int,
    packet: Any,
    bits: Any,
) -> None:
    for lane in range(LANES):
        bits[0, lane] = 0
        if begin + lane < end:
            ray = queue[begin + lane]
            if rays[ray, _MAXIMUM] > rays[ray, _MINIMUM]:
                bits[0, lane] = _NONE
            for field in range(7):
                packet[1 + field, lane] = rays[ray, field]
            packet[1 + _FAR, lane] = rays[ray, _MAXIMUM]
            bits[1 + _MASK, lane] = (ray_bits[ray, _TYPE_AND_MASK] >> 8 & _OBJECTS) | sections
        packet[1 + _TIME, lane] = 0
        bits[1 + _FLAGS, lane] = 0
        bits[1 + _GEOMETRY, lane] = _NONE
        bits[1 + _INSTANCE, lane] = _NONE


# All lanes in one call: Numba counts references to the arrays at every call.
@njit(nogil=True, cache=_KEPT)
def _store(
    queue: NDArray[np.uint32],
    begin: int,
    end: int,
    records: NDArray[np.uint32],
    hits: NDArray[np.float32],
    hit_bits: NDArray[np.uint32],
    packet: Any,
    bits: Any,
) -> None:
    for lane in range(end - begin):
        ray = queue[begin + lane]
        if bits[0, lane] == 0 or bits[1 + _GEOMETRY, lane] == _NONE:
            hits[ray, 0] = -1
        else:
            hits[ray, 0] = packet[1 + _FAR, lane]
            hit_bits[ray, 1] = records[bits[1 + _INSTANCE, lane]] + bits[1 + _GEOMETRY, lane]
            hit_bits[ray, 2] = bits[1 + _PRIMITIVE, lane]
            hits[ray, 3] = packet[1 + _U, lane]
            hits[ray, 4] = packet[1 + _V, lane]


@njit(nogil=True, cache=_KEPT)
def _misses_last(hits: NDArray[np.float32], queue: NDArray[np.uint32]) -> None:
    """Order the queue anew, so that shader threads which run in step do alike."""
    misses = np.empty(len(queue), np.uint32)
    kept = missed = 0
    for ray in queue:
        if hits[ray, 0] < 0:
            misses[missed] = ray
            missed += 1
        else:
            queue[kept] = ray
            kept += 1
    queue[kept:] = misses[:missed]


@njit(types.void(_WORD, _WORD, _WORD, *_ARRAYS), nogil=True, cache=_KEPT)
def nearest(
    intersect: int,
    scene: int,
    culling: int,
    rays: NDArray[np.float32],
    ray_bits: NDArray[np.uint32],
    hits: NDArray[np.float32],
    hit_bits: NDArray[np.uint32],
    queue: NDArray[np.uint32],
    records: NDArray[np.uint32],
    packet: NDArray[np.float32],
    bits: NDArray[np.uint32],
) -> None:
    """Find the nearest hits of the rays in `queue`."""
    address = bits.ctypes.data
    for begin in range(0, len(queue), LANES):
        end = min(begin + LANES, len(queue))
        _load(rays, ray_bits, queue, begin, end, OPAQUE | CUTOUT, packet, bits)
        camera = False
        for lane in range(end - begin):
            type = ray_bits[queue[begin + lane], _TYPE_AND_MASK] & 0xFF
            packet[1 + _ID, lane] = type
            camera = camera or type == _CAMERA
        _call(intersect, address, scene, address + 4 * LANES, culling if camera else 0)
        _store(queue, begin, end, records, hits, hit_bits, packet, bits)
    _misses_last(hits, queue)


@njit(types.void(_WORD, _WORD, _WORD, _WORD, *_ARRAYS), nogil=True, cache=_KEPT)
def shadows(
    intersect: int,
    occluded: int,
    scene: int,
    cutouts: int,
    rays: NDArray[np.float32],
    ray_bits: NDArray[np.uint32],
    hits: NDArray[np.float32],
    hit_bits: NDArray[np.uint32],
    queue: NDArray[np.uint32],
    records: NDArray[np.uint32],
    packet: NDArray[np.float32],
    bits: NDArray[np.uint32],
) -> None:
    """Find whether anything is in the way of the rays in `queue`.

    Opaque sections settle it. Of the others, which the scene `cutouts` has (0: there are none), the nearest is given,
    for its coverage to be looked up.
    """
    address = bits.ctypes.data
    blocked = np.zeros(LANES, np.bool_)
    for begin in range(0, len(queue), LANES):
        end = min(begin + LANES, len(queue))
        _load(rays, ray_bits, queue, begin, end, OPAQUE, packet, bits)
        _call(occluded, address, scene, address + 4 * LANES, 0)
        left = False
        for lane in range(end - begin):
            if packet[1 + _FAR, lane] < 0 and bits[0, lane] != 0:
                blocked[lane] = True
                bits[0, lane] = 0
            else:
                blocked[lane] = False
                left = left or bits[0, lane] != 0
            bits[1 + _MASK, lane] ^= OPAQUE | CUTOUT
        if cutouts != 0 and left:
            _call(intersect, address, cutouts, address + 4 * LANES, 0)
        _store(queue, begin, end, records, hits, hit_bits, packet, bits)
        for lane in range(end - begin):
            if blocked[lane]:
                hits[queue[begin + lane], 0] = 0
                hit_bits[queue[begin + lane], 1] = _NONE

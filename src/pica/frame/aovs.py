"""The G-buffer as arrays for people: metres, unit vectors, colours, numbers."""

from collections.abc import Callable, Mapping
from enum import IntEnum
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.frame.context import FrameContext, Size, camera_constants
from pica.gpu_scene.view import SceneView
from pica.graph.offers import Decoder
from pica.scene.camera import Camera

Array = NDArray[Any]


class AovKind(IntEnum):
    """The decoders of frame/decode_aov.slang."""

    TEXELS = 0
    DEPTH = 1
    ORTHOGRAPHIC_DEPTH = 2
    NORMAL = 3
    ALBEDO = 4
    METALLIC = 5
    ROUGHNESS = 6
    LIGHT = 7
    MOTION = 8
    LABEL = 9


def texels(channels: int) -> Decoder:
    """Reads the first channels of a texture as they are."""
    return Decoder(lambda values: values[..., :channels], AovKind.TEXELS, channels)


def gbuffer_aovs(scene: SceneView) -> dict[str, tuple[tuple[str, ...], Callable[[FrameContext], Callable[..., Array]]]]:
    """The AOVs of a G-buffer (pica.images.aov_table): names of its textures, and a function of the frame that
    returns the function that makes the AOV from them."""

    def label(which: int) -> Callable[[FrameContext], Callable[..., Array]]:
        def prepare(frame: FrameContext) -> Callable[..., Array]:
            table = scene.labels()[:, which]  # of now: a later frame may have other nodes
            return Decoder(partial(_labelled, table), AovKind.LABEL, 1, {"table": table})

        return prepare

    def depth(frame: FrameContext) -> Callable[..., Array]:
        camera = frame.camera
        kind = AovKind.DEPTH if camera.orthographic_height is None else AovKind.ORTHOGRAPHIC_DEPTH
        return Decoder(partial(_depth, camera), kind, 1, {"near": camera.near, "far": camera.far})

    def fixed(
        read: Callable[..., Array], kind: AovKind, channels: int, **values: int
    ) -> Callable[[FrameContext], Callable[..., Array]]:
        decoder = Decoder(read, kind, channels, values)
        return lambda frame: decoder

    def normal(which: int) -> Callable[[FrameContext], Callable[..., Array]]:
        def read(normals: Array, records: Array) -> Array:
            return _normals(normals[..., which], records[..., 0] > 0)

        return fixed(read, AovKind.NORMAL, 3, which=which)

    shape = "normals", "visibility"
    return {
        "depth": (("depth",), depth),
        "position": (
            ("depth",),
            lambda frame: partial(_positions, _view_of(frame), frame.jitter, partial(_depth, frame.camera)),
        ),
        "normal": (shape, normal(1)),
        "geometric_normal": (shape, normal(0)),
        "albedo": (("material",), fixed(_albedo, AovKind.ALBEDO, 3)),
        "metallic": (("material",), fixed(_metallic, AovKind.METALLIC, 1)),
        "roughness": (("material",), fixed(_roughness, AovKind.ROUGHNESS, 1)),
        "emission": (("emission",), fixed(light_of, AovKind.LIGHT, 3)),
        "motion": (("motion",), fixed(lambda packed: motion_of(packed)[..., :2], AovKind.MOTION, 2)),
        "instance": (("visibility",), label(0)),
        "material": (("visibility",), label(1)),
    }


def _labelled(labels: Array, visibility: Array) -> Array:
    records = visibility[..., 0].astype(np.int64)
    return np.where(records > 0, labels[np.maximum(records - 1, 0)], 0).astype(np.uint32)


def _depth(camera: Camera, values: Array) -> Array:
    """Metres along the view axis."""
    with np.errstate(divide="ignore"):
        if camera.orthographic_height is None:
            return np.asarray(camera.near / values, np.float32)
    return np.where(values > 0, camera.far - values * (camera.far - camera.near), np.inf).astype(np.float32)


def alpha_of(channel: int, values: Array) -> Array:
    """(height, width) 0 to 1, of a texture that has alpha in a channel."""
    return np.clip(values[..., channel], 0, 1)


def at_size(size: Size, aovs: Mapping[str, Callable[[], Array]]) -> dict[str, Callable[[], Array]]:
    """The AOVs as pictures of `size`: nearest samples, without interpolation. Motion is in
    pixels of `size`."""

    def resized(name: str, fetch: Callable[[], Array]) -> Array:
        array = fetch()
        width, height = size
        if array.shape[:2] == (height, width):
            return array
        rows, columns = (
            (2 * np.arange(target) + 1) * source // (2 * target)  # the pixel that the centre of each lies in
            for target, source in zip((height, width), array.shape, strict=False)
        )
        if name == "motion":
            array = array * np.array((width / array.shape[1], height / array.shape[0]), np.float32)
        return array[rows[:, None], columns]

    return {name: partial(resized, name, fetch) for name, fetch in aovs.items()}


def _view_of(frame: FrameContext) -> dict[str, Array]:
    """The camera's parameters for unprojection, as in shaders/camera.slang."""
    width, height = frame.output_size
    constants = camera_constants(frame.camera, frame.size, width / height)
    vectors = ("position", "forward", "right", "up", "shift", "orthographic")
    return {name: np.array(constants[name], np.float64) for name in vectors}


def _positions(
    view: Mapping[str, Array], jitter: tuple[float, float], read_depth: Callable[[Array], Array], values: Array
) -> Array:
    """(height, width, 3) positions at this depth, through the jittered samples; as `unproject` in
    shaders/camera.slang."""
    depth = read_depth(values)
    height, width = depth.shape
    right = (np.arange(width) + 0.5 + jitter[0]) / width * 2 - 1 + view["shift"][0]
    up = 1 - (np.arange(height) + 0.5 + jitter[1]) / height * 2 + view["shift"][1]
    distance = np.where(np.isfinite(depth), depth, np.nan)[..., None].astype(np.float64)
    offset = right[None, :, None] * view["right"] + up[:, None, None] * view["up"]
    scale = np.where(np.isnan(distance), np.nan, 1) if view["orthographic"] else distance
    return (view["position"] + view["forward"] * distance + offset * scale).astype(np.float32)


def _albedo(packed: Array) -> Array:
    channels = np.stack([packed[..., 0] & 0xFFFF, packed[..., 0] >> 16, packed[..., 1] & 0xFFFF], axis=-1)
    return (channels / 65535).astype(np.float32)


def _metallic(packed: Array) -> Array:
    return ((packed[..., 1] >> 16 & 0xFF) / 255).astype(np.float32)


def _roughness(packed: Array) -> Array:
    return ((packed[..., 2] & 0xFFFF) / 65535).astype(np.float32)


def light_of(packed: Array) -> Array:
    """Linear colours (height, width, 3): as unpackFloat21x3 in shaders/packing.slang, of its first two words."""
    low, high = packed[..., 0], packed[..., 1]
    codes = np.stack([low & 0x1FFFFF, (low >> 21 | high << 11) & 0x1FFFFF, high >> 10 & 0x1FFFFF], axis=-1)
    return float21(codes)


def float21(codes: Array) -> Array:
    """Numbers of these bits: as unpackFloat21 in shaders/packing.slang."""
    values = ((codes << 8) + np.uint32((127 - 25) << 23)).view(np.float32)
    return np.where(codes > 0, values, np.float32(0))


def motion_of(packed: Array) -> Array:
    """The motion texture (height, width, 2) as float32 (height, width, 3): pixels right and down to the surface's
    position in the previous frame, and how many metres farther it was, NaN without history (frame/motion.slang).
    """
    pixels = (packed << 9).view(np.float32)
    change = ((packed[..., 0] >> 23 | packed[..., 1] >> 23 << 9) << 14).view(np.float32)
    return np.concatenate([pixels, change[..., None]], axis=-1)


def _normals(packed: Array, covered: Array) -> Array:
    """As unpackNormal in shaders/packing.slang."""
    plane = np.stack([packed & 0xFFFF, packed >> 16], axis=-1).astype(np.uint16).view(np.int16)
    plane = np.maximum(plane.astype(np.float32) / 32767, -1)
    height = 1 - np.abs(plane).sum(-1)
    folded = (1 - np.abs(plane[..., ::-1])) * np.where(plane >= 0, 1, -1)
    plane = np.where(height[..., None] < 0, folded, plane)
    vectors = np.concatenate([plane, height[..., None]], axis=-1)
    vectors /= np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-20)
    return np.where(covered[..., None], vectors, 0).astype(np.float32)

"""One frame on its way: what it records into, its camera, its index, and the constants that shaders read."""

import time
from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.rhi.binding import ParameterBlock
from pica.rhi.device import Device
from pica.rhi.profiler import FRAMES_IN_FLIGHT, Profiler
from pica.scene.camera import Camera

Size = tuple[int, int]
"""(width, height) in pixels."""


@dataclass
class FrameContext:
    """What passes need to know of the frame that they work for."""

    device: Device
    encoder: spy.CommandEncoder
    profiler: Profiler
    size: Size
    index: int
    """Counts frames since the history was dropped; noise depends on it."""
    camera: Camera
    block: ParameterBlock
    """The constants that shaders read."""
    started: float
    """time.perf_counter() when the frame began."""
    camera_moved: bool
    """True in a first frame and whenever the camera differs from the frame before."""

    @property
    def grid(self) -> tuple[int, int, int]:
        """One thread a pixel."""
        return (*self.size, 1)


class FrameSequence:
    """Makes one frame after another: numbers them, jitters them, remembers the camera before."""

    def __init__(self, device: Device, size: Size, seed: int) -> None:
        self._block = device.parameter_block("shaders/frame.slang", "frame")
        self._device, self._size = device, size
        self._previous: Camera | None = None
        self._index = 0
        self._in_flight: deque[int] = deque()
        self.host_seconds = 0.0
        """What the newest frame took to record and submit."""
        self._block.bind(size=spy.uint2(*size), seed=seed)

    def reset(self) -> None:
        """Start again from frame 0."""
        self._previous, self._index = None, 0

    def rewind(self) -> None:
        """Count from frame 0 again, but remember the camera before."""
        self._index = 0

    def begin(self, camera: Camera, jittered: bool = True) -> FrameContext:
        """The next frame. Frame 0 looks through the pixel centres, those after it round about them."""
        started = time.perf_counter()
        previous = self._previous or camera
        jitter = (radical_inverse(2, self._index), radical_inverse(3, self._index)) if jittered else (0.0, 0.0)
        self._block.bind(
            camera=camera_constants(camera, self._size),
            previousCamera=camera_constants(previous, self._size),
            jitter=spy.float2(*jitter),
            index=self._index,
        )
        moved = self._previous is None or not same_view(previous, camera)
        self._device.profiler.begin_frame()
        context = FrameContext(
            device=self._device,
            encoder=self._device.handle.create_command_encoder(),
            profiler=self._device.profiler,
            size=self._size,
            index=self._index,
            camera=camera,
            block=self._block,
            started=started,
            camera_moved=moved,
        )
        self._previous = camera
        self._index += 1
        return context

    def end(self, frame: FrameContext) -> None:
        """Hand the frame to the GPU, waiting while too many are under way."""
        submission = self._device.handle.submit_command_buffer(frame.encoder.finish())
        frame.profiler.end_frame(submission)
        self.host_seconds = time.perf_counter() - frame.started
        self._in_flight.append(submission)
        if len(self._in_flight) > FRAMES_IN_FLIGHT:
            self._device.handle.wait_for_submit(self._in_flight.popleft())


def radical_inverse(base: int, index: int) -> float:
    """Van der Corput's sequence, shifted so that index 0 gives 0 and all values lie in -0.5 to 0.5."""
    value, scale = 0.0, 1.0
    while index:
        scale /= base
        value += scale * (index % base)
        index //= base
    return value if value < 0.5 else value - 1.0


def same_view(a: Camera, b: Camera) -> bool:
    """Whether two cameras show the same."""
    return a is b or (
        bool(np.array_equal(a.transform, b.transform))
        and (a.vertical_fov, a.near, a.far, a.orthographic_height)
        == (b.vertical_fov, b.near, b.far, b.orthographic_height)
    )


def camera_constants(camera: Camera, size: Size) -> dict[str, Any]:
    """The fields of shaders/camera.slang."""
    width, height = size
    orthographic = camera.orthographic_height is not None
    half = camera.orthographic_height / 2 if camera.orthographic_height else np.tan(camera.vertical_fov / 2)
    axes = camera.transform[:3, :3]
    return {
        "position": _float3(camera.transform[:3, 3]),
        "nearPlane": camera.near,
        "forward": _float3(-axes[:, 2]),
        "farPlane": camera.far,
        "right": _float3(axes[:, 0] * half * width / height),
        "orthographic": int(orthographic),
        "up": _float3(axes[:, 1] * half),
        "pixelSize": float(2 * half / height),
    }


def _float3(vector: NDArray[np.float64]) -> spy.float3:
    return spy.float3(float(vector[0]), float(vector[1]), float(vector[2]))

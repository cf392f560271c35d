"""One frame: its command encoder, its camera, its index, and the constants that shaders read."""

import math
import time
from collections import deque
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import slangpy as spy

from pica.rhi.binding import ParameterBlock
from pica.rhi.device import Device
from pica.rhi.passes import DeviceRecording
from pica.rhi.profiler import FRAMES_IN_FLIGHT, Profiler
from pica.scene.camera import Camera

Size = tuple[int, int]
"""(width, height) in pixels."""
_TEXTURE_SHARE = 0.5
"""Of the width of an output pixel, over which rays average textures; jittered frames average the rest. That is the mip
bias of log2(render size / output size) - 1 that AMD's FidelityFX Super Resolution 2 asks for."""
_RESTING_FRAMES = 16
"""While nothing moves, the nth frame averages over 1/sqrt(n) of that, as n samples of a pixel lie so far apart. This is
the largest n."""


@dataclass
class FrameContext:
    """The frame, as passes need it."""

    device: Device
    recording: DeviceRecording
    size: Size
    """At which effects work: the render size."""
    output_size: Size
    """Of the picture that is shown; antialiasing makes it."""
    index: int
    """Counts frames since the history was dropped, from `Renderer.reset`'s number; noise depends on it."""
    first: bool
    """Whether the history was dropped before it."""
    camera: Camera
    jitter: tuple[float, float]
    """Subpixel offset of the samples from pixel centres, pixels right and down."""
    block: ParameterBlock
    """The constants that shaders read."""
    started: float
    """time.perf_counter() when the frame, or the batch that it is in, began."""
    camera_moved: bool
    """Whether the camera differs from the frame before; true in a first frame."""
    changed: bool
    """Whether the camera or, once it is updated, the scene differs from the frame before; true in a first frame."""
    changed_scene: bool = True
    """Whether the scene does, once it is updated."""
    changed_lights: bool = True
    """Whether emitters do, once the scene is updated."""
    since_relit: int = 0
    """Frames since emitters have changed, as Relighting counts them."""
    continues: bool = False
    """Whether it is another frame of the picture that the frame before is of: nothing has moved since."""
    seconds: float | None = None
    """Since the picture before; None: unknown."""
    requested: frozenset[str] = frozenset()
    """Names of AOVs and views to capture."""

    @property
    def encoder(self) -> spy.CommandEncoder:
        """The command encoder."""
        return self.recording.encoder

    @encoder.setter
    def encoder(self, encoder: spy.CommandEncoder) -> None:
        self.recording.encoder = encoder

    @property
    def variant(self) -> int:
        """Which of a pass's sets of parameters to use."""
        return self.recording.variant

    @variant.setter
    def variant(self, variant: int) -> None:
        self.recording.variant = variant

    @property
    def profiler(self) -> Profiler:
        """Times the passes."""
        return self.recording.profiler

    @property
    def grid(self) -> tuple[int, int, int]:
        """One thread a pixel of `size`."""
        return (*self.size, 1)

    @property
    def output_grid(self) -> tuple[int, int, int]:
        """One thread a pixel of `output_size`."""
        return (*self.output_size, 1)


class Batch:
    """Frames of one or more views, in one recording that is submitted by the `end` of the first view's sequence."""

    def __init__(self, device: Device, views: int = 1) -> None:
        self.started = time.perf_counter()
        device.profiler.begin_frame(views)
        self.recording = DeviceRecording(device.handle.create_command_encoder(), device.profiler)


class FrameSequence:
    """Makes one frame after another: numbers them, jitters them, remembers the camera before."""

    def __init__(self, device: Device, output_size: Size, seed: int, upscale: float = 1.0) -> None:
        """`upscale`: pixels of the output to one of the render size, along each side."""
        self.block = device.parameter_block("frame/constants.slang", "frame")
        """The constants that shaders read, of the newest frame."""
        self.half_block = device.parameter_block("frame/constants.slang", "frame")
        """The same for passes at half width and height: one pixel of each 2x2 represents all four, another one in the
        next frame (frame/half.slang)."""
        self._device, self._upscale = device, upscale
        self._previous: Camera | None = None
        self._recent_constants: dict[int, deque[tuple[Camera, dict[str, Any]]]] = {
            step: deque(maxlen=2) for step in (1, 2)
        }
        """Constants of the newest two cameras, at full and at half size."""
        self._jitter = 0.0, 0.0
        self._index, self._first = 0, True
        self._resting = 0
        """Frames since the camera or lights have changed, up to _RESTING_FRAMES."""
        self._in_flight: deque[int] = deque()
        self.host_seconds = 0.0
        """Time to record and submit the newest frame."""
        for block in (self.block, self.half_block):
            block.bind(seed=seed, textureScale=_TEXTURE_SHARE / upscale)
        self.resize(output_size)

    def resize(self, output_size: Size) -> None:
        """Frames of another size, from frame 0."""
        self.output_size = output_size
        self.size = render_size(output_size, self._upscale)
        """At which effects work."""
        self.block.bind(size=spy.uint2(*self.size), outputSize=spy.uint2(*output_size))
        self.half_block.bind(size=spy.uint2(*half_size(self.size)), outputSize=spy.uint2(*output_size))
        for recent in self._recent_constants.values():
            recent.clear()
        self.reset()

    def reset(self, index: int = 0) -> None:
        """Start again, from frame `index`."""
        self._previous, self._index, self._first = None, index, True

    @property
    def has_aperture(self) -> bool:
        """Whether the newest frame's camera has one, so that not all is in focus."""
        return self._previous is not None and self._previous.aperture_radius > 0

    @property
    def has_camera(self) -> bool:
        """Whether `block` has the camera of a frame of this size."""
        return bool(self._recent_constants[1])

    @property
    def is_first(self) -> bool:
        """Whether the next frame is the first since `reset` or `rewind`."""
        return self._first

    def rewind(self) -> None:
        """Count from frame 0 again, but remember the camera before."""
        self._index, self._first = 0, True

    def note_changed_lights(self) -> None:
        """Lights have changed: the next frame averages over textures as if the camera had just moved.

        Histories of pixels are short then, and finer textures would flicker."""
        self._resting = 0

    def skip_to(self, index: int) -> None:
        """Count from frame `index` on."""
        self._index = index

    def begin(self, camera: Camera, jittered: bool = True, batch: Batch | None = None) -> FrameContext:
        """The next frame. Frame 0 samples pixel centres, later ones are jittered about them. `batch`: in which it is
        recorded; None: alone."""
        batch = batch or Batch(self._device)
        previous = self._previous or camera
        jitter = (radical_inverse(2, self._index), radical_inverse(3, self._index)) if jittered else (0.0, 0.0)
        index, size = self._index, self.size
        moved = self._first or not same_view(previous, camera)
        self._resting = 1 if moved or not jittered else min(self._resting + 1, _RESTING_FRAMES)
        self._bind(camera, previous, jitter)
        context = FrameContext(
            device=self._device,
            recording=batch.recording,
            size=size,
            output_size=self.output_size,
            index=index,
            first=self._first,
            camera=camera,
            jitter=jitter,
            block=self.block,
            started=batch.started,
            camera_moved=moved,
            changed=moved,
        )
        self._previous, self._jitter = camera, jitter
        self._index, self._first = self._index + 1, False
        return context

    def _bind(self, camera: Camera, previous: Camera, jitter: tuple[float, float]) -> None:
        index = self._index
        for block, step in ((self.block, 1), (self.half_block, 2)):
            before = self._jitter
            if step == 2:
                jitter, before = _half_jitter(index, jitter), _half_jitter(index - 1, before)
            block.bind(
                camera=self._constants_of(camera, step),
                previousCamera=self._constants_of(previous, step),
                jitter=spy.float2(*jitter),
                previousJitter=spy.float2(*before),
                index=index,
                restingTextureScale=_TEXTURE_SHARE / self._upscale / math.sqrt(self._resting),
            )

    def _constants_of(self, camera: Camera, step: int) -> dict[str, Any]:
        """The same dictionary for the same camera, which blocks then need not be given again."""
        for recent_camera, constants in self._recent_constants[step]:
            if recent_camera is camera:
                return constants
        constants = camera_constants(camera, self.size, self.output_size[0] / self.output_size[1], step)
        self._recent_constants[step].append((camera, constants))
        return constants

    def end(self, frame: FrameContext) -> None:
        """Hand the frame to the GPU, waiting while too many are under way."""
        submission = self._device.submissions.submit(frame.encoder)
        frame.profiler.end_frame(submission)
        self.host_seconds = time.perf_counter() - frame.started
        self._in_flight.append(submission)
        if len(self._in_flight) > FRAMES_IN_FLIGHT:
            self._device.submissions.wait(self._in_flight.popleft())


@lru_cache(maxsize=64)
def radical_inverse(base: int, index: int) -> float:
    """Van der Corput's sequence, shifted so that index 0 gives 0 and all values lie in -0.5 to 0.5."""
    value, scale = 0.0, 1.0
    while index:
        scale /= base
        value += scale * (index % base)
        index //= base
    return value if value < 0.5 else value - 1.0


def render_size(output: Size, upscale: float) -> Size:
    """The size to render at for a picture of the size `output`, in whole pixels."""
    return max(1, round(output[0] / upscale)), max(1, round(output[1] / upscale))


def half_size(size: Size) -> Size:
    """Half of it, rounded up."""
    return (size[0] + 1) // 2, (size[1] + 1) // 2


def half_pixel_offset(index: int) -> tuple[int, int]:
    """Which pixel of each 2x2, (right, down), represents all in frame `index` at half size; as in frame/half.slang."""
    step = index + (index >> 2)
    return (step ^ step >> 1) & 1, step & 1


def _half_jitter(index: int, jitter: tuple[float, float]) -> tuple[float, float]:
    """The sample's offset from the centre of a half-size pixel: centres of its four pixels are .25 away from it."""
    x, y = ((offset + shift - 0.5) / 2 for offset, shift in zip(half_pixel_offset(index), jitter, strict=True))
    return x, y


_LENS = ("vertical_fov", "near", "far", "orthographic_height", "principal_point", "pixel_aspect")


def same_view(a: Camera, b: Camera) -> bool:
    """Whether two cameras show the same, out of focus or not: depth of field has no history."""
    return a is b or (
        bool(np.array_equal(a.transform, b.transform)) and all(getattr(a, name) == getattr(b, name) for name in _LENS)
    )


def pixel_size(camera: Camera, height: int) -> float:
    """The longer side of a pixel in a picture with so many rows: metres if orthographic, else at distance 1."""
    return float(2 * camera.half_height / height * max(camera.pixel_aspect, 1))


def camera_constants(camera: Camera, size: Size, aspect: float | None = None, step: int = 1) -> dict[str, Any]:
    """The fields of shaders/camera.slang for a picture of `size`, or one whose pixels are `step` of its pixels wide.

    `aspect`: width over height of the camera's image; None for that of `size`, which rounding may have changed.
    If `step` does not divide the size, the last pixels of the coarser picture extend beyond the finer one.
    """
    width, height = size
    # How much farther the coarser picture extends, to the right and down.
    across, down = (-(-length // step) * step / length for length in size)
    orthographic = camera.orthographic_height is not None
    half = camera.half_height
    # From the view axis to the picture's middle, in halves of its width and height.
    aside, above = 1 - 2 * camera.principal_point[0], 2 * camera.principal_point[1] - 1
    # Numbers: NumPy's arrays of three are slower.
    (right0, up0, back0, x), (right1, up1, back1, y), (right2, up2, back2, z), _ = camera.transform.tolist()
    width_over_height, pixel_aspect = aspect or width / height, camera.pixel_aspect

    def wide(component: float) -> float:
        return component * half * width_over_height * pixel_aspect * across

    return {
        "position": spy.float3(x, y, z),
        "nearPlane": camera.near,
        "forward": spy.float3(-back0, -back1, -back2),
        "farPlane": camera.far,
        "right": spy.float3(wide(right0), wide(right1), wide(right2)),
        "orthographic": int(orthographic),
        "up": spy.float3(up0 * half * down, up1 * half * down, up2 * half * down),
        "pixelSize": step * pixel_size(camera, height),
        "shift": spy.float2(1 - (1 - aside) / across, (1 + above) / down - 1),
    }

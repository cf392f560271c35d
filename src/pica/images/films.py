"""Writing films: H.264 in .mp4, through PyAV. No graphics device is opened."""

from collections.abc import Iterable, Iterator
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from av.video.frame import VideoFrame
from av.video.reformatter import ColorPrimaries, ColorRange, Colorspace, ColorTrc
from av.video.stream import VideoStream
from numpy.typing import NDArray

from pica.errors import PicaError
from pica.images.background import Background
from pica.images.saving import write_whole

SLOWEST, FASTEST = 0.001, 1000.0
"""Pictures a second."""
QUALITY = "18"
"""x264's constant rate factor: 0 is lossless, 23 its default; 18 is nearly transparent."""
_AHEAD = 4
"""Pictures that wait for the encoder at most."""


def write_video(path: str | Path, pictures: Iterable[NDArray[np.uint8]], fps: float) -> None:
    """Write (height, width, 3) uint8 sRGB pictures as H.264 with 4:2:0 chroma in .mp4, which plays everywhere.

    `pictures` may be a generator, such as one that renders: a thread encodes while it makes the next one, and a few are
    held at a time. Raises PicaError if there are none, if their width or height is odd or differs, if there are too
    many or few a second (`SLOWEST`, `FASTEST`), or if the file cannot be written; and what the generator raises. An
    existing file at `path` then stays.
    """
    path = Path(path)
    if not SLOWEST <= fps <= FASTEST:
        raise PicaError(f"{path}: {fps} pictures a second, must be {SLOWEST:g} to {FASTEST:g}")
    try:
        write_whole(path, lambda temporary: _encode(temporary, path, _unmade(pictures), fps))
    except _UnmadeError as error:
        raise error.fault from None


def describe(path: str | Path) -> tuple[int, int, int]:
    """(pictures, width, height) of a film. Raises PicaError when it cannot be read."""
    try:
        with av.open(Path(path)) as container:
            stream = container.streams.video[0]
            return stream.frames, stream.width, stream.height
    except av.FFmpegError as error:
        raise PicaError(f"{path}: not a readable film ({error.strerror})") from None
    except IndexError:
        raise PicaError(f"{path}: has no pictures") from None


class _UnmadeError(Exception):
    """Carries an error of the pictures' generator past the handlers of the file's errors."""

    def __init__(self, fault: BaseException) -> None:
        self.fault = fault


def _unmade(pictures: Iterable[NDArray[np.uint8]]) -> Iterator[NDArray[np.uint8]]:
    try:
        yield from pictures
    except Exception as fault:
        raise _UnmadeError(fault) from None


def _encode(temporary: Path, path: Path, pictures: Iterable[NDArray[np.uint8]], fps: float) -> None:
    stream: VideoStream | None = None
    try:
        # The index goes in front, so that the film plays during download. The thread ends before the file is closed.
        with (
            av.open(temporary, "w", format="mp4", options={"movflags": "+faststart"}) as container,
            Background(1, _AHEAD) as background,
        ):

            def add(stream: VideoStream, picture: NDArray[np.uint8] | None) -> None:
                container.mux(stream.encode(None if picture is None else _in_film_colors(picture)))

            for number, picture in enumerate(pictures):
                height, width = picture.shape[:2]
                if stream is None:
                    check_size(path, width, height)
                    stream = container.add_stream("libx264", Fraction(fps).limit_denominator(1001))
                    _set_format(stream, width, height)
                if (width, height) != (stream.width, stream.height):
                    size = f"{stream.width}x{stream.height}"
                    raise PicaError(f"{path}: picture {number} is {width}x{height}, those before it are {size}")
                background(add, stream, picture)
            if stream is None:
                raise PicaError(f"{path}: there are no pictures to make a film of")
            background(add, stream, None)
    except av.FFmpegError as error:
        raise PicaError(f"{path}: cannot be written ({error.strerror})") from None


def check_size(path: Path, width: int, height: int) -> None:
    """Raise PicaError unless a film can have pictures of this size: 4:2:0 chroma has one sample for 2x2 pixels."""
    if width % 2 or height % 2:
        raise PicaError(f"{path}: a film needs an even width and height, not {width}x{height}")


def _set_format(stream: VideoStream, width: int, height: int) -> None:
    stream.width, stream.height = width, height
    stream.pix_fmt = "yuv420p"
    stream.options = {"crf": QUALITY}
    # Colour metadata for players: Rec. 709 primaries and matrix, the transfer curve of sRGB.
    context = stream.codec_context
    context.colorspace = Colorspace.ITU709
    context.color_primaries = ColorPrimaries.BT709
    context.color_trc = ColorTrc.IEC61966_2_1
    context.color_range = ColorRange.MPEG


def _in_film_colors(picture: NDArray[np.uint8]) -> VideoFrame:
    rgb = VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")
    return rgb.reformat(format="yuv420p", dst_colorspace=Colorspace.ITU709, dst_color_range=ColorRange.MPEG)

"""Encodes and sends pictures while the next one is rendered."""

from concurrent.futures import Future, ThreadPoolExecutor
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import viser


class Sender:
    """Sends one picture at a time, by a thread of its own: to encode a large one takes as long as to render it."""

    def __init__(self) -> None:
        self._thread = ThreadPoolExecutor(1, "pica.view.sender")
        self._under_way: Future[None] | None = None

    def send(self, client: "viser.ClientHandle", pixels: NDArray[np.uint8], quality: int) -> None:
        """Send (height, width, 3) sRGB as a JPEG of this quality, 1 to 100. Waits for the picture before, so
        that none is rendered that would only queue up; raises what that has raised."""
        if self._under_way is not None:
            self._under_way.result()
        self._under_way = self._thread.submit(_send, client, pixels, quality)

    def close(self) -> None:
        """Wait for the picture under way."""
        self._thread.shutdown()


def _send(client: "viser.ClientHandle", pixels: NDArray[np.uint8], quality: int) -> None:
    packed = np.empty(pixels.shape, np.uint8)
    for channel in range(3):  # `pixels` are parts of wider ones, which NumPy copies three times as fast like this
        packed[..., channel] = pixels[..., channel]
    client.scene.set_background_image(packed, format="jpeg", jpeg_quality=quality)
    client.flush()

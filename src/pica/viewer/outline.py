"""The outline of what is selected, drawn over a picture."""

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.rhi.device import Device

_COLOR = (255, 140, 0)
"""sRGB."""


def outlined(pixels: NDArray[np.uint8], selected: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """(height, width, 3) sRGB, with a line of two pixels around `selected`, (height, width)."""
    inner, outer = ~_grown(~selected), _grown(selected)
    result = pixels.copy()
    result[outer & ~inner] = _COLOR
    return result


class DeviceOutline:
    """The same, on the device. The newest picture's texture is overwritten by the next."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._draw = device.compute("viewer/outline.slang")
        self._result: spy.Texture | None = None

    def __call__(self, display: spy.Texture, visibility: spy.Texture, is_selected: NDArray[np.bool_]) -> spy.Texture:
        """`display` with the outline. `visibility`: the G-buffer's. `is_selected`: (records,)."""
        size = display.width, display.height
        result = self._result_of(size)
        device = self._device
        records = device.buffer("selected records", data=is_selected.astype(np.uint32), struct_size=4)
        with device.record() as recording:
            self._draw(
                recording,
                (*size, 1),
                display=display,
                visibility=visibility,
                isSelected=records,
                outlined=result,
                displaySize=size,
                visibilitySize=(visibility.width, visibility.height),
                color=[value / 255 for value in _COLOR],
            )
        device.give_back(records)
        return result

    def close(self) -> None:
        """Release its device memory."""
        if self._result is not None:
            self._device.give_back(self._result)
            self._result = None

    def _result_of(self, size: tuple[int, int]) -> spy.Texture:
        kept = self._result
        if kept is None or (kept.width, kept.height) != size:
            self.close()
            kept = self._result = self._device.texture("outlined picture", spy.Format.rgba8_unorm, size)
        return kept


def _grown(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """With all eight neighbours."""
    rows = mask.copy()
    rows[1:] |= mask[:-1]
    rows[:-1] |= mask[1:]
    grown = rows.copy()
    grown[:, 1:] |= rows[:, :-1]
    grown[:, :-1] |= rows[:, 1:]
    return grown

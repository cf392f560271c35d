"""The outline of what is selected: on the host, and the same on the device."""

import numpy as np
import pytest
import slangpy as spy

from pica.viewer.outline import DeviceOutline, outlined

ORANGE = (255, 140, 0)


def test_a_line_of_two_pixels_is_around_what_is_selected():
    selected = np.zeros((12, 16), bool)
    selected[4:8, 5:11] = True
    grey = np.full((12, 16, 3), 90, np.uint8)
    line = (outlined(grey, selected) == ORANGE).all(-1)
    wanted = np.zeros_like(selected)
    wanted[3:9, 4:12] = True
    wanted[5:7, 6:10] = False
    assert np.array_equal(line, wanted)
    assert np.array_equal(outlined(grey, selected)[~line], grey[~line])


@pytest.mark.parametrize("rendered", [(53, 31), (35, 21)])
def test_the_device_draws_the_same(device, rendered):
    size = 53, 31
    random, outline = np.random.default_rng(2), DeviceOutline(device)
    before = device.memory
    pixels = random.integers(0, 256, (size[1], size[0], 4), np.uint8)
    blocks = np.kron(random.integers(0, 4, (6, 8)), np.ones((6, 7), int))[: rendered[1], : rendered[0]]
    display = device.texture("display", spy.Format.rgba8_unorm, size)
    display.copy_from_numpy(pixels)
    visibility = device.texture("visibility", spy.Format.rg32_uint, rendered)
    visibility.copy_from_numpy(np.stack([blocks, 0 * blocks], -1).astype(np.uint32))
    rows, columns = (
        (2 * np.arange(full) + 1) * part // (2 * full) for full, part in zip((31, 53), rendered[::-1], strict=True)
    )
    for is_selected in ([True, False, True], [False, False, False], [True, True, True]):
        drawn = outline(display, visibility, np.array(is_selected)).to_numpy()[..., :3]
        selected = np.array([False, *is_selected])[blocks][rows[:, None], columns]
        assert np.array_equal(drawn, outlined(pixels[..., :3], selected))
    outline.close()
    device.give_back(display, visibility)
    assert device.memory == before

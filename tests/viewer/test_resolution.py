"""Sizes of pictures by the time that they take."""

from itertools import pairwise

from pica.viewer.resolution import Resolution, fitted

FULL = (640, 360)


def drag(resolution: Resolution, cost, frames: int = 30) -> list[float]:
    """The seconds of pictures in motion on a device where one of n pixels takes cost(n)."""
    took = []
    for _ in range(frames):
        resolution.move()
        width, height = resolution.size
        took.append(cost(width * height))
        resolution.measure(took[-1])
    return took


def test_a_slow_device_gets_small_pictures_in_time():
    resolution = Resolution(FULL)
    took = drag(resolution, lambda pixels: 0.02 + pixels * 5e-6)
    assert max(took) < 0.15 and took[-1] == took[-2] > 0.04
    assert resolution.size[0] < 320 and not resolution.is_full


def test_a_fast_device_gets_whole_pictures():
    resolution = Resolution(FULL)
    drag(resolution, lambda pixels: 0.002)
    assert resolution.size == FULL and resolution.is_full


def test_it_follows_a_scene_that_gets_dearer_and_cheaper():
    resolution = Resolution(FULL)
    drag(resolution, lambda pixels: pixels * 1e-7)
    dear = drag(resolution, lambda pixels: pixels * 4e-6)
    assert dear[0] > 0.5 and dear[1] < 0.15, "one late picture, not more"
    drag(resolution, lambda pixels: pixels * 1e-7)
    assert resolution.is_full


def test_the_first_picture_after_a_change_of_size_does_not_count():
    """It takes longer, so that sizes would go up and down."""
    resolution, sizes = Resolution(FULL), []
    for _ in range(30):
        begins = not sizes or resolution.size != sizes[-1]
        sizes.append(resolution.size)
        resolution.move()
        resolution.measure(0.3 if begins else 0.03, begins=begins)
    assert set(sizes[20:]) == {FULL}


def test_at_rest_pictures_grow_up_to_the_whole_one():
    resolution = Resolution(FULL)
    drag(resolution, lambda pixels: 0.02 + pixels * 5e-6)
    sizes = [resolution.size]
    while not resolution.is_full:
        resolution.rest()
        resolution.measure(9.0)  # says nothing of pictures in motion
        sizes.append(resolution.size)
    counts = [width * height for width, height in sizes]
    assert sizes[-1] == FULL and len(sizes) > 2
    assert all(before < after <= 4.2 * before for before, after in pairwise(counts))
    resolution.move()
    assert resolution.size == sizes[0]


def test_another_size_begins_small():
    resolution = Resolution(FULL)
    drag(resolution, lambda pixels: 0.002)
    resolution.full = (1280, 720)
    assert resolution.size == (80, 45)
    resolution.full = (40, 20)
    assert resolution.size == (40, 20), "it does not get any smaller"


def test_pictures_fit_the_page():
    assert fitted((640, 360), (1280, 720)) == (640, 360)
    assert fitted((1920, 1080), (640, 360)) == (640, 360)
    width, height = fitted((500, 2000), (640, 360))
    assert width * height <= 640 * 360 * 1.01 and height == 4 * width
    assert fitted((10**9, 1), (640, 360)) == (4096, 1)

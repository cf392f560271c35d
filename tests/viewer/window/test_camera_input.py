"""The mouse and the keys of the window, by events as the window sends them."""

from types import SimpleNamespace

import numpy as np
import pytest
import slangpy as spy

from pica.viewer.camera_control import CameraControl
from pica.viewer.window.camera_input import CameraInput
from tests.viewer.scenes import CAMERA, scene

SIZE = (640, 360)
LEFT, RIGHT = spy.MouseButton.left, spy.MouseButton.right


@pytest.fixture
def control():
    return CameraControl(scene(), 16 / 9, CAMERA)


def event(kind, at=(0, 0), button=spy.MouseButton.unknown, scroll=0.0):
    kinds = {f"is_{each}": (lambda each=each: each == kind) for each in ("move", "scroll", "button_down", "button_up")}
    x, y = at
    return SimpleNamespace(pos=SimpleNamespace(x=x, y=y), scroll=SimpleNamespace(x=0, y=scroll), button=button, **kinds)


def drag(control, button, to, at=(300, 100)):
    """The place of the click, if it is one."""
    mouse = CameraInput()
    assert mouse.mouse(event("button_down", at, button), SIZE, control) is None
    assert mouse.is_active
    assert mouse.mouse(event("move", to), SIZE, control) is None
    clicked = mouse.mouse(event("button_up", to, button), SIZE, control)
    assert not mouse.is_active
    return clicked


def test_the_left_button_orbits_and_the_scene_follows_the_mouse(control):
    distance, pivot = control.distance, control.pivot
    assert drag(control, LEFT, (390, 100)) is None, "no click"
    assert control.camera.transform[0, 3] < -1, "to the right: the camera goes to the left"
    assert control.distance == pytest.approx(distance) and np.allclose(control.pivot, pivot)
    height = control.camera.transform[1, 3]
    drag(control, LEFT, (300, 130))
    assert control.camera.transform[1, 3] > height + 0.2, "down: the camera goes up"


def test_the_right_button_moves_the_pivot_with_the_mouse(control):
    pivot, right = control.pivot, control.camera.transform[:3, 0]
    drag(control, RIGHT, (300 + 180, 100))
    moved = control.pivot - pivot
    assert moved @ right == pytest.approx(-0.5 * 2 * control.camera.half_height * control.distance)


def test_the_wheel_goes_closer(control):
    distance = control.distance
    CameraInput().mouse(event("scroll", scroll=1.0), SIZE, control)
    assert control.distance == pytest.approx(0.9 * distance)


def test_a_click_is_a_place_in_the_picture(control):
    before = control.camera
    assert drag(control, LEFT, (320, 90), at=(320, 90)) == (0.5, 0.25)
    assert drag(control, LEFT, (321, 91), at=(320, 90)) is not None, "a trembling hand"
    assert drag(control, RIGHT, (320, 90), at=(320, 90)) is None
    assert np.allclose(before.transform, control.camera.transform, atol=0.1)


def test_keys_fly_while_they_are_held(control):
    keys, eye, forward = CameraInput(), control.camera.transform[:3, 3], -control.camera.transform[:3, 2]
    keys.press(spy.KeyCode.w)
    keys.press(spy.KeyCode.f1)
    assert keys.is_active
    keys.fly(0.5, control)
    assert np.allclose(control.camera.transform[:3, 3], eye + 0.5 * control.distance * forward)
    keys.press(spy.KeyCode.s)
    keys.fly(0.5, control)
    assert np.allclose(control.camera.transform[:3, 3], eye + 0.5 * control.distance * forward), "both: neither"
    keys.release(spy.KeyCode.w)
    keys.release(spy.KeyCode.s)
    assert not keys.is_active

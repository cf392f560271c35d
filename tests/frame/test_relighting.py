"""Frames since lights have changed."""

from pica.frame.relighting import LONG, Relighting


def counts(changes):
    relighting = Relighting()
    return [relighting.count(changed, first=frame == 0) for frame, changed in enumerate(changes)]


def test_a_switched_lamp_is_counted_from_its_frame():
    assert counts([True, False, True, False, False]) == [LONG, LONG, 0, 1, 2]


def test_a_lamp_that_keeps_moving_is_no_single_change():
    assert counts([True, True, True, False, False]) == [LONG, LONG, LONG, 1, 2]

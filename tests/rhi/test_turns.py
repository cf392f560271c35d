"""The lock by which threads take turns at a device."""

import gc
import threading
import time
from itertools import pairwise

import pytest

from pica.rhi.turns import Turns


def in_threads(*calls):
    threads = [threading.Thread(target=call) for call in calls]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(30)
        assert not thread.is_alive()


def test_who_has_had_it_lets_the_others_go_first():
    turn, log, everybody = Turns(lambda: None), [], threading.Barrier(3)

    def work(name):
        everybody.wait()
        for _ in range(50):
            with turn:
                log.append(name)
                time.sleep(0.0005)

    in_threads(*(lambda name=name: work(name) for name in "abc"))
    alternating = log[3:120]  # until the first has done
    assert sum(a == b for a, b in pairwise(alternating)) < 12


def test_no_two_have_it_at_once():
    turn, inside, most = Turns(lambda: None), [], []

    def work():
        for _ in range(200):
            with turn, turn:  # whoever has it may take it again, even while another waits
                inside.append(1)
                most.append(len(inside))
                time.sleep(0)
                inside.pop()

    in_threads(work, work, work, work)
    assert max(most) == 1 and len(most) == 800


def test_what_comes_late_waits_for_the_end():
    turn, log = Turns(lambda: None), []
    turn.later(lambda: log.append("at once"))
    with turn:
        with turn:
            turn.later(lambda: log.append("later"))
        in_threads(lambda: turn.later(lambda: log.append("by another thread")))
        turn.tidy()
        log.append("end")
    assert log == ["at once", "end", "later", "by another thread"]


def test_what_comes_just_before_the_release_is_not_left():
    turn, log = Turns(lambda: None), []
    lock = turn._lock

    class Lock:
        acquire = staticmethod(lock.acquire)

        def release(self):
            if not log:
                log.append("released")
                in_threads(lambda: turn.later(lambda: log.append("later")))
            lock.release()

    turn._lock = Lock()
    with turn:
        pass
    assert log == ["released", "later"]


def test_nothing_that_comes_late_is_left():
    turn, done = Turns(lambda: None), []

    def hold():
        for _ in range(3000):
            with turn:
                pass

    def drop():
        for number in range(3000):
            turn.later(lambda number=number: done.append(number))

    in_threads(hold, drop, drop)
    assert len(done) == 6000


def test_an_error_gives_it_back():
    turn = Turns(lambda: None)
    with pytest.raises(ZeroDivisionError), turn:
        raise ZeroDivisionError
    in_threads(lambda: turn.__enter__())


def test_a_check_that_fails_leaves_it_to_others():
    faults = [ValueError()]

    def check():
        if faults:
            raise faults[0]

    turn = Turns(check)
    with pytest.raises(ValueError), turn:
        pytest.fail("nobody has it")
    faults.clear()

    def work():
        with turn:
            pass

    in_threads(work)


def test_it_is_cheap():
    turn = Turns(lambda: None)
    gc.disable()
    try:
        best = min(_seconds(turn) for _ in range(20))
    finally:
        gc.enable()
    assert best < 10e-6


def _seconds(turn):
    started = time.perf_counter()
    for _ in range(200):
        with turn:
            pass
    return (time.perf_counter() - started) / 200

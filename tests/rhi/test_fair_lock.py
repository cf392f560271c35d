"""The lock of a device, which threads get in the order of their requests."""

import gc
import threading
import time

import pytest

from pica.rhi.fair_lock import FairLock


def in_threads(*calls):
    threads = [threading.Thread(target=call) for call in calls]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(30)
        assert not thread.is_alive()


def test_who_has_had_it_lets_the_others_go_first():
    lock, log, everybody = FairLock(lambda: None), [], threading.Barrier(3)

    def work(name):
        everybody.wait()
        for _ in range(50):
            log.append((name, "asks"))
            with lock:
                log.append((name, "has it"))
                time.sleep(0.0005)

    in_threads(*(lambda name=name: work(name) for name in "abc"))
    waiting, before, again = [], "", 0
    for name, what in log:
        if what == "asks":
            waiting.append(name)
        else:
            again += name == before and waiting[0] != name
            before = name
            waiting.remove(name)
    assert again < 12  # a thread may be stopped between its note and its request


def test_no_two_have_it_at_once():
    lock, inside, most = FairLock(lambda: None), [], []

    def work():
        for _ in range(200):
            with lock, lock:  # whoever has it may take it again, even while another waits
                inside.append(1)
                most.append(len(inside))
                time.sleep(0)
                inside.pop()

    in_threads(work, work, work, work)
    assert max(most) == 1 and len(most) == 800


def test_what_comes_late_waits_for_the_end():
    lock, log = FairLock(lambda: None), []
    lock.defer(lambda: log.append("at once"))
    with lock:
        with lock:
            lock.defer(lambda: log.append("later"))
        in_threads(lambda: lock.defer(lambda: log.append("by another thread")))
        lock.run_deferred()
        log.append("end")
    assert log == ["at once", "end", "later", "by another thread"]


def test_what_comes_just_before_the_release_is_not_left():
    lock, log = FairLock(lambda: None), []
    inner = lock._lock

    class Lock:
        acquire = staticmethod(inner.acquire)

        def release(self):
            if not log:
                log.append("released")
                in_threads(lambda: lock.defer(lambda: log.append("later")))
            inner.release()

    lock._lock = Lock()
    with lock:
        pass
    assert log == ["released", "later"]


def test_nothing_that_comes_late_is_left():
    lock, done = FairLock(lambda: None), []

    def hold():
        for _ in range(3000):
            with lock:
                pass

    def drop():
        for number in range(3000):
            lock.defer(lambda number=number: done.append(number))

    in_threads(hold, drop, drop)
    assert len(done) == 6000


def test_an_error_gives_it_back():
    lock = FairLock(lambda: None)
    with pytest.raises(ZeroDivisionError), lock:
        raise ZeroDivisionError
    in_threads(lambda: lock.__enter__())


def test_a_check_that_fails_leaves_it_to_others():
    faults = [ValueError()]

    def check():
        if faults:
            raise faults[0]

    lock = FairLock(check)
    with pytest.raises(ValueError), lock:
        pytest.fail("nobody has it")
    faults.clear()

    def work():
        with lock:
            pass

    in_threads(work)


def test_it_is_cheap():
    lock = FairLock(lambda: None)
    gc.disable()
    try:
        best = min(_seconds(lock) for _ in range(20))
    finally:
        gc.enable()
    assert best < 10e-6


def _seconds(lock):
    started = time.perf_counter()
    for _ in range(200):
        with lock:
            pass
    return (time.perf_counter() - started) / 200

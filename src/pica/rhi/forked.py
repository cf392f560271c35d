"""Guards a process forked from one with a device: it has the device, but not its threads."""

import atexit
import ctypes
import os
import sys
from typing import Any, cast

from pica.errors import DeviceError

_SLANGPY = "slangpy.slangpy_ext"
_watching = _forked = False


def watch() -> None:
    """This process has a device from now on."""
    global _watching
    if not _watching and hasattr(os, "register_at_fork"):
        _watching = True
        os.register_at_fork(after_in_child=_leave_alone)


def check() -> None:
    """Raises DeviceError in a process that was forked from one with a device: to wait for it would be for ever."""
    if _forked:
        raise DeviceError(
            "this process was forked from one that had a graphics device open, and cannot use any: start it by 'spawn' "
            "(multiprocessing.get_context('spawn')), or fork before a device is opened"
        )


def is_child() -> bool:
    """Whether `check` raises."""
    return _forked


def _leave_alone() -> None:
    global _forked
    _forked = True
    # At exit SlangPy closes its devices, and would wait for the parent's threads. So its handler is unregistered, and
    # its module, which closes them once more when it is freed, is kept alive.
    atexit.unregister(cast(Any, _SlangPysOwn()))
    if _SLANGPY in sys.modules:
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(sys.modules[_SLANGPY]))
    # Drivers' exit handlers wait for their threads, even for those that were busy and do not exist here. Handlers
    # run in reverse order of registration, so this one exits before any of them.
    libc = ctypes.CDLL(None)
    if hasattr(libc, "on_exit"):
        libc.on_exit(libc._exit, None)


class _SlangPysOwn:
    """Equal to the object that SlangPy has registered."""

    def __eq__(self, other: object) -> bool:
        return type(other).__name__ == "nb_func"

    __hash__ = None  # type: ignore[assignment]

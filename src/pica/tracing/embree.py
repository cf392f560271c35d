"""Embree's C interface (Intel Embree 4 API reference), from the shared library that the embreex wheel carries.

embreex's own Python interface traces on one core, holds the interpreter's lock and supports neither moving instances
nor masks; docs/measurements/tiers.md has the figures. Only its libraries are used here.
"""

import ctypes
import importlib.util
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from pica.errors import DeviceError

INSTALL = "install it with `pip install embreex llvmlite`"
# enum values of rtcore_common.h, rtcore_buffer.h, rtcore_geometry.h and rtcore_scene.h
INDEX_BUFFER, VERTEX_BUFFER = 0, 1
UINT3, FLOAT3, ROWS_3X4 = 0x5003, 0x9003, 0x9134
TRIANGLES, INSTANCE = 0, 121
LOW_QUALITY, MEDIUM_QUALITY, HIGH_QUALITY, REFIT_QUALITY = 0, 1, 2, 3
DYNAMIC_SCENE = 1
_MASKS, _FILTERS = 64, 66

_POINTER, _UINT, _SIZE, _INT = ctypes.c_void_p, ctypes.c_uint, ctypes.c_size_t, ctypes.c_int
_FUNCTIONS: dict[str, tuple[Any, list[Any]]] = {
    "rtcNewDevice": (_POINTER, [ctypes.c_char_p]),
    "rtcReleaseDevice": (None, [_POINTER]),
    "rtcGetDeviceError": (_INT, [_POINTER]),
    "rtcGetDeviceProperty": (ctypes.c_ssize_t, [_POINTER, _INT]),
    "rtcNewScene": (_POINTER, [_POINTER]),
    "rtcReleaseScene": (None, [_POINTER]),
    "rtcSetSceneFlags": (None, [_POINTER, _INT]),
    "rtcSetSceneBuildQuality": (None, [_POINTER, _INT]),
    "rtcCommitScene": (None, [_POINTER]),
    "rtcNewGeometry": (_POINTER, [_POINTER, _INT]),
    "rtcReleaseGeometry": (None, [_POINTER]),
    "rtcAttachGeometryByID": (None, [_POINTER, _POINTER, _UINT]),
    "rtcDetachGeometry": (None, [_POINTER, _UINT]),
    "rtcCommitGeometry": (None, [_POINTER]),
    "rtcSetGeometryBuildQuality": (None, [_POINTER, _INT]),
    "rtcSetGeometryMask": (None, [_POINTER, _UINT]),
    "rtcSetGeometryEnableFilterFunctionFromArguments": (None, [_POINTER, ctypes.c_bool]),
    "rtcSetGeometryInstancedScene": (None, [_POINTER, _POINTER]),
    "rtcSetGeometryTransform": (None, [_POINTER, _UINT, _INT, _POINTER]),
    "rtcSetSharedGeometryBuffer": (None, [_POINTER, _INT, _UINT, _INT, _POINTER, _SIZE, _SIZE, _SIZE]),
    "rtcIntersect16": (None, [_POINTER] * 4),
    "rtcOccluded16": (None, [_POINTER] * 4),
}


class Library:
    """Embree's functions as attributes, without their rtc prefix: `library.NewScene(device)`."""

    def __init__(self, folder: Path) -> None:
        # Embree finds its task scheduler among the libraries that are loaded already.
        self._scheduler = ctypes.CDLL(str(next(folder.glob("libtbb*"))), mode=ctypes.RTLD_GLOBAL)
        self._embree = ctypes.CDLL(str(next(folder.glob("libembree4*"))))
        for name, (result, arguments) in _FUNCTIONS.items():
            function = getattr(self._embree, name)
            function.restype, function.argtypes = result, arguments
            setattr(self, name.removeprefix("rtc"), function)

    def __getattr__(self, name: str) -> Callable[..., Any]:
        raise AttributeError(f"Embree function rtc{name} is not declared")

    def address(self, name: str) -> int:
        """Where in memory a function lies, for compiled code to call it."""
        return int(ctypes.cast(getattr(self, name), ctypes.c_void_p).value or 0)


def _libraries() -> Path | None:
    """The folder with the shared libraries of an installed embreex, or None."""
    spec = importlib.util.find_spec("embreex")
    if spec is None or spec.origin is None:
        return None
    package = Path(spec.origin).parent
    for folder in (package.parent / "embreex.libs", package / ".dylibs", package):
        if any(folder.glob("libembree4*")) and any(folder.glob("libtbb*")):
            return folder
    return None


def missing() -> str | None:
    """Why Embree cannot be used, in words; None if it can."""
    if importlib.util.find_spec("llvmlite") is None:
        return f"the package llvmlite is not installed; {INSTALL}"
    if _libraries() is None:
        return f"the package embreex is not installed or carries no Embree 4; {INSTALL}"
    return None


@cache
def library() -> Library:
    """The loaded library. Raises DeviceError when it is not installed."""
    folder = _libraries()
    if folder is None:
        raise DeviceError(f"Embree: {missing()}")
    return Library(folder)


@cache
def embree_device() -> int:
    """Embree's own device, one per process. Raises DeviceError if the library lacks required features."""
    embree = library()
    device = embree.NewDevice(b"")
    if not device:
        raise DeviceError(f"Embree does not start, error {embree.GetDeviceError(None)}")
    if not (embree.GetDeviceProperty(device, _MASKS) and embree.GetDeviceProperty(device, _FILTERS)):
        raise DeviceError(f"Embree was built without ray masks or filter functions; {INSTALL}")
    return int(device)


def check() -> None:
    """Raises DeviceError when a call since the last check failed."""
    error = library().GetDeviceError(embree_device())
    if error:
        raise DeviceError(f"Embree reports error {error}")

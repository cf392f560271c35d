"""The errors that pica raises on purpose: one line with the fault, its place and a remedy."""

import reprlib
from typing import Any

from pica.text import one_line


class PicaError(Exception):
    """Base of every error below; the command line prints its one line and exits with code 2.

    Quoted values may be anything: the message stays one line, of a bounded length, and safe to print.
    """

    def __init__(self, message: str = "") -> None:
        super().__init__(one_line(message))


class SceneError(PicaError):
    """A scene, or a file that it needs, cannot be used. Names the file or the field and the fault."""


class DeviceError(PicaError):
    """No usable graphics device, or the device lacks a required feature."""


class MaterialTypeError(PicaError):
    """A material type that cannot be used, or parameters that do not fit it. Names the type, the file and the fault."""


class ShapeError(PicaError):
    """A shape that cannot be used, or parameters that do not fit it. Names the shape, the file and the fault."""


class SettingsError(PicaError, ValueError):
    """A setting that does not exist or is out of range. Names the setting, the value and the range."""


class BindingError(PicaError):
    """A shader resource that was left unbound, or a name that the shader does not have."""


class ShaderError(PicaError):
    """A Slang file of the user's that does not compile. Names the file, the line and the fault."""


class GraphError(PicaError):
    """A frame graph that cannot run: a read that no pass writes, two writers, a cycle. Names passes and lines."""


_LONGEST = 60
"""Characters of a user's value that a message shows."""


class _Short(reprlib.Repr):
    """Limits the repr of a value to the length of a message."""

    def __init__(self) -> None:
        super().__init__()
        self.maxstring = self.maxother = self.maxlong = 2 * _LONGEST

    def repr1(self, x: Any, level: int) -> str:
        value = plain(x)
        return str(value) if getattr(value, "shape", None) == () else super().repr1(value, level)

    def repr_instance(self, x: Any, level: int) -> str:
        kind = type(x)
        is_plain = kind.__module__ in ("builtins", "numpy", "pathlib")
        return super().repr_instance(x, level) if is_plain else f"a {kind.__name__}"


_SHORT = _Short()


def shown(value: Any) -> str:
    """A user's value as a message of one line shows it; NumPy's scalars are plain numbers there."""
    try:
        text = " ".join(_SHORT.repr(value).split())
    except Exception:  # the value's own, or an integer of too many digits
        text = f"a value of type {type(value).__name__}"
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."


def plain(value: Any) -> Any:
    """A Python value of a scalar of NumPy or alike; any other as it is."""
    return value.item() if getattr(value, "shape", None) == () and hasattr(value, "item") else value

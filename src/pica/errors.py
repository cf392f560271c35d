"""The errors that pica raises on purpose: one line that says what, where and what to do."""

from pica.text import one_line


class PicaError(Exception):
    """Base of every error below; the command line prints its one line and exits with code 2.

    What the line quotes may hold anything: it stays one line, of a bounded length, and safe to print.
    """

    def __init__(self, message: str = "") -> None:
        super().__init__(one_line(message))


class SceneError(PicaError):
    """A scene, or a file that it needs, cannot be used. Names the file and the fault."""


class DeviceError(PicaError):
    """No usable graphics device, or the device lacks something that was asked for."""


class MaterialTypeError(PicaError):
    """A material type that cannot be used, or parameters that do not fit it. Names the type, the file and the fault."""


class ShapeError(PicaError):
    """A shape that cannot be used, or parameters that do not fit it. Names the shape, the file and the fault."""


class SettingsError(PicaError, ValueError):
    """A setting that does not exist or is out of range. Names the setting, the value and the range."""


class BindingError(PicaError):
    """A shader resource that was left unbound, or a name that the shader does not have."""

"""What has memory on a device until it is closed, and who may use it when."""

from collections.abc import Callable
from functools import wraps
from threading import RLock
from types import TracebackType
from typing import Concatenate, ParamSpec, Self, TypeVar, cast

from pica.errors import PicaError, shown
from pica.frame.context import Size
from pica.gpu_scene.view import SceneView
from pica.rhi import forked
from pica.rhi.device import Device
from pica.scene.model import Scene
from pica.settings import Settings

_KEPT = {"size", "settings", "device", "scene", "_calls", "_black_pictures"}
"""Attributes that a closed renderer keeps: those of its repr, and what a frame still needs that `progress` closes."""
P = ParamSpec("P")
C = TypeVar("C", bound="Closing")
T = TypeVar("T")


class Closing:
    """A renderer or a path tracer, which may be used in a `with` statement, and by one thread at a time.

    Without either, what it has on its device goes when it is dropped itself.
    """

    view: SceneView
    """What it has of the scene."""
    scene: Scene
    size: Size
    settings: Settings

    def __init__(self, device: Device) -> None:
        self.device = device
        self._calls = RLock()

    def close(self) -> None:
        """Give back at once what it has on its device. Pictures that it has rendered stay; it renders no others."""
        if self.closed:
            return
        forked.check()
        with self._calls:
            if not self.device.closed:
                with self.device.turn:
                    self.view.close()
            for name in vars(self).keys() - _KEPT:
                delattr(self, name)

    @property
    def closed(self) -> bool:
        """Whether it was closed."""
        return "view" not in vars(self)

    def check_open(self) -> None:
        """Raises PicaError when it is closed."""
        if self.closed:
            raise PicaError(f"{type(self).__name__}: it is closed; make another one")

    def __repr__(self) -> str:
        width, height = self.size
        where = f"scene {shown(self.scene.name)}, {width}x{height} on {self.device.name}"
        state = "closed" if self.closed else self.settings.summary()
        return f"<pica.{type(self).__name__} of {where}: {state}>"

    def __enter__(self) -> Self:
        self.check_open()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def alone(method: Callable[Concatenate[C, P], T]) -> Callable[Concatenate[C, P], T]:
    """Makes a method of Closing one that threads run one after the other; it takes its turns at the device by itself.

    Raises PicaError when the object is closed, DeviceError in a process that was forked since.
    """

    @wraps(method)
    def waiting(self: C, *arguments: P.args, **named: P.kwargs) -> T:
        forked.check()  # before a lock that another thread of the parent may have had
        with self._calls:
            self.check_open()
            return method(self, *arguments, **named)

    return cast(Callable[Concatenate[C, P], T], waiting)

"""Lifecycle and locking of objects with memory on a device."""

from collections.abc import Callable
from functools import wraps
from threading import RLock
from types import TracebackType
from typing import Any, Concatenate, Generic, ParamSpec, Self, TypeVar, cast, overload

from pica.errors import PicaError, shown
from pica.frame.context import Size
from pica.gpu_scene.view import SceneView
from pica.rhi import forked
from pica.rhi.device import Device
from pica.scene.model import Scene
from pica.settings import Settings

_KEPT = {"_size", "_settings", "_device", "_scene", "_calls", "_black_pictures", "_makes_batches", "_others"}
"""Attributes that a closed renderer keeps: for its repr, and for a frame whose `progress` callback closes it."""
P = ParamSpec("P")
C = TypeVar("C", bound="Closing")
T = TypeVar("T")


class Given(Generic[T]):
    """A field that only its owner sets, under its name with a line in front."""

    def __init__(self, instead: str) -> None:
        """`instead`: the advice of the error message."""
        self._instead = instead

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, instance: None, owner: type) -> Self: ...

    @overload
    def __get__(self, instance: object, owner: type) -> T: ...

    def __get__(self, instance: object | None, owner: type) -> Any:
        return self if instance is None else vars(instance)[f"_{self._name}"]

    def __set__(self, instance: object, value: Any) -> None:
        raise PicaError(f"{type(instance).__name__}.{self._name} cannot be assigned; {self._instead}")


class Closing:
    """A renderer or a path tracer, which may be used in a `with` statement, and by one thread at a time.

    Without `close` or `with`, its device memory is released when it is dropped.
    """

    view: SceneView
    """Its data of the scene."""
    scene = Given[Scene]("make another renderer for another scene")
    """The rendered scene."""
    size = Given[Size]("Renderer.resize takes another one")
    """(width, height) in pixels."""
    settings = Given[Settings]("Renderer.configure takes others")
    """As they run on the device."""
    device = Given[Device]("make another renderer on another device")
    """The device that renders."""

    def __init__(self, device: Device, scene: Scene, size: Size) -> None:
        self._device, self._scene, self._size = device, scene, size
        self._calls = RLock()

    def close(self) -> None:
        """Release its device memory now. Its pictures stay valid; it renders no others."""
        if self.closed:
            return
        forked.check()
        with self._calls:
            if not self.device.closed:
                with self.device.lock:
                    self._release()
            for name in vars(self).keys() - _KEPT:
                delattr(self, name)

    def _release(self) -> None:
        """Free its data of the scene."""
        self.view.close()

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


def synchronized(method: Callable[Concatenate[C, P], T]) -> Callable[Concatenate[C, P], T]:
    """Serializes the calls of a method of Closing among threads. The method acquires the device's lock by itself.

    Raises PicaError if the object is closed, DeviceError in a process that was forked since.
    """

    @wraps(method)
    def waiting(self: C, *arguments: P.args, **named: P.kwargs) -> T:
        forked.check()  # before a lock that another thread of the parent may have had
        with self._calls:
            self.check_open()
            return method(self, *arguments, **named)

    return cast(Callable[Concatenate[C, P], T], waiting)

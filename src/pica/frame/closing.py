"""What has memory on a device until it is closed."""

from types import TracebackType
from typing import Self

from pica.errors import PicaError
from pica.gpu_scene.view import SceneView

_KEPT = {"size", "settings", "device", "scene"}


class Closing:
    """A renderer or a path tracer, which may be used in a `with` statement.

    Without either, what it has on its device goes when it is dropped itself.
    """

    view: SceneView
    """What it has of the scene."""

    def close(self) -> None:
        """Give back at once what it has on its device. Pictures that it has rendered stay; it renders no others."""
        if self.closed:
            return
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

    def __enter__(self) -> Self:
        self.check_open()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

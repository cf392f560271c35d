"""Objects with immutable public attributes."""

import functools
from typing import Any

from pica.errors import SceneError
from pica.names import unknown
from pica.scene.checked_field import described, read_only


class Fixed:
    """Rejects reassignment of public attributes, which subscribers would not notice, and of attributes that
    its class's own `__init__` has not set. Assigned arrays become read-only."""

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if "__init__" in vars(cls):
            cls.__init__ = _completing(cls, cls.__init__)  # type: ignore[method-assign]

    def __setattr__(self, name: str, value: Any) -> None:
        public = not name.startswith("_")
        if public and name in vars(self):
            raise SceneError(f"{described(self)}: {name}: stays as it was made; make another one")
        if public and "_complete" in vars(self) and not hasattr(type(self), name):
            properties = [
                attribute for attribute in dir(type(self)) if isinstance(getattr(type(self), attribute), property)
            ]
            raise SceneError(f"{described(self)}: {unknown(name, [*vars(self), *properties])}")
        super().__setattr__(name, read_only(value) if public else value)

    def _renew(self, **values: Any) -> None:
        """Set public attributes again, from a method that informs subscribers."""
        vars(self).update({name: read_only(value) for name, value in values.items()})


def _completing(cls: type, construct: Any) -> Any:
    """The `__init__` of a class, after which its objects have all of their attributes."""

    @functools.wraps(construct)
    def complete(self: Fixed, *values: Any, **named: Any) -> None:
        construct(self, *values, **named)
        if type(self) is cls:
            vars(self)["_complete"] = True

    return complete

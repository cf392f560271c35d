"""Fields that inform a scene's subscribers when they are set."""

from typing import Any, Protocol, TypeVar

from pica.scene.checked_field import CheckedField

_Value = TypeVar("_Value")


class Holder(Protocol):
    """An object with such fields."""

    def _written(self, field: str, before: Any) -> None:
        """A field that had the value `before` has been set. Also called in construction, with None."""


class TrackedField(CheckedField[_Value]):
    """A field whose owner informs subscribers when it is set."""

    def __set__(self, holder: Holder, value: _Value) -> None:  # type: ignore[override]
        before = holder.__dict__.get(self._name)
        super().__set__(holder, value)
        holder._written(self._name, before)

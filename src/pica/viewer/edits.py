"""Changes of the scene by hand, which can be undone."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from pica.errors import PicaError

Change = tuple[Any, str, Any]
"""An object of the scene, the name of its field, and the value to assign."""
_SAME_DRAG = 1.0
"""Seconds within which changes of the same fields, as of a slider, are one step."""
_MOST = 1000
"""Steps that are kept: each holds what was replaced, such as an environment."""


@dataclass
class _Step:
    before: list[Change]
    after: list[Change]
    at: float
    """Seconds, of its newest change."""

    @property
    def fields(self) -> list[tuple[int, str]]:
        return [(id(target), name) for target, name, _ in self.after]


class Edits:
    """Assigns to fields of a scene's objects, and remembers what was there before."""

    def __init__(self) -> None:
        self._done: list[_Step] = []
        self._undone: list[_Step] = []

    @property
    def can_undo(self) -> bool:
        """Whether there is a step to undo."""
        return bool(self._done)

    @property
    def can_redo(self) -> bool:
        """Whether there is an undone step."""
        return bool(self._undone)

    def apply(self, changes: Sequence[Change], now: float | None = None) -> None:
        """Assign all of them, in one step; if one is refused, none, and its PicaError is raised. `now`: seconds of any
        clock, None for that of the system."""
        if not changes:
            return
        before: list[Change] = []
        try:
            for target, name, value in changes:
                before.append((target, name, getattr(target, name)))
                setattr(target, name, value)
        except PicaError:
            _assign(reversed(before[:-1]))
            raise
        step = _Step(before, list(changes), time.monotonic() if now is None else now)
        last = self._done[-1] if self._done and not self._undone else None
        if last is not None and last.fields == step.fields and step.at - last.at <= _SAME_DRAG:
            last.after, last.at = step.after, step.at
        else:
            self._done = [*self._done[1 - _MOST :], step]
        self._undone = []

    def undo(self) -> None:
        """Assign what was there before the newest step. Does nothing without one."""
        if self._done:
            step = self._done.pop()
            _assign(reversed(step.before))
            self._undone.append(step)

    def redo(self) -> None:
        """Do the step again that was undone last. Does nothing without one."""
        if self._undone:
            step = self._undone.pop()
            _assign(step.after)
            self._done.append(step)


def _assign(changes: Any) -> None:
    for target, name, value in changes:
        setattr(target, name, value)

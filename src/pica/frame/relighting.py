"""When emitters have last changed, for all that remembers light."""

LONG = 1 << 30
"""Frames: more than any threshold."""


class Relighting:
    """Counts frames since emitters have changed."""

    def __init__(self) -> None:
        self._since, self._changes = LONG, False

    def count(self, changed: bool, first: bool) -> int:
        """Frames since the last change: 0 if emitters have `changed` in this frame. LONG while each frame has a change,
        as a lamp that moves, since light is then equally uncertain in all of them; and from the `first` frame on."""
        goes_on = changed and self._changes
        self._changes = changed
        self._since = LONG if first else 0 if changed else min(self._since + 1, LONG)
        return LONG if goes_on else self._since

"""Inputs of the panel: they show values of the viewer, and clients change them."""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import viser


class Input:
    """An input of viser's and the value of the viewer that it shows."""

    def __init__(self, handle: Any, changed: Callable[[Any], object]) -> None:
        """`changed`: called in viser's event loop with each value that a client sets."""
        self.handle = handle
        self._shown: Any = handle.value

        def one_for_all(_: int, value: Any) -> None:
            changed(value)

        self._listen(one_for_all)

    def _listen(self, changed: Callable[[int, Any], object]) -> None:
        """Call this with each value that a client sets, and the client's number."""

        async def on_update(event: "viser.GuiEvent[Any]") -> None:
            if event.client is not None and self._accepts(event.target.value):  # else `show` has set it
                changed(event.client.client_id, event.target.value)

        self.handle.on_update(on_update)

    def _accepts(self, value: Any) -> bool:
        """Whether a client may set this: viser checks neither options nor lengths, nor whether numbers are finite."""
        if isinstance(value, float) and not math.isfinite(value):
            return False
        options = getattr(self.handle, "options", None)
        if options is not None:
            return value in options
        return not isinstance(value, tuple) or len(value) == len(self._shown)

    def show(self, value: Any, again: bool = False) -> None:
        """Show a value of the viewer, if it is another than before: what a client has set meanwhile is still on its
        way to the viewer. `again`: in any case, because the viewer has refused what a client has set."""
        if again or value != self._shown:
            self._shown = self.handle.value = value


class ClientInput(Input):
    """An input of what each client has of its own. It shows that of the client that was used last."""

    def __init__(self, handle: Any, changed: Callable[[int, Any], object]) -> None:
        """`changed`: as Input's, with the client's number first."""
        self.handle = handle
        self._shown = handle.value
        self._listen(changed)

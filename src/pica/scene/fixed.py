"""Objects whose public attributes stay as they were made."""

from typing import Any

from pica.errors import SceneError
from pica.scene.checked_field import described, read_only


class Fixed:
    """Refuses to have a public attribute assigned again, which nobody who shows the object would hear of. Arrays that
    are assigned become read-only views."""

    def __setattr__(self, name: str, value: Any) -> None:
        public = not name.startswith("_")
        if public and name in vars(self):
            raise SceneError(f"{described(self)}: {name}: stays as it was made; make another one")
        super().__setattr__(name, read_only(value) if public else value)

    def _renew(self, **values: Any) -> None:
        """Set public attributes again, from a method that tells who shows the object."""
        vars(self).update({name: read_only(value) for name, value in values.items()})

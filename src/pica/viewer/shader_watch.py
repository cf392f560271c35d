"""Notices changes of the Slang files that programs are made of: pica's, and those of registered types and shapes."""

import os
import time
from itertools import chain

from pica.rhi.slang_sessions import PACKAGE
from pica.scene.shape_registry import registered_sources

_EVERY = 0.5
"""Seconds between two looks at the files, which take a millisecond."""


class ShaderWatch:
    """What has happened to the files since it was asked last. A file counts from the change of another one on."""

    def __init__(self) -> None:
        self._files = _files()
        self._ages = [_age(file) for file in self._files]
        self._looked_at = time.perf_counter()

    def take(self) -> bool:
        """Whether any has changed since the last call; looks only twice a second."""
        now = time.perf_counter()
        if now - self._looked_at < _EVERY:
            return False
        self._looked_at = now
        if self._ages == [_age(file) for file in self._files]:
            return False
        self._files = list(dict.fromkeys([*self._files, *_files()]))  # an editor may remove one to write it anew
        self._ages = [_age(file) for file in self._files]
        return True


def _files() -> list[str]:
    """All Slang files of the package, and those in the folders of registered sources, which may import them."""
    folders = dict.fromkeys(source.path.parent for source in registered_sources())
    found = chain(PACKAGE.rglob("*.slang"), *(folder.glob("*.slang") for folder in folders))
    return [str(file) for file in found]


def _age(file: str) -> int:
    """When it was written; 0: it is gone."""
    try:
        return os.stat(file).st_mtime_ns
    except OSError:
        return 0

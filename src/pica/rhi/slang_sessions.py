"""Slang sessions: what they compile with, and where they look for files."""

from pathlib import Path
from typing import Any

import slangpy as spy

from pica.caches.places import MODULES

PACKAGE = Path(__file__).resolve().parents[1]
COMPILER: Any = {"include_paths": [PACKAGE], "warnings_as_errors": []}
_FILLED_LATER = "41017"
"""Slang's warning of a static variable that nothing has initialized."""


def new_session(handle: spy.Device, cache: Path | None, package: Path = PACKAGE) -> spy.SlangSession:
    """A session that has loaded nothing yet: each keeps what it has loaded, whatever becomes of the files.

    `package`: the folder of its files; those of other folders than the package's own have rows of arguments
    (many_views/), and fill their static variables from them.
    """
    options = COMPILER
    if package != PACKAGE:
        options = {**COMPILER, "include_paths": [package], "disable_warnings": [_FILLED_LATER]}
    return handle.create_slang_session(compiler_options=options, cache_path=cache and cache / MODULES)

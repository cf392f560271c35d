"""OpenUSD files (https://openusd.org): .usd, .usda, .usdc and .usdz, by usd-core; modules are named as glTF's."""

import re
from importlib import import_module
from pathlib import Path

from pica.scene.conversion.conversion import Conversion


def import_libraries(path: Path) -> None:
    """Import what reads the file, which takes longer than reading it."""
    import_module("pica.scene.usd.nodes")


def convert(conversion: Conversion) -> None:
    """Add the stage's content. Raises SceneError, or whatever the library does."""
    from pica.scene.usd.nodes import add_stage  # which imports the library

    add_stage(conversion)


def described(error: Exception) -> str:
    """An error of the library, whose messages have places in its own source, in one line."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    said = re.sub(r"^Error in '.*?' at line \d+ in file \S+ : '", "", lines[0]) if lines else ""
    said = re.sub(r" matching pxrInternal\S+|pxrInternal\w+::|\w*Error: ", "", said)
    return said.rstrip("'") or type(error).__name__

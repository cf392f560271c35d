"""Which parameter blocks a shader has, read from its text: known before anything is compiled."""

import re
from functools import cache
from pathlib import Path

from pica.rhi.slang_files import Source

_ROOT = Path(__file__).resolve().parents[1]
_IMPORT = re.compile(r"^[ \t]*(?:__exported[ \t]+)?import[ \t]+([\w.]+)[ \t]*;", re.MULTILINE)
_BLOCK = re.compile(r"^[ \t]*(?:public[ \t]+)?ParameterBlock<\w+>[ \t]+(\w+)[ \t]*;", re.MULTILINE)


@cache
def blocks_of(*sources: Source) -> frozenset[str]:
    """Names of the parameter blocks that these files declare, or that files which they import do."""
    blocks: set[str] = set()
    waiting: list[Path] = []
    for source in sources:
        if isinstance(source, str):
            waiting.append(_ROOT / source)
        else:
            declared, imports = _parsed(source.text, source.path.parent)
            blocks |= declared
            waiting += imports
    seen: set[Path] = set()
    while waiting:
        path = waiting.pop()
        if path not in seen:
            seen.add(path)
            declared, imports = _read(path)
            blocks |= declared
            waiting += imports
    return frozenset(blocks)


@cache
def _read(path: Path) -> tuple[frozenset[str], tuple[Path, ...]]:
    """What a file declares, and what it imports; nothing of a module that is no file."""
    return _parsed(path.read_text(encoding="utf-8") if path.is_file() else "", path.parent)


def _parsed(text: str, folder: Path) -> tuple[frozenset[str], tuple[Path, ...]]:
    return frozenset(_BLOCK.findall(text)), tuple(_imported(name, folder) for name in _IMPORT.findall(text))


def _imported(name: str, folder: Path) -> Path:
    """As Slang looks for it: beside the file that imports it, else below the package."""
    relative = f"{name.replace('.', '/')}.slang"
    beside = folder / relative
    return beside if not folder.is_relative_to(_ROOT) and beside.is_file() else _ROOT / relative

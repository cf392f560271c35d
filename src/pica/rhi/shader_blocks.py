"""Which parameter blocks a shader has, read from its text: known before anything is compiled."""

import re
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from pica.rhi.slang_files import Source, digest

_ROOT = Path(__file__).resolve().parents[1]
_IMPORT = re.compile(r"^[ \t]*(?:(?:__exported[ \t]+)?import|__include)[ \t]+([\w.]+)[ \t]*;", re.MULTILINE)
_BLOCK = re.compile(r"^[ \t]*(?:public[ \t]+)?ParameterBlock<\w+>[ \t]+(\w+)[ \t]*;", re.MULTILINE)


@cache
def blocks_of(*sources: Source) -> frozenset[str]:
    """Names of the parameter blocks that these files declare, or that files which they import do."""
    blocks: set[str] = set()
    files: list[Path] = []
    for source in sources:
        if isinstance(source, str):
            files.append(_ROOT / source)
        else:
            declared, imports = _parsed(source.text, source.path.parent)
            blocks |= declared
            files += imports
    return frozenset(blocks).union(*(_read(path)[0] for path in _with_imports(files)))


@cache
def content_of(module: str) -> str:
    """A digest of a file below the package and of all that it imports."""
    return digest("".join(_text(path) for path in sorted(_with_imports([_ROOT / module]))))


def forget_files() -> None:
    """Read all files again, as they may have changed."""
    for function in (blocks_of, content_of, _read):
        function.cache_clear()


def _with_imports(files: Iterable[Path]) -> set[Path]:
    waiting, seen = list(files), set[Path]()
    while waiting:
        path = waiting.pop()
        if path not in seen:
            seen.add(path)
            waiting += _read(path)[1]
    return seen


@cache
def _read(path: Path) -> tuple[frozenset[str], tuple[Path, ...]]:
    """What a file declares, and what it imports."""
    return _parsed(_text(path), path.parent)


def _text(path: Path) -> str:
    """Nothing of a module that is no file."""
    return path.read_text(encoding="utf-8") if path.is_file() else ""


def _parsed(text: str, folder: Path) -> tuple[frozenset[str], tuple[Path, ...]]:
    return frozenset(_BLOCK.findall(text)), tuple(_imported(name, folder) for name in _IMPORT.findall(text))


def _imported(name: str, folder: Path) -> Path:
    """As Slang looks for it: beside the file that imports it, else below the package."""
    relative = f"{name.replace('.', '/')}.slang"
    beside = folder / relative
    return beside if not folder.is_relative_to(_ROOT) and beside.is_file() else _ROOT / relative

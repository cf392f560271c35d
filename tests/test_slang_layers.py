"""Slang files import only from their own layer and from those below it, as import-linter holds Python's to."""

import re
import tomllib
from pathlib import Path

import pica

PACKAGE = Path(pica.__file__).parent
PYPROJECT = Path(__file__).parents[1] / "pyproject.toml"


def layers() -> dict[str, int]:
    """Height of each folder of the package, from the layers that pyproject.toml has for Python."""
    contracts = tomllib.loads(PYPROJECT.read_text())["tool"]["importlinter"]["contracts"]
    named = next(contract["layers"] for contract in contracts if contract["type"] == "layers")
    return {name.strip(): -row for row, names in enumerate(named) for name in names.split(":")}


def imports(file: Path) -> list[str]:
    """Modules that it imports, and files that it includes."""
    return re.findall(r"^\s*(?:(?:__exported\s+)?import|__include)\s+([\w.]+)\s*;", file.read_text(), re.MULTILINE)


def test_slang_imports_go_down():
    heights = layers()
    wrong = []
    for file in sorted(PACKAGE.rglob("*.slang")):
        own = file.relative_to(PACKAGE).parts
        for imported in imports(file):
            other = imported.split(".")
            sibling = own[0] == other[0] == "effects" and own[1] != other[1]
            if heights[other[0]] > heights[own[0]] or sibling:
                wrong.append(f"{file.relative_to(PACKAGE)} imports {imported}")
    assert not wrong, "\n".join(wrong)


def test_every_slang_import_exists():
    for file in PACKAGE.rglob("*.slang"):
        for imported in imports(file):
            assert (PACKAGE / f"{imported.replace('.', '/')}.slang").exists(), f"{file.name} imports {imported}"

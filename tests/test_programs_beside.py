"""Programs that the package's own tests do not run take from pica only what it has: the set-up scripts, the examples,
the benchmarks and the tools."""

import ast
import importlib
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
FOLDERS = "examples", "examples/sheets", "benchmarks", "tools", "scripts"
PROGRAMS = sorted(path for folder in FOLDERS for path in (ROOT / folder).iterdir())
PROGRAMS = [path for path in PROGRAMS if path.suffix in (".py", ".sh")]


def python_in(path: Path) -> str:
    """Its own text, or that of a shell script's inline programs."""
    text = path.read_text()
    if path.suffix == ".py":
        return text
    return "\n".join(re.findall(r"<<'PYTHON'\n(.*?)^PYTHON$", text, re.DOTALL | re.MULTILINE))


def missing_names(source: str) -> list[str]:
    missing = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "pica":
            try:
                module = importlib.import_module(node.module)
            except ImportError:
                missing.append(node.module)
                continue
            for name in node.names:
                if not hasattr(module, name.name) and not _is_module(f"{node.module}.{name.name}"):
                    missing.append(f"{node.module}.{name.name}")
    return missing


def _is_module(name: str) -> bool:
    try:
        importlib.import_module(name)
    except ImportError:
        return False
    return True


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: path.name)
def test_what_it_imports_exists(path):
    assert not missing_names(python_in(path))


def test_a_name_that_went_is_found():
    assert missing_names("from pica.rhi import embree\nfrom pica.gone import it\nfrom pica import load") == [
        "pica.rhi.embree",
        "pica.gone",
    ]

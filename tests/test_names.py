"""Every name of pica's that its pages and docstrings mention is there."""

import ast
import inspect
import pkgutil
import re
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

import pica

ROOT = Path(__file__).parent.parent
SOURCE = ROOT / "src" / "pica"
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
MODULES = sorted(SOURCE.rglob("*.py"))
WHERE = [*PAGES, *MODULES]
NEED_TORCH = ("pica.distributed.rendered_dataset",)
IDS = [str(path.relative_to(ROOT)) for path in WHERE]


@cache
def words_of(path: Path) -> str:
    """A page, or the docstrings of a module, among them those of attributes."""
    if path.suffix == ".md":
        return path.read_text()
    tree = ast.parse(path.read_text())
    texts = [node.value for node in ast.walk(tree) if isinstance(node, ast.Expr)]
    return "\n".join(text.value for text in texts if isinstance(text, ast.Constant) and isinstance(text.value, str))


@cache
def classes() -> dict[str, list[type]]:
    """All classes of pica's by name, but those of modules that need a library that pica does not install."""
    found: dict[str, list[type]] = {}
    for module in pkgutil.walk_packages(pica.__path__, "pica."):
        if module.name != "pica.__main__" and (module.name not in NEED_TORCH or find_spec("torch")):
            for name, value in vars(import_module(module.name)).items():
                if inspect.isclass(value) and value.__module__.startswith("pica"):
                    found.setdefault(name, []).append(value)
    return found


@cache
def files() -> list[str]:
    """What there is in the repository that a text may name."""
    folders = ("src", "tests", "docs", "benchmarks", "tools", "examples")
    found = [path for folder in folders for path in (ROOT / folder).rglob("*.*")]
    return [str(path.relative_to(ROOT)) for path in [*found, *ROOT.glob("*.*")]]


@cache
def members_of_struct(name: str) -> set[str]:
    """The words in the Slang files that declare a struct."""
    texts = (path.read_text() for path in SOURCE.rglob("*.slang"))
    return {word for text in texts if re.search(rf"\bstruct {name}\b", text) for word in re.findall(r"\w+", text)}


def has(holder: object, name: str) -> bool:
    """Whether a module, class or object has an attribute, be it one that only instances have."""
    if hasattr(holder, name):
        return True
    if inspect.ismodule(holder):
        return hasattr(holder, "__path__") and any(each.name == name for each in pkgutil.iter_modules(holder.__path__))
    if not inspect.isclass(holder):
        return False
    own = [each for each in holder.__mro__ if each.__module__.startswith("pica")]
    return any(
        name in inspect.get_annotations(each) or re.search(rf"\bself\.{name}\b[^=\n(]*=", inspect.getsource(each))
        for each in own
    )


def reaches(dotted: str) -> bool:
    """Whether a name such as "pica.Camera.look_at" leads somewhere; what a function gives is not followed."""
    holder: object = pica
    for name in dotted.split(".")[1:]:
        if not has(holder, name):
            return False
        if inspect.ismodule(holder) and not hasattr(holder, name):
            import_module(f"{holder.__name__}.{name}")
        holder = getattr(holder, name, None)
        if holder is None or not (inspect.ismodule(holder) or inspect.isclass(holder)):
            return True
    return True


@pytest.mark.parametrize("path", WHERE, ids=IDS)
def test_names_that_begin_with_pica(path):
    words = words_of(path)
    for dotted in re.findall(r"(?<![\w./@-])pica(?:\.[A-Za-z_]\w*)+", words):
        assert reaches(dotted), dotted
    for module, names in re.findall(r"^ *from (pica[\w.]*) import ([\w, ]+)", words, re.MULTILINE):
        for name in names.split(","):
            assert reaches(f"{module}.{name.strip()}"), f"{module}.{name}"


@pytest.mark.parametrize("path", WHERE, ids=IDS)
def test_attributes_of_classes(path):
    for name, attribute in re.findall(r"(?<![\w.])([A-Z]\w+)\.([a-z_]\w*)", words_of(path)):
        known = classes().get(name)
        if known is not None and attribute not in ("py", "md", "slang"):
            found = any(has(each, attribute) for each in known) or attribute in members_of_struct(name)
            assert found, f"{name}.{attribute}"


@pytest.mark.parametrize("path", WHERE, ids=IDS)
def test_classes_of_modules(path):
    for module, name in re.findall(r"(?<![\w.])([a-z]\w+)\.([A-Z]\w+)", words_of(path)):
        if name in classes() and module not in ("pica", "spy"):
            homes = {each.__module__.rpartition(".")[2] for each in classes()[name]}
            assert module in homes, f"{module}.{name}"


@pytest.mark.parametrize("path", WHERE, ids=IDS)
def test_files(path):
    for name in re.findall(r"(?<![\w./*<-])[\w-]+(?:/[\w-]+)*\.(?:py|slang|md)\b(?!\()", words_of(path)):
        to_be_written = "openness" in name  # by who follows docs/how-it-works/adding-an-effect.md
        assert to_be_written or any(f"/{each}".endswith(f"/{name}") for each in files()), name


def test_names_that_are_not_there_are_found_out():
    assert reaches("pica.SceneError") and reaches("pica.Camera.look_at") and reaches("pica.Material.roughness")
    for name in (
        "pica.SceneErr",
        "pica.Camera.look",
        "pica.scene.model.Nod",
        "pica.cli.nothing",
        "pica.Material.rough",
    ):
        assert not reaches(name), name
    assert has(pica.Renderer, "effects") and has(pica.Renderer, "effect_inputs") and not has(pica.Renderer, "effect")
    assert "offset" in members_of_struct("Reprojection") and not members_of_struct("Reproject")

"""What an effect takes is one folder, one call in the frame, one settings group, one page and tests: all of them do."""

import ast
from dataclasses import fields
from importlib import import_module
from pathlib import Path

import pytest

import pica
from pica.frame.effect import Effect
from pica.settings import Settings

ROOT = Path(__file__).parents[1]
PACKAGE = Path(pica.__file__).parent
FOLDERS = sorted(path.name for path in (PACKAGE / "effects").iterdir() if (path / "__init__.py").exists())
SETTINGS = {
    "depth_of_field": "post",
    "motion_blur": "post",
    "gbuffer": "visibility",
    "stochastic_light": "lighting",
    "composite": "visibility",
}
"""Groups that do not have the folder's name."""
CALLERS = {"renderer/stages.py", "path_tracer/path_tracer.py"}
"""What makes the stages of the hybrid frame, and the reference, which has a G-buffer and a display too."""


def effect_classes(folder: str) -> list[type[Effect]]:
    modules = [
        import_module(f"pica.effects.{folder}.{file.stem}") for file in (PACKAGE / "effects" / folder).glob("*.py")
    ]
    classes = {value for module in modules for value in vars(module).values() if isinstance(value, type)}
    return [c for c in classes if issubclass(c, Effect) and c.__module__.startswith(f"pica.effects.{folder}.")]


def imported(file: Path) -> set[str]:
    nodes = ast.walk(ast.parse(file.read_text()))
    return {node.module for node in nodes if isinstance(node, ast.ImportFrom) and node.module}


@pytest.mark.parametrize("folder", FOLDERS)
def test_one_class_is_the_effect(folder):
    (effect,) = effect_classes(folder)
    assert effect.name.isidentifier() and "__call__" in vars(effect)
    assert not getattr(effect, "__abstractmethods__", None)


@pytest.mark.parametrize("folder", FOLDERS)
def test_nobody_but_the_frame_knows_it(folder):
    place = f"pica.effects.{folder}."
    outside = [file for file in PACKAGE.rglob("*.py") if (PACKAGE / "effects" / folder) not in file.parents]
    users = {file.relative_to(PACKAGE).as_posix() for file in outside if place in " ".join(imported(file))}
    assert "renderer/stages.py" in users and users <= CALLERS


@pytest.mark.parametrize("folder", FOLDERS)
def test_it_is_called_once_in_the_frame(folder):
    (effect,) = effect_classes(folder)
    frame = next(
        node
        for node in ast.walk(ast.parse((PACKAGE / "renderer" / "frame.py").read_text()))
        if isinstance(node, ast.FunctionDef) and node.name == "declare"
    )
    calls = [node.func for node in ast.walk(frame) if isinstance(node, ast.Call)]
    names = [call.attr for call in calls if isinstance(call, ast.Attribute) and ast.unparse(call.value) == "stages"]
    assert names.count(effect.name) == 1


@pytest.mark.parametrize("folder", FOLDERS)
def test_it_has_a_settings_group_a_page_and_tests(folder):
    groups = {field.name for field in fields(Settings)}
    assert SETTINGS.get(folder, folder) in groups
    assert (ROOT / "docs" / "how-it-works" / f"{folder.replace('_', '-')}.md").exists()
    assert any((ROOT / "tests" / "effects").glob(f"{folder}/test_*.py"))

import ast
import dataclasses
import os
import re
import subprocess
import sys
import tomllib
import types
from pathlib import Path
from typing import get_args, get_type_hints

import pytest

import pica


def test_importing_costs_nothing():
    code = "import pica, sys; heavy = {'slangpy', 'numpy', 'PIL'} & set(sys.modules); assert not heavy, heavy"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert run.returncode == 0, run.stderr


def test_a_process_that_converts_a_file_imports_no_compiler():
    """Which would import PyTorch, where there is one: a second for each file."""
    code = "import pica.scene.conversion.worker, sys; assert 'numpy' in sys.modules and 'slangpy' not in sys.modules"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert run.returncode == 0, run.stderr


@pytest.mark.parametrize("name", pica.__all__)
def test_every_public_name_is_there(name):
    assert getattr(pica, name) is getattr(pica, name)


def test_what_checkers_of_types_are_told_is_what_there_is():
    """The imports that only they see against the table by which names are found."""
    tree = ast.parse(Path(pica.__file__).read_text())
    (block,) = (node for node in tree.body if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING")
    told = [
        (node.module, alias.name, alias.asname)
        for node in block.body
        if isinstance(node, ast.ImportFrom) and node.module != "typing"
        for alias in node.names
    ]
    assert all(name == public for _, name, public in told)
    homes = [(module, name) for module, names in pica._PUBLIC.items() for name in names]
    assert sorted((module, name) for module, name, _ in told if module != "pica") == sorted(homes)
    assert {name for module, name, _ in told if module == "pica"} == set(pica._MODULES)


def test_what_scenes_are_made_of_is_public():
    groups = [hint for hint in get_type_hints(pica.Settings).values() if dataclasses.is_dataclass(hint)]
    layers = [pica.Coat, pica.Sheen, pica.Iridescence, pica.Anisotropy]
    for kind in (*get_args(pica.Light), *groups, *layers, pica.Node, pica.Mesh, pica.Section, pica.Image, pica.Texture):
        assert getattr(pica, kind.__name__) is kind


def test_the_version_is_that_of_the_package():
    pyproject = tomllib.loads((Path(__file__).parent.parent / "pyproject.toml").read_text())
    assert pyproject["tool"]["setuptools"]["dynamic"]["version"] == {"attr": "pica.__version__"}
    assert re.fullmatch(r"\d+\.\d+\.\d+", pica.__version__)
    assert Path(pica.__file__).with_name("py.typed").is_file()


@pytest.mark.thorough
def test_checkers_of_types_know_the_public_face():
    program = """
import pica
pica.Settings(shadows=pica.ShadowsSettings(mode="hrad"))
pica.Camera.look_at((0, 0, 1), (0, 0, 0), 45)
pica.Nodes()
"""
    root = Path(__file__).parent.parent
    environment = os.environ | {"MYPYPATH": str(root / "src")}
    command = [
        sys.executable,
        "-m",
        "mypy",
        "--strict",
        "--follow-untyped-imports",
        "--ignore-missing-imports",
        "--config-file",
        "",
        "-c",
        program,
    ]
    run = subprocess.run(command, capture_output=True, text=True, timeout=300, cwd=root, env=environment)
    assert re.findall(r"^<string>:(\d+): error: .*\[([a-z-]+)\]$", run.stdout, re.MULTILINE) == [
        ("3", "arg-type"),
        ("4", "call-arg"),
        ("5", "attr-defined"),
    ], run.stdout + run.stderr


def test_every_error_is_a_public_name():
    errors = {
        name for name, value in vars(pica.errors).items() if isinstance(value, type) and issubclass(value, Exception)
    }
    assert errors <= set(pica.__all__)
    assert all(getattr(pica, name) is getattr(pica.errors, name) for name in errors)
    assert issubclass(pica.SceneError, pica.PicaError)


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="nonsense"):
        _ = pica.nonsense


@pytest.mark.parametrize("name", [name for name in pica.__all__ if not name.startswith("_")])
def test_every_public_name_has_a_docstring(name):
    value = getattr(pica, name)
    if isinstance(value, type | types.FunctionType | types.ModuleType):
        text = value.__doc__ or ""
        assert len(text) > 10 and not text.startswith(f"{name}("), text  # dataclasses without one get their signature
    else:  # a union: the text after its assignment
        body = ast.parse(Path(sys.modules[pica._HOME[name]].__file__).read_text()).body
        (at,) = (
            index
            for index, each in enumerate(body)
            if isinstance(each, ast.Assign) and ast.unparse(each.targets[0]) == name
        )
        assert isinstance(body[at + 1], ast.Expr) and isinstance(body[at + 1].value, ast.Constant)

"""Write the reference of all classes and functions from their docstrings.

By pdoc, to out/docs if no other folder is given; any warning is an error:

    python -m tools.api_reference [FOLDER]
"""

import dataclasses
import sys
import warnings
from importlib.util import find_spec
from pathlib import Path
from types import GenericAlias, ModuleType
from typing import Any, ForwardRef, get_args, get_origin

import pdoc
from pdoc.render import configure

import pica
from pica.scene.checked_field import CheckedField
from pica.settings import Settings
from tools.settings_page import cells

MODULES = "pica", "pica.images.aov_table", "pica.images.labels", "pica.quality", "pica.images.films"
"""With all below them that is public."""


def main(folder: Path = Path("out/docs")) -> None:
    """Write it."""
    for name in pica.__all__:
        value = getattr(pica, name)
        if isinstance(value, type):
            for base in value.__mro__:
                show_plainly(base)
    describe_settings()
    if find_spec("torch") is None:
        stand_in_for_torch()
    configure(docformat="markdown", show_source=False, footer_text=f"pica {pica.__version__}")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        pdoc.pdoc(*MODULES, output_directory=folder)


def stand_in_for_torch() -> None:
    """Let annotations name PyTorch's types where it is not installed."""
    for module, name in (("torch", "Tensor"), ("torch.utils.data", "IterableDataset")):
        sys.modules[module] = ModuleType(module)
        setattr(sys.modules[module], name, type(name, (), {"__class_getitem__": classmethod(GenericAlias)}))


def show_plainly(holder: type) -> None:
    """Make checked fields of a class look like the values that they hold."""
    constructor = vars(holder).get("__init__")
    for annotations in (vars(holder).get("__annotations__", {}), getattr(constructor, "__annotations__", {})):
        for name, annotation in annotations.items():
            annotations[name] = held(annotation)
    for value in vars(holder).values():
        if isinstance(value, CheckedField):
            value.__doc__ = ""  # rather than the class's own


def describe_settings() -> None:
    """Put what each setting does, which its declaration knows, into the docstring of its group."""
    groups = {field.name: type(getattr(Settings(), field.name)) for field in dataclasses.fields(Settings)}
    for path, setting in Settings.schema()["settings"].items():
        group, _, name = path.rpartition(".")
        default, allowed, _, text = cells(setting)
        holder = groups[group] if group else Settings
        holder.__doc__ = f"{(holder.__doc__ or '').rstrip()}\n\n* `{name}` ({allowed}; default {default}): {text}"


def held(annotation: Any) -> Any:
    """What a field of this type holds; other types as they are."""
    origin = get_origin(annotation)
    if isinstance(origin, type) and issubclass(origin, CheckedField):
        (annotation,) = get_args(annotation)
    return annotation.__forward_arg__ if isinstance(annotation, ForwardRef) else annotation


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))

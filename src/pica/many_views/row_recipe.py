"""Recipes of programs with rows of arguments, made of the recipes of those without."""

import shutil
import tempfile
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from pica.many_views.argument_rows import entry_with_rows, package_with_rows
from pica.programs.recipes import ForTypesRecipe
from pica.rhi.device import Device
from pica.rhi.recipes import ComputeRecipe
from pica.rhi.slang_files import SlangFile, digest, stem
from pica.rhi.slang_sessions import PACKAGE
from pica.tracing.ray_pipeline import RayRecipe

PlainRecipe = ComputeRecipe | ForTypesRecipe | RayRecipe


@dataclass(frozen=True)
class RowRecipe:
    """The program of another recipe with rows of arguments."""

    plain: PlainRecipe

    def link(self, device: Device, variant: Any) -> Any:
        """As the other recipe."""
        rows = device.shared(_Rows)
        return rows.entry(self.plain).link(rows.device, variant)

    def make(self, device: Device, linked: Any) -> Any:
        """As the other recipe."""
        return self.plain.make(device.shared(_Rows).device, linked)


def has_rows(plain: PlainRecipe) -> bool:
    """Whether a recipe is of the package's files alone: others are not made anew."""
    if isinstance(plain, RayRecipe):
        return not isinstance(plain.generation.effect, SlangFile)
    compute = plain.plain if isinstance(plain, ForTypesRecipe) else plain
    return isinstance(compute, ComputeRecipe) and not isinstance(compute.module, SlangFile)


class _Rows:
    """The same device, whose programs have rows."""

    def __init__(self, device: Device) -> None:
        texts = "".join(_package().values()) + Path(__file__).with_name("argument_rows.py").read_text()
        self.folder = _written((device.cache or Path(tempfile.mkdtemp())) / f"rows_{digest(texts)}")
        self.device = device.renewed(self.folder)

    def entry(self, plain: PlainRecipe) -> PlainRecipe:
        """The recipe, with an entry point of its own where rows have more than the file's and its imports' parameters,
        or where there is no file."""
        match plain:
            case ForTypesRecipe(ComputeRecipe(str() as file, _, str() as more) as compute):
                text = entry_with_rows(_package()[file], _package(), more)
                return replace(plain, plain=replace(compute, module=SlangFile(self.folder / file, text)))
            case RayRecipe(source, _, _, more):
                text = entry_with_rows(source.text, _package(), more)
                name = f"{source.name}_rows" if more is None else f"{source.name}_with_{stem(more)}_rows"
                return replace(plain, generation=replace(source, name=name, text=text))
        return plain


def _written(folder: Path) -> Path:
    """The folder with all files; several processes may write it at once."""
    if not folder.is_dir():
        made = Path(tempfile.mkdtemp(dir=folder.parent))
        package_with_rows(PACKAGE, made)
        with suppress(OSError):  # another process was first
            made.rename(folder)
        shutil.rmtree(made, ignore_errors=True)
    return folder


@cache
def _package() -> dict[str, str]:
    """The texts of the package's Slang files, by their names."""
    paths = sorted(PACKAGE.rglob("*.slang"))
    return {path.relative_to(PACKAGE).as_posix(): path.read_text(encoding="utf-8") for path in paths}

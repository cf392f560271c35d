"""Slang files outside of the package, and their errors in one line."""

import hashlib
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import slangpy as spy

from pica.errors import PicaError, ShaderError, shown

if TYPE_CHECKING:
    from pica.rhi.device import Device


@dataclass(frozen=True)
class SlangFile:
    """A Slang file of the user's program, as it was when read. It may import pica's modules and files beside it."""

    path: Path
    text: str

    @classmethod
    def read(cls, path: str | Path) -> "SlangFile":
        """Raises ShaderError for a file that cannot be read."""
        try:
            resolved = Path(path).resolve()
            return cls(resolved, resolved.read_text(encoding="utf-8"))
        except TypeError:
            raise ShaderError(f"{shown(path)} is not the path of a Slang file") from None
        except (OSError, ValueError) as error:
            reason = error.strerror if isinstance(error, OSError) else "not a text file"
            raise ShaderError(f"{path}: {reason}") from None

    @property
    def module(self) -> str:
        """Its module name, derived from the text, because a session caches modules by name."""
        return f"own_{re.sub('[^A-Za-z0-9]', '_', self.path.stem)}_{digest(f'{self.path} {self.text}')}"

    def loaded(self, device: "Device") -> spy.SlangModule:
        """The module. Raises ShaderError where it has a fault."""
        try:
            return device.module(self.module, self.text, marked(self.path, self.text))
        except (RuntimeError, spy.SlangCompileError) as error:
            raise self.fault(error) from None

    def fault(self, error: Exception) -> ShaderError:
        """Slang's error message in one line."""
        return ShaderError(
            first_error(self.path, str(error).replace(str(marked(self.path, self.text)), str(self.path)))
        )


Source = str | SlangFile
"""A file below the package, by its path there, or one outside."""


def stem(source: Source) -> str:
    """Its name without folder and suffix."""
    return (Path(source) if isinstance(source, str) else source.path).stem


def unique(source: Source) -> str:
    """A word for the names of modules that are generated for it."""
    return stem(source) if isinstance(source, str) else source.module


def import_path(source: Source) -> str:
    """How Slang imports it; one outside once it is loaded."""
    return source.removesuffix(".slang").replace("/", ".") if isinstance(source, str) else source.module


def digest(text: str) -> str:
    """The session caches modules by name, so a name must identify one source."""
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def marked(path: Path, text: str) -> Path:
    """The path given to Slang, which rejects two modules of one path. In the same folder imports resolve alike."""
    return path.with_name(f"{path.stem}_{digest(text)}.slang")


def first_error(path: Path, diagnostics: str) -> str:
    """Slang's first error as 'file:line: fault'. `path`: of the file that was given as text."""
    title = re.search(r"error\[\w+\]: (.*)", diagnostics)
    place = re.search(r"--> (.*):(\d+):\d+", diagnostics)
    detail = re.search(r"\| +\^+ (.*)", diagnostics)
    if title is None or place is None:
        return f"{path}: {' '.join(diagnostics.split())}"
    # SlangPy prepends a line to source given as text.
    line = int(place[2]) - (place[1] == str(path))
    return f"{place[1]}:{line}: {(detail or title)[1].strip()}"


@contextmanager
def compiler_faults() -> Iterator[None]:
    """Raises ShaderError, with file and line, for whatever Slang finds in files of the package within the block."""
    try:
        yield
    except (PicaError, RuntimeError, spy.SlangCompileError) as error:
        diagnostics = str(error.__cause__ or error)
        if isinstance(error, PicaError) and "error[" not in diagnostics:
            raise
        raise ShaderError(first_error(Path(), diagnostics)) from None

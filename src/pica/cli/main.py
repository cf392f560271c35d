"""The `pica` command: gathers the commands and turns every error into one line and an exit code."""

import os
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import typer

from pica.cli.bench import bench
from pica.cli.compare import compare
from pica.cli.doctor import doctor
from pica.cli.render import render
from pica.cli.report import console, one_line
from pica.errors import PicaError

app = typer.Typer(
    help="Ray traced pictures of glTF scenes. Every command takes --help.", add_completion=False, no_args_is_help=True
)
for command in (render, compare, bench, doctor):
    app.command()(command)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command (`sys.argv` when None) and return its exit code.

    0 success; 2 the user can mend it (bad input, no device); 130 interrupted; 1 a fault of pica itself.
    PICA_DEBUG=1 in the environment lets the traceback through.
    """
    with _libraries_kept_off_stdout(), _warnings_as_lines():
        try:
            # Gives 130 itself when interrupted.
            return app(arguments, prog_name="pica", standalone_mode=False) or 0
        except Exception as error:
            if os.environ.get("PICA_DEBUG"):
                raise
            message, code = _explained(error)
            if message:
                _say(message)
            return code


def _explained(error: Exception) -> tuple[str, int]:
    """The line to show for an error, and the exit code."""
    if isinstance(error, typer.TyperException):
        where = getattr(getattr(error, "ctx", None), "command_path", "pica")
        text = one_line(error.format_message())
        return (f"{text.removesuffix('.')} (see {where} --help)" if text else ""), 2
    if isinstance(error, OSError) and error.filename and error.strerror:
        return f"{error.filename}: {error.strerror}", 2
    if isinstance(error, PicaError | OSError | typer.Abort):
        return one_line(str(error)) or type(error).__name__, 2
    return f"internal error, {type(error).__name__}: {one_line(str(error))} (PICA_DEBUG=1 shows where)", 1


def _say(message: str) -> None:
    console.print(f"pica: {message}", markup=False, highlight=False, soft_wrap=True)


@contextmanager
def _warnings_as_lines() -> Iterator[None]:
    def show(message: Warning | str, *_: Any, **__: Any) -> None:
        _say(f"warning: {one_line(str(message))}")

    with warnings.catch_warnings():
        warnings.showwarning = show
        yield


@contextmanager
def _libraries_kept_off_stdout() -> Iterator[None]:
    """Sends what native libraries print to stderr, so that stdout carries results only (--json must stay JSON)."""
    try:
        is_real = sys.stdout.fileno() == 1
    except (AttributeError, OSError, ValueError):  # none, or replaced by something that is no file
        is_real = False
    if not is_real:
        yield
        return
    sys.stdout.flush()
    kept = os.dup(1)
    results, sys.stdout = sys.stdout, os.fdopen(os.dup(kept), "w", encoding=sys.stdout.encoding)
    os.dup2(2, 1)
    try:
        yield
    finally:
        sys.stdout.close()
        sys.stdout = results
        os.dup2(kept, 1)
        os.close(kept)


if __name__ == "__main__":
    sys.exit(main())

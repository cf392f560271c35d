"""Collects the commands, and turns every error into one line and an exit code."""

import inspect
import os
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import typer

from pica.cli import streams
from pica.cli.bake import bake
from pica.cli.bench import bench
from pica.cli.compare import compare
from pica.cli.dataset import dataset
from pica.cli.demo import demo
from pica.cli.doctor import doctor
from pica.cli.graph import graph
from pica.cli.info import info
from pica.cli.prepare import prepare
from pica.cli.render import render
from pica.cli.view import view
from pica.errors import PicaError
from pica.text import first_line, one_line

# Help is plain text: half as long as in Rich's boxes, whole in narrow terminals, and there in half of the time.
app = typer.Typer(
    help="Ray traced pictures of glTF scenes. Every command takes --help.",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
_COMMANDS: tuple[Callable[..., object], ...] = (
    render,
    dataset,
    demo,
    view,
    bake,
    compare,
    bench,
    graph,
    prepare,
    info,
    doctor,
)
for command in _COMMANDS:
    app.command(short_help=(inspect.getdoc(command) or "").split("\n\n")[0])(command)

_MOST_WARNINGS = 100
"""More are not shown: a file can cause any number."""


def run(arguments: Sequence[str]) -> int:
    """Run one command, by default --help, and return its exit code; see `pica.cli.main.main`."""
    with _warnings_as_lines():
        try:
            with streams.results_alone_on_stdout():
                # Interrupts exit with 130 by themselves.
                return app(arguments or ["--help"], prog_name="pica", standalone_mode=False) or (0 if arguments else 2)
        except streams.UnreadError:
            return 141  # as if SIGPIPE had ended the process
        except Exception as error:
            if os.environ.get("PICA_DEBUG"):
                raise
            message, code = _explained(error)
            streams.say(f"pica: {one_line(message)}")
            return code


def _explained(error: Exception) -> tuple[str, int]:
    """The line to show for an error, and the exit code."""
    if isinstance(error, typer.TyperException):
        where = getattr(getattr(error, "ctx", None), "command_path", "pica")
        return f"{one_line(error.format_message()).removesuffix('.')} (see {where} --help)", 2
    if isinstance(error, OSError) and error.filename and error.strerror:
        return f"{os.fsdecode(error.filename)}: {error.strerror}", 2
    if isinstance(error, PicaError | OSError | UserWarning | typer.Abort):  # a warning where Python has them raised
        return str(error) or type(error).__name__, 2
    if isinstance(error, MemoryError):
        return f"not enough memory ({first_line(error)})", 2
    return f"internal error, {type(error).__name__}: {first_line(error)} (PICA_DEBUG=1 shows where)", 1


@contextmanager
def _warnings_as_lines() -> Iterator[None]:
    count = 0

    def show(message: Warning | str, *_: Any, **__: Any) -> None:
        nonlocal count
        count += 1
        if count <= _MOST_WARNINGS:
            streams.say(f"pica: warning: {one_line(str(message))}")
        elif count == _MOST_WARNINGS + 1:
            streams.say("pica: warning: there are more warnings, which are not shown")

    with warnings.catch_warnings():
        warnings.showwarning = show
        yield

"""Output of the commands: results on stdout, everything else on stderr."""

import math
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from functools import partial
from json import dumps
from threading import Timer
from typing import Any, TextIO, cast

from pica import compiling
from pica.cli.interrupts import cleaning_up_first
from pica.cli.streams import Messages, say
from pica.scene import load_progress as loads
from pica.text import one_line
from pica.texture_space import unwrap_progress

_COMPILING, _UNWRAPPING = "Compiling shaders", "Unwrapping triangles"
_LATE = 1.0
"""Seconds of a load without a bar."""


@contextmanager
def progress(title: str, json: bool = False) -> Iterator[Callable[[int, int], None]]:
    """A progress bar on stderr while the block runs; call the result with (done, total). Others while shaders
    are compiled, and meshes unwrapped, in the block.

    `json`: one JSON object a line instead, {"progress": title, "done": 1, "total": 16}.
    Ctrl-C is a KeyboardInterrupt within the block: terminals need their cursor back, and begun files are removed.
    """
    with (
        cleaning_up_first(),
        nullcontext(_line) if json else _bars(title) as show,
        compiling.REPORTS.to(partial(show, _COMPILING)),
        unwrap_progress.REPORTS.to(partial(show, _UNWRAPPING)),
    ):
        yield partial(show, title)


@contextmanager
def load_progress(title: str) -> Iterator[None]:
    """A progress bar of the pictures that a load decodes, on terminals alone, and only if the block takes longer than a
    second."""
    if not Messages().isatty():
        yield
        return
    from rich import progress as rich
    from rich.console import Console

    console = Console(file=cast(TextIO, Messages()))
    columns = [rich.TextColumn("{task.description}", markup=False), rich.BarColumn(), rich.TimeElapsedColumn()]
    bar = rich.Progress(*columns, console=console, transient=True)
    task = bar.add_task(one_line(title), total=None)
    late = Timer(_LATE, bar.start)
    late.start()
    try:
        with cleaning_up_first(), loads.REPORTS.to(lambda done, total: bar.update(task, completed=done, total=total)):
            yield
    finally:
        late.cancel()
        late.join()
        bar.stop()


def _line(title: str, done: int, total: int) -> None:
    say(dumps({"progress": title, "done": done, "total": total}))


@contextmanager
def _bars(first: str) -> Iterator[Callable[[str, int, int], None]]:
    """Bars by their titles, the first one at once."""
    from rich import progress as rich
    from rich.console import Console

    columns = [rich.TextColumn("{task.description}", markup=False), rich.BarColumn(), rich.MofNCompleteColumn()]
    times = [rich.TimeElapsedColumn(), rich.TimeRemainingColumn()]
    console = Console(file=cast(TextIO, Messages()))
    with rich.Progress(*columns, *times, console=console) as bar:
        tasks = {first: bar.add_task(one_line(first), total=None)}

        def show(title: str, done: int, total: int) -> None:
            if title not in tasks:
                tasks[title] = bar.add_task(title)
            bar.update(tasks[title], completed=done, total=total)

        try:
            yield show
        except BaseException:  # then only the error is printed
            bar.live.transient = True
            console.quiet = not console.is_interactive  # where a bar is one line at the end, though it be an empty one
            raise


def print_line(text: str) -> None:
    """A line on stdout."""
    print(one_line(text))


def print_json(result: Mapping[str, Any]) -> None:
    """One JSON object, alone on stdout; numbers that are not finite, which JSON does not have, are null."""
    print(dumps(_finite(result), indent=2, allow_nan=False))


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {name: _finite(entry) for name, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def print_values(title: str, rows: Mapping[str, Any]) -> None:
    """Names and values on stdout; a mapping among the values becomes indented rows below its name."""
    print_line(title)
    print_columns(_lines([rows]), right={1})


def print_beside(columns: Mapping[str, Mapping[str, Any]]) -> None:
    """A table on stdout with a column for each mapping, below its name."""
    print_columns([("", *map(one_line, columns)), *_lines(list(columns.values()))], right=range(1, len(columns) + 1))


def _lines(columns: Sequence[Mapping[str, Any]]) -> list[tuple[str, ...]]:
    """A name and the value in each column; "" where a column does not have it."""
    lines: list[tuple[str, ...]] = []
    for name in _names(columns):
        values = [column.get(name, "") for column in columns]
        inner = [value for value in values if isinstance(value, Mapping)]
        if inner and not any(inner):
            continue  # no heading without rows
        lines.append((one_line(name, 60), *("" if isinstance(value, Mapping) else _text(value) for value in values)))
        for key in _names(inner):
            cells = (_text(value[key]) if isinstance(value, Mapping) and key in value else "" for value in values)
            lines.append((f"  {one_line(key, 60)}", *cells))
    return lines


def _names(columns: Sequence[Mapping[str, Any]]) -> list[str]:
    """The keys of all columns, in order."""
    return list(dict.fromkeys(name for column in columns for name in column))


def print_columns(rows: Sequence[Sequence[str]], right: Container[int] = ()) -> None:
    """A table on stdout with columns as wide as they need, because programs read it too.

    `right`: the columns to align on the right.
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        cells = [cell.rjust(widths[n]) if n in right else cell.ljust(widths[n]) for n, cell in enumerate(row)]
        print("  ".join(cells).rstrip())


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}" if abs(value) < 1e4 else f"{value:,.0f}"
    if isinstance(value, int):
        return f"{value:,}"
    return one_line(", ".join(map(str, value)) if isinstance(value, list | tuple) else str(value))

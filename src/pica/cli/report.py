"""What the commands say: results on stdout, everything else on stderr."""

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

console = Console(stderr=True)


def one_line(text: str) -> str:
    """The first line that says anything; a hint where there are more."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return "".join(lines[:1]) + (" (PICA_DEBUG=1 shows the rest)" if len(lines) > 1 else "")


@contextmanager
def progress(title: str) -> Iterator[Callable[[int, int], None]]:
    """A progress bar on stderr while the block runs; call what it gives with (done, total)."""
    columns = [TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()]
    with Progress(*columns, TimeRemainingColumn(), console=console) as bar:
        task = bar.add_task(title, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def print_json(result: Mapping[str, Any]) -> None:
    """One JSON object, alone on stdout."""
    print(json.dumps(result, indent=2, allow_nan=False))


def print_table(title: str, rows: Mapping[str, Any]) -> None:
    """Names and values on stdout; a mapping among the values becomes indented rows below its name."""
    table = Table(title=title, title_justify="left", show_header=False, box=None, padding=(0, 2, 0, 0))
    table.add_column()
    table.add_column(justify="right")
    for name, value in rows.items():
        nested = isinstance(value, Mapping)
        table.add_row(name, "" if nested else _text(value))
        for inner, number in value.items() if nested else ():
            table.add_row(f"  {inner}", _text(number))
    Console().print(table)


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}" if abs(value) < 1e4 else f"{value:,.0f}"
    if isinstance(value, int):
        return f"{value:,}"
    return ", ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)

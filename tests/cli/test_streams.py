"""Standard streams that are full, closed or read by nobody, in processes of their own."""

import os
import subprocess
import sys

import pytest

WORK = """
import os, sys, typer
from pica.cli import app
from pica.cli.main import main
from pica.cli.report import print_columns, print_json, print_line, progress

@app.app.command()
def work(lines: int = 1, fault: str = "") -> None:
    with progress("Working") as advance:
        advance(1, 2)
        os.system("echo what a library says")
        if fault:
            raise app.PicaError(fault)
        advance(2, 2)
    print_line("result \\x1b[31m\\n\\udcff \\xfc")
    for _ in range(lines):
        print("result " * 100)

sys.exit(main())
"""


def shell(line, **environment):
    """Run a shell's line, in which `work` is a command that shows its progress, prints and may fail."""
    line = line.replace("work", '"$0" -c "$1" work', 1)
    run = subprocess.run(
        ["bash", "-o", "pipefail", "-c", line, sys.executable, WORK],
        capture_output=True,
        timeout=60,
        env={**os.environ, **environment, "PYTHONUNBUFFERED": ""},  # empty is unset
    )
    return run.returncode, run.stdout.decode(errors="replace"), run.stderr.decode(errors="replace")


def test_results_alone_on_stdout_and_the_rest_on_stderr():
    code, out, err = shell("work")
    assert (code, out.splitlines()[0], len(out.splitlines())) == (0, "result \\x1b[31m\\n\\udcff ü", 2)
    assert "what a library says" in err and "Working" in err and "2/2" in err


@pytest.mark.parametrize("lines", [1, 1000])
def test_a_full_disk_below_stdout_is_one_line(lines):
    code, out, err = shell(f"work --lines {lines} > /dev/full")
    assert (code, out) == (2, "")
    assert "pica: standard output: cannot be written (No space left on device)" in err.splitlines()
    assert "Traceback" not in err and "Exception" not in err


@pytest.mark.parametrize("lines", [1, 1000])
def test_results_that_nobody_reads_are_no_fault(lines):
    code, _, err = shell(f"work --lines {lines} | head -c 0")
    assert code == 141 and "pica:" not in err
    assert "Traceback" not in err and "Exception" not in err and "Broken" not in err


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("work 2>/dev/full", 0),
        ("work 2>&1 >/dev/null | head -c 0", 0),
        ("work <&- >&- 2>&-", 0),
        ("work --fault broken 2>/dev/full", 2),
        ("work --fault broken 2>&-", 2),
        ("work --fault broken 2>&1 >/dev/null | head -c 0", 2),
    ],
)
def test_what_cannot_be_said_is_no_fault(line, code):
    got, _, err = shell(line)
    assert got == code and "Traceback" not in err


def test_files_do_not_get_the_numbers_of_closed_streams():
    probe = "import os; from pica.cli.streams import open_closed; open_closed(); print(os.open('/dev/null', 0) > 2)"
    run = subprocess.run(
        ["bash", "-c", '"$0" -c "$1" 2>&- <&-', sys.executable, probe], capture_output=True, text=True, timeout=60
    )
    assert run.stdout == "True\n"


def test_an_error_is_all_there_is_on_stderr():
    code, out, err = shell("work --fault $'no\\nway \\033[31m' 2>&1 1>/dev/null | grep -v library")
    assert (code, out, err) == (2, "pica: no\\nway \\x1b[31m\n", "")


def test_in_a_terminal_an_error_takes_the_place_of_the_progress():
    code, _, err = shell("work --fault broken", FORCE_COLOR="1", TERM="xterm")
    assert code == 2 and err.endswith("\x1b[?25h\r\x1b[1A\x1b[2Kpica: broken\n")


@pytest.mark.parametrize(
    "environment",
    [
        {"COLUMNS": "1", "LINES": "1", "TERM": "dumb", "TERMINAL_WIDTH": "wide", "PYTHONIOENCODING": "ascii"},
        {"COLUMNS": "999999999", "FORCE_COLOR": "1", "LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"},
        {"COLUMNS": "wide", "TERM": "nonsense", "NO_COLOR": "1", "PYTHONOPTIMIZE": "2", "HOME": ""},
    ],
)
def test_terminals_and_environments_of_all_kinds(environment):
    code, out, err = shell("work", **environment)
    assert code == 0 and out.startswith("result \\x1b[31m\\n\\udcff ") and len(out) < 10_000
    assert "Traceback" not in err and len(err) < 10_000

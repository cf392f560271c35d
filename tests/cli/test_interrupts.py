"""Ctrl-C, in processes of their own that press it themselves."""

import signal
import subprocess
import sys
from collections.abc import Iterator

import pytest


@pytest.fixture(autouse=True)
def _heard() -> Iterator[None]:
    """Who starts the tests in the background ignores Ctrl-C for them, and for the processes that they start."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


PRESS = """
import atexit, os, signal, sys
from pica.cli import interrupts

def press():
    os.kill(os.getpid(), signal.SIGINT)
"""
COMMAND = """
from pica.cli import app
from pica.cli.main import main
from pica.cli.report import progress

class Dying:
    def __del__(self):
        press()

def give_up():
    try:
        press()
    except KeyboardInterrupt:
        raise ImportError("of something else") from None

def twice():
    try:
        press()
    finally:
        press()
        print("still here")

@app.app.command()
def work() -> None:
    with progress("Working") as advance:
        try:
            {within}
            print("went on")
        finally:
            print("cleaned up")

sys.argv = ["pica", "work"]
atexit.register(lambda: {at_exit})
sys.exit(main())
"""


def run(code):
    return subprocess.run([sys.executable, "-c", PRESS + code], capture_output=True, text=True, timeout=60)


def work(within="pass", at_exit="None"):
    done = run(COMMAND.format(within=within, at_exit=at_exit))
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize("module", ["pica.cli.streams", "pica.cli.app", "typer.main", "pica.text"])
def test_while_it_starts(module):
    done = run(
        "from importlib.abc import MetaPathFinder\n"
        "class Finder(MetaPathFinder):\n"
        "    def find_spec(self, name, path, target=None):\n"
        f"        press() if name == {module!r} else None\n"
        "sys.meta_path.insert(0, Finder())\n"
        "from pica.cli.main import main\n"
        "sys.argv = ['pica', '--help']\n"
        "sys.exit(main())"
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


def test_while_it_works():
    assert work("press()") == (130, "cleaned up\n", "")


def test_while_it_works_in_a_library_that_makes_another_error_of_it():
    assert work("give_up()") == (130, "cleaned up\n", "")


def test_while_it_works_where_python_cannot_raise_it():
    assert work("Dying()") == (130, "", "")


def test_again_while_it_cleans_up():
    assert work("twice()") == (130, "", "")


def test_while_it_ends():
    code, out, err = work(at_exit="press()")
    assert (code, out) == (130, "went on\ncleaned up\n") and "Traceback" not in err


def test_errors_without_it_stay_errors():
    code, _, err = work("raise ImportError('lost')")
    assert code == 1 and "internal error, ImportError: lost" in err


def test_a_background_job_stays_deaf():
    done = run("signal.signal(signal.SIGINT, signal.SIG_IGN)\n" + COMMAND.format(within="press()", at_exit="press()"))
    assert (done.returncode, done.stdout) == (0, "went on\ncleaned up\n")


def test_python_programs_keep_their_own_way():
    done = run(
        "from pica.cli.main import main\n"
        "main(['--help'])\n"
        "assert signal.getsignal(signal.SIGINT) is signal.default_int_handler\n"
        "assert sys.unraisablehook is sys.__unraisablehook__\n"
    )
    assert done.returncode == 0, done.stderr
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler

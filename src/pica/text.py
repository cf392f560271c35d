"""Text for messages: one line, safe for the terminal."""

import os
import re

LONGEST = 1000
"""Characters of a message; names in files can have millions."""

_NUMPY_SCALAR = re.compile(r"\bnp\.(?:u?int\d+|float\d+|longdouble|str_)\(([^()]*)\)|\bnp\.(True|False)_\b")
"""How NumPy 2 writes its scalars: np.float64(1.0), np.True_."""


def one_line(text: str, longest: int = LONGEST) -> str:
    """A message as one line of at most so many characters, which lacks the middle where it was longer.

    Line ends, escape sequences, undecodable bytes and other invisible characters are shown as `repr` shows them, and
    NumPy's numbers as Python's.
    """
    text = _NUMPY_SCALAR.sub(lambda match: match[1] or match[2] or "", _cut(text.strip(), longest))
    return _cut(printable(text), longest)


def printable(text: str | os.PathLike[str]) -> str:
    """A text or path as `one_line` shows it, however long."""
    text = os.fspath(text)
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def first_line(error: BaseException) -> str:
    """The first meaningful line of an error of a library that writes several; its type if there is none."""
    return next((line.strip() for line in str(error).splitlines() if line.strip()), type(error).__name__)


def _cut(text: str, longest: int) -> str:
    """Shortened in the middle: the start has the place of a fault, the end the fault."""
    half = longest // 2 - 3
    return text if len(text) <= longest else f"{text[:half]} ... {text[-half:]}"

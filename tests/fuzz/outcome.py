"""What fuzzed code may do: its work, or one PicaError of one line, with little time and memory."""

import re
import resource
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

from pica.errors import PicaError

MOST_SECONDS = 10.0
"""Of processor time; files here are at most some thousand bytes, and other work may slow the machine down."""
MOST_BYTES = 1 << 30
"""By which the most memory that the process ever had may grow in one go."""
MOST_CHARACTERS = 2000


@contextmanager
def held() -> Iterator[None]:
    """Fails for any exception but a PicaError, and for one that does not show well on a terminal."""
    began, memory = time.process_time(), _most_memory()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except PicaError as error:
        shown = str(error)
        assert shown.isprintable() and 0 < len(shown) <= MOST_CHARACTERS, repr(shown[:MOST_CHARACTERS])
        own = re.sub(r"'[^']*'|\"[^\"]*\"", "", shown)  # without what the user wrote, which it may quote
        assert "Error:" not in own and "np." not in own, shown
    assert time.process_time() - began < MOST_SECONDS
    assert _most_memory() - memory < MOST_BYTES


def _most_memory() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024

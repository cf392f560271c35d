"""Entry point of the `pica` command. Slow imports come later, when Ctrl-C needs no traceback any more."""

import sys
from collections.abc import Sequence

from pica.cli import interrupts


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code; None: the one in `sys.argv`, which then owns the process.

    0 success; 2 a user error (bad input, no device); 130 interrupted; 141 the results' reader has ended; 1 a fault
    of pica itself. PICA_DEBUG=1 in the environment lets the traceback through.
    """
    owns_process = arguments is None
    if owns_process:
        interrupts.take_over()
    from pica.cli.streams import drop_unsaid, open_closed

    if owns_process:
        open_closed()
    from pica.cli.app import run

    code = run(sys.argv[1:] if arguments is None else arguments)
    if owns_process:
        drop_unsaid()
    return code


if __name__ == "__main__":
    sys.exit(main())

"""Commands as a user who may read everything and write only what is theirs, whoever runs the tests."""

import os
import shutil

import pytest

_NOBODY = 65534
_MAY = "-all,+dac_read_search"  # the interpreter may lie where only root may look

needs_unprivileged = pytest.mark.skipif(
    not hasattr(os, "geteuid") or (os.geteuid() == 0 and shutil.which("setpriv") is None),
    reason="root may write everywhere, and there is no setpriv to become somebody else",
)


def unprivileged(command: list[str]) -> list[str]:
    """The command, for somebody who is not root."""
    if os.geteuid():
        return command
    ids = [f"--reuid={_NOBODY}", f"--regid={_NOBODY}", "--clear-groups"]
    return ["setpriv", *ids, f"--inh-caps={_MAY}", f"--ambient-caps={_MAY}", *command]

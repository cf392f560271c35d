import pickle

import numpy as np
import pytest

from pica.errors import PicaError, SettingsError
from pica.text import LONGEST, first_line, one_line


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("sky.hdr: no such file", "sky.hdr: no such file"),
        ("  padded\n", "padded"),
        ("a\nb.glb: broken", "a\\nb.glb: broken"),
        ("a\r\x0b\x0c\x85\u2028b", "a\\r\\x0b\\x0c\\x85\\u2028b"),
        ("\x1b[31mred\x1b]0;title\x07", "\\x1b[31mred\\x1b]0;title\\x07"),
        ("\x9b31m", "\\x9b31m"),
        ("right \u202eto left", "right \\u202eto left"),
        ("undecodable \udcff", "undecodable \\udcff"),
        ("Würfel 立方体 🧊", "Würfel 立方体 🧊"),
        ("tab\there", "tab\\there"),
        ("", ""),
        (f"eye {(np.float64(1.5), np.int32(-2), np.float32('nan'))}", "eye (1.5, -2, nan)"),
        (f"{[np.True_, np.False_, np.str_('x')]}", "[True, False, 'x']"),
        ("np.float64 is a type, np.zeros(3) a call", "np.float64 is a type, np.zeros(3) a call"),
    ],
)
def test_messages_are_one_line_that_only_shows(text, shown):
    assert one_line(text) == shown
    assert one_line(shown) == shown


@pytest.mark.parametrize("letter", ["x", "\n", "\U0010ffff"])
def test_the_middle_of_what_is_too_long_is_left_out(letter):
    text = one_line("start " + letter * 10_000_000 + " end")
    assert len(text) <= LONGEST
    assert text.startswith("start ") and text.endswith(" end") and " ... " in text
    assert text.isprintable()


def test_every_error_is_such_a_line_and_survives_another_process():
    error = SettingsError("setting seed: '\x1b[2J\n' is not a whole number")
    assert str(error) == "setting seed: '\\x1b[2J\\n' is not a whole number"
    copy = pickle.loads(pickle.dumps(error))
    assert type(copy) is SettingsError and str(copy) == str(error)
    assert str(PicaError(f"scene: {error}")) == f"scene: {error}"


def test_a_shorter_line():
    assert one_line("0123456789" * 10, 20) == "0123456 ... 3456789" and one_line("x" * 20, 20) == "x" * 20


@pytest.mark.parametrize(("text", "line"), [("\n  no\nmore", "no"), ("", "ValueError"), (" \n ", "ValueError")])
def test_first_lines(text, line):
    assert first_line(ValueError(text)) == line

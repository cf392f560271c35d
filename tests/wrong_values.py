"""Values that users give by mistake or out of malice, and calls to give them to."""

from fractions import Fraction

import numpy as np

from pica.errors import PicaError


class Contrary:
    """Fails however it is looked at."""

    def __array__(self, *arguments, **named):
        raise RuntimeError("no\narray")

    def __float__(self):
        raise ZeroDivisionError

    def __len__(self):
        raise OverflowError

    def __iter__(self):
        raise LookupError("not this way")

    def __repr__(self):
        raise KeyError("nor this")

    def __bool__(self):
        raise ValueError("nor that")


def endless():
    while True:
        yield 1.0


def nested():
    values = []
    values.append(values)
    return values


VALUES = {
    "None": None,
    "true": True,
    "zero": 0,
    "one": 1,
    "minus one": -1,
    "huge integer": 10**400,
    "float": 0.5,
    "huge": 1e308,
    "tiny": 5e-324,
    "nan": float("nan"),
    "infinity": float("inf"),
    "numpy nan": np.float64("nan"),
    "half": np.float16(0.5),
    "long": np.longdouble("1e4000"),
    "complex": 1 + 2j,
    "fraction": Fraction(1, 3),
    "text": "a",
    "empty text": "",
    "lines": "a\nb\x1b[31m\ud800",
    "bytes": b"a",
    "list": [],
    "dict": {"a": 1},
    "set": {1},
    "pair": (1.0, 2.0),
    "three": (1.0, 2.0, 3.0),
    "three nan": (1.0, float("nan"), 3.0),
    "three huge": [1.0, 1e308, 3.0],
    "three negative": (-1.0, -2.0, -3.0),
    "three strings": ["1", "2", "3"],
    "four zeros": (0.0, 0.0, 0.0, 0.0),
    "ragged": [[1.0], [1.0, 2.0]],
    "nested": nested(),
    "Nones": [None, None, None],
    "endless": endless(),
    "object": object(),
    "contrary": Contrary(),
    "class": dict,
    "function": len,
    "no row": np.zeros((0, 3)),
    "one row": np.zeros((1, 3)),
    "rows of nan": np.full((4, 3), np.nan),
    "flags": np.zeros((4, 3), bool),
    "objects": np.full((4, 3), None),
    "times": np.zeros(3, "M8[s]"),
    "records": np.zeros(3, [("a", "f4")]),
    "matrix of nan": np.full((4, 4), np.nan),
    "zero matrix": np.zeros((4, 4)),
    "flat matrix": np.eye(4).reshape(-1),
    "projection": np.diag([1.0, 1.0, 1.0, 2.0]),
    "huge matrix": np.diag([1e308, 1.0, 1.0, 1.0]),
    "matrices": np.tile(np.eye(4), (3, 1, 1)),
    "zero-dimensional": np.array(np.nan),
    "masked": np.ma.masked_array([1.0, 2.0, 3.0], [True, True, True]),
    "large integers": np.array([2**63, 2**64 - 1, 0], np.uint64),
    "seven dimensions": np.zeros((1,) * 7),
}


def fault_of(call, *arguments, **named) -> str:
    """What it says is wrong, after making sure that it is one fit line; empty if nothing is. Other errors go on."""
    try:
        call(*arguments, **named)
    except PicaError as error:
        message = str(error)
        assert message.isprintable() and len(message) < 300, message
        assert "np." not in message, message
        return message
    return ""

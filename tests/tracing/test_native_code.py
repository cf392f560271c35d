"""Functions written with Python's operators do as machine code what they say."""

import ctypes

import numpy as np
import pytest

pytest.importorskip("llvmlite")
from pica.tracing.native_code import Variable, machine_code


def run(write, *addresses) -> None:
    """Call what `write` writes with the addresses of arrays, or with whole numbers."""
    code = machine_code({"it": (len(addresses), write)})
    function = ctypes.CFUNCTYPE(None, *[ctypes.c_size_t] * len(addresses))(code.address("it"))
    function(*(a.ctypes.data if isinstance(a, np.ndarray) else a for a in addresses))


def test_numbers_in_memory():
    whole, real, wide = np.arange(8, dtype=np.uint32), np.linspace(-1, 1, 8, dtype=np.float32), np.uint64([2**40, 0])

    def write(code, whole, real, wide):
        uints, floats, words = code.uints(whole), code.floats(real), code.words(wide)
        uints[0] = (uints[7] * 3 + 1 - 2 ^ 5) & 0xFF | 256
        uints[1] = uints[6] >> 1
        floats[0] = floats[7] * 4.0 + 0.5 - floats[0]
        words[1] = words[0] + uints[2].word()

    run(write, whole, real, wide)
    assert whole.tolist() == [((7 * 3 + 1 - 2) ^ 5) & 0xFF | 256, 3, 2, 3, 4, 5, 6, 7]
    assert real[0] == 5.5 and wide[1] == 2**40 + 2


@pytest.mark.parametrize("count", [0, 1, 7, 16])
def test_loops_conditions_and_variables(count):
    values, kept = np.random.default_rng(1).normal(size=count).astype(np.float32), np.zeros(count + 1, np.uint32)

    def write(code, values, kept, count):
        found = Variable(code)
        with code.loop(count) as place, code.when(code.floats(values)[place] < 0.0):
            code.uints(kept)[found.get() + 1] = code.uints(values)[place]
            found.set(found.get() + 1)
        few = code.uints(kept)
        with code.loop(found.get(), 4):
            few[0] = few[0] + 1

    run(write, values, kept, count)
    negative = values[values < 0]
    assert kept[1 : 1 + len(negative)].view(np.float32).tolist() == negative.tolist()
    assert kept[0] == -(-len(negative) // 4)


def test_choices_and_calls():
    seen = []
    listener = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(lambda *given: seen.append(given))
    numbers = np.uint32([7, 9])

    def write(code, numbers, function):
        row = code.uints(numbers)
        equal = row[0].equals(7) & row[1].differs(7)
        code.call(function, code.choose(equal, row[0], 0).word(), code.choose(row[0] > row[1], row[0], 3).word())

    run(write, numbers, ctypes.cast(listener, ctypes.c_void_p).value)
    assert seen == [(7, 3)]

"""Arrays of any kind of numbers become what shaders read, exactly or rounded, or are refused in words."""

import numpy as np
import pytest

from pica.errors import SceneError
from pica.scene.arrays import affine, affines, doubles, floats, integers, numbers
from pica.scene.values import UnfitError, checked

ROWS = np.arange(12.0).reshape(4, 3)


def kept(check, values):
    return checked("field", check, values)


@pytest.mark.parametrize(
    "values",
    [
        ROWS,
        ROWS.astype("f4"),
        ROWS.astype("f2"),
        ROWS.astype(">f4"),
        ROWS.astype(">f8"),
        ROWS.astype(np.longdouble),
        ROWS.astype("i8"),
        ROWS.astype("u1"),
        ROWS.astype(">i2"),
        np.asfortranarray(ROWS),
        ROWS[::-1][::-1],
        np.repeat(ROWS, 2, 0)[::2],
        np.flip(np.flip(ROWS).copy()),
        ROWS.astype("f4").T.copy().T,
        ROWS.tolist(),
        tuple(map(tuple, ROWS.tolist())),
        list(ROWS.astype("f4")),
        ROWS.view(np.matrix),
    ],
)
def test_numbers_of_any_kind_and_order_are_the_same_floats(values):
    for check, dtype in ((floats("rows", 3), np.float32), (doubles(4, 3), np.float64)):
        found = kept(check, values)
        assert type(found) is np.ndarray and found.dtype == dtype and found.dtype.isnative
        assert found.flags.c_contiguous and found.flags.aligned
        np.testing.assert_array_equal(found, ROWS)


def test_what_fits_already_is_kept_and_not_copied():
    for check, values in (
        (floats("rows", 3), ROWS.astype("f4")),
        (doubles("rows", 3), ROWS),
        (integers("u4", "rows", 3), ROWS.astype("u4")),
    ):
        values.flags.writeable = False
        assert kept(check, values) is values


def test_arrays_that_start_between_numbers_are_moved():
    odd = np.frombuffer(b"\0" + ROWS.astype("f4").tobytes(), "f4", offset=1).reshape(4, 3)
    assert not odd.flags.aligned
    np.testing.assert_array_equal(kept(floats("rows", 3), odd), ROWS)


def test_floats_are_rounded():
    third = np.array([1 / 3, 1e-60, -1e-46, 3.4028235e38])
    np.testing.assert_array_equal(kept(floats("n"), third), third.astype("f4"))
    large = np.full(1000, 3e38)  # whose sum of squares is beyond all floats
    np.testing.assert_array_equal(kept(floats("n"), large), large.astype("f4"))
    assert kept(doubles("n"), large) is large


@pytest.mark.parametrize("largest", [1 << 24, (1 << 24) + 2, -(1 << 60), 255])
def test_integers_that_floats_hold_are_exact(largest):
    assert kept(floats("n"), np.array([1, largest]))[1] == largest


@pytest.mark.parametrize(
    ("given", "dtype"),
    [((1 << 24) + 1, "i4"), ((1 << 63) - 1, "i8"), ((1 << 64) - 1, "u8"), (-(1 << 53) - 1, ">i8")],
)
def test_integers_that_floats_do_not_hold_are_refused(given, dtype):
    with pytest.raises(SceneError, match=rf"field: row 2 is an integer that float32 does not hold \({given}\)"):
        kept(floats("n"), np.array([1, 2, given], dtype))


@pytest.mark.parametrize(
    ("row", "fault"),
    [
        (np.nan, "row 3 is not finite (nan)"),
        (-np.inf, "row 3 is not finite (-inf)"),
        (1e39, "row 3 is too large for 32-bit floats (1e+39)"),
        (-1.7e308, "row 3 is too large for 32-bit floats (-1.7e+308)"),
    ],
)
@pytest.mark.filterwarnings("error")
def test_what_is_not_finite_names_its_row(row, fault):
    values = ROWS.copy()
    values[3, 1] = row
    for check in (floats("rows", 3), doubles("rows", 3), numbers()):
        with pytest.raises(SceneError) as caught:
            kept(check, values)
        assert str(caught.value) == f"field: {fault}"
    assert str(caught.value).count("\n") == 0


def test_half_floats_and_long_doubles_overflow_too():
    with pytest.raises(SceneError, match=r"row 0 is not finite"):
        kept(floats("n"), np.array([np.inf], "f2"))
    with pytest.raises(SceneError, match=r"row 1 is too large"):
        kept(doubles("n"), np.array([1, np.longdouble("1e4000")]))


def test_values_below_the_lowest_are_refused():
    with pytest.raises(SceneError, match=r"field: row 1 is negative \(-0.5\)"):
        kept(floats("n", low=0), [0, -0.5])
    assert kept(floats("n", low=0), [-0.0, 1e-60]).tolist() == [0, 0]


@pytest.mark.parametrize(
    "values",
    [
        np.zeros((4, 3), bool),
        np.zeros((4, 3), complex),
        np.zeros((4, 3), object),
        np.zeros((4, 3), "U1"),
        np.zeros((4, 3), "M8[s]"),
        np.zeros((4, 3), [("x", "f4")]),
        [[None] * 3] * 4,
        [["1"] * 3] * 4,
        [[1, 2, 3], [1, 2]],
        [[10**30] * 3] * 4,
        None,
        "rows",
        {1: 2},
        object(),
    ],
)
def test_what_is_no_array_of_numbers_is_refused(values):
    for check in (floats("rows", 3), doubles(4, 3), integers("u4", "rows", 3), numbers()):
        with pytest.raises(SceneError, match=r"field: .*not an array of (numbers|integers)"):
            kept(check, values)


@pytest.mark.parametrize("shape", [(4,), (1, 3), (3,), (4, 1), (1, 4, 3), (3, 4), (), (0, 3), (12,)])
def test_shapes_are_as_asked_for_without_broadcasts(shape):
    for check in (floats(4, 3), doubles(4, 3), integers("i4", 4, 3)):
        with pytest.raises(SceneError) as caught:
            kept(check, np.ones(shape, np.int32))
        assert str(caught.value) == f"field: has the shape {shape}, not (4, 3)"


def test_a_length_that_may_be_any_is_named():
    with pytest.raises(SceneError, match=r"has the shape \(3,\), not \(vertices, 3\)"):
        kept(floats("vertices", 3), [1, 2, 3])
    assert kept(floats("vertices", 3), np.zeros((0, 3))).shape == (0, 3)
    assert kept(floats("vertices", 3), np.broadcast_to(np.ones(3), (4, 3))).flags.c_contiguous


@pytest.mark.parametrize("dtype", ["i8", "u8", ">i4", "u2", "i1", ">u2"])
def test_integers_of_any_type_are_exact(dtype):
    values = np.array([[0, 1, 127]], dtype)
    found = kept(integers(np.uint32, "triangles", 3), values)
    assert found.dtype == np.uint32 and found.tolist() == [[0, 1, 127]]
    assert kept(integers(np.uint32, "triangles", 3), values[:, ::-1]).tolist() == [[127, 1, 0]]


@pytest.mark.parametrize("given", [-1, 1 << 32, (1 << 63) - 1])
def test_integers_out_of_range_are_refused(given):
    with pytest.raises(SceneError, match=rf"row 1 is not from 0 to 4294967295 \({given}\)"):
        kept(integers(np.uint32, "n"), [0, given])


def test_integers_are_never_made_of_floats_or_flags():
    for values in ([1.0], [True], np.ones(1, "f2")):
        with pytest.raises(SceneError, match=r"not an array of integers"):
            kept(integers(np.uint32, "n"), values)


def test_a_matrix_is_copied_and_keeps_its_last_row():
    matrix = np.diag([2.0, 0.0, -1.0, 1.0])
    found = affine(matrix)
    assert found is not matrix and (found == matrix).all()
    assert (affine(matrix.astype(int).tolist()) == matrix).all()
    matrix[3] = (1e-6, 0, 0, 1 - 1e-6)
    assert affine(matrix)[3].tolist() == [0, 0, 0, 1]


@pytest.mark.parametrize(
    ("matrix", "fault"),
    [
        (np.eye(4).reshape(-1), "shape"),
        (np.eye(3), "shape"),
        (np.full((4, 4), np.nan), "row 0 is not finite"),
        (np.diag([1, 1, 1e308, 1]), "row 2 is too large"),
        (np.diag([1.0, 1, 1, 2]), r"last row is \[0.0, 0.0, 0.0, 2.0\], not 0, 0, 0, 1"),
        (np.eye(4, dtype=complex), "complex128"),
        (np.eye(4).astype(str), "str"),
        (np.eye(4, dtype=bool), "bool"),
        (None, "None"),
    ],
)
@pytest.mark.filterwarnings("error")
def test_a_matrix_that_places_nothing_is_refused(matrix, fault):
    with pytest.raises(UnfitError, match=fault):
        affine(matrix)
    if np.shape(matrix) == (4, 4) and np.asarray(matrix).dtype == float:
        with pytest.raises(UnfitError, match=r"row"):
            affines(np.stack([np.eye(4), matrix]))


def test_one_number_is_told_from_many_too():
    assert kept(floats(), 2**24) == 2**24
    with pytest.raises(SceneError, match="field: is an integer that float32 does not hold"):
        kept(floats(), 2**24 + 1)

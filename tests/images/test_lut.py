"""Look-up tables from .cube files, whoever wrote them."""

import numpy as np
import pytest

import pica
from pica.images import lut

HEAD = 'TITLE "x"\n# a comment\nLUT_3D_SIZE 2\nDOMAIN_MIN 0 0 0\nDOMAIN_MAX 1 1 2\n'
ROWS = "".join(f"{red} {green} {blue}.5e-1\n" for blue in (0, 1) for green in (0, 1) for red in (0, 1))


def load(folder, content):
    path = folder / "look.cube"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return pica.Lut.load(path)


def test_red_is_fastest(tmp_path):
    read = load(tmp_path, HEAD + "\n" + ROWS)
    assert read.table.shape == (2, 2, 2, 3) and read.domain == ((0, 0, 0), (1, 1, 2))
    np.testing.assert_allclose(read.table[1, 0, 1], (1, 0, 0.15))
    assert read.table.dtype == np.float32


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (ROWS, "has no LUT_3D_SIZE"),
        (HEAD, "has 0 colours, not 8"),
        (HEAD + ROWS + ROWS, "has 16 colours, not 8"),
        (HEAD.replace("SIZE 2", "SIZE 130"), "line 3: '130' is not a size of 2 to 129"),
        (HEAD.replace("SIZE 2", "SIZE 2 2"), "line 3: '2 2' is not a size"),
        (HEAD.replace("LUT_3D_SIZE", "LUT_1D_SIZE"), "line 3: 'LUT_1D_SIZE' is not a keyword"),
        (HEAD.replace("1 1 2", "1 0 2") + ROWS, "DOMAIN_MIN is not below DOMAIN_MAX"),
        (HEAD.replace("1 1 2", "1 nan 2") + ROWS, "line 5: '1 nan 2' is not three numbers"),
        (HEAD + ROWS.replace("0.5e-1", "0.5e-1 7"), "is not three"),
        (HEAD + ROWS.replace("1.5e-1", "1e999"), "is not three finite numbers"),
        (HEAD + ROWS.replace("1.5e-1", "1x"), "is not three numbers"),
        (b"\xff\xfe\0\x1b[31m" + b"9" * 5000, "is not a keyword"),
        ("", "has no LUT_3D_SIZE"),
        (HEAD.replace("SIZE 2", "SIZE " + "9" * 5000), "is not a size of 2 to 129"),
    ],
    ids=range(14),
)
def test_a_fault_is_one_line(tmp_path, content, says):
    with pytest.raises(pica.PicaError) as caught:
        load(tmp_path, content)
    message = str(caught.value)
    assert says in message and "look.cube" in message and message.isprintable() and len(message) < 1000


def test_size_is_checked_first(tmp_path, monkeypatch):
    monkeypatch.setattr(lut, "_MOST_BYTES", 10)
    with pytest.raises(pica.PicaError, match="larger than"):
        load(tmp_path, HEAD + ROWS)
    with pytest.raises(pica.PicaError, match="no such file"):
        pica.Lut.load(tmp_path / "none.cube")

import subprocess
import sys

import pytest

import pica


def test_importing_costs_nothing():
    code = "import pica, sys; heavy = {'slangpy', 'numpy', 'PIL'} & set(sys.modules); assert not heavy, heavy"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert run.returncode == 0, run.stderr


@pytest.mark.parametrize("name", pica.__all__)
def test_every_public_name_is_there(name):
    assert getattr(pica, name) is getattr(pica, name)


def test_every_error_is_a_public_name():
    errors = {
        name for name, value in vars(pica.errors).items() if isinstance(value, type) and issubclass(value, Exception)
    }
    assert errors <= set(pica.__all__)
    assert all(getattr(pica, name) is getattr(pica.errors, name) for name in errors)
    assert issubclass(pica.SceneError, pica.PicaError)


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="nonsense"):
        _ = pica.nonsense

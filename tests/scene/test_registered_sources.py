"""Sources of material types and shapes that are read again."""

import pytest

import pica
from pica.scene import material_registry, shape_registry
from pica.scene.material_registry import material_source
from pica.scene.shape_registry import registered_sources, shape_source, sources_read_again


@pytest.fixture
def files(tmp_path, monkeypatch):
    """Of a material type and a shape."""
    monkeypatch.setattr(material_registry, "_registered", {})
    monkeypatch.setattr(shape_registry, "_registered", {})
    made = tmp_path / "wax.slang", tmp_path / "gyroid.slang"
    for file in made:
        file.write_text("before")
    pica.register_material("wax", made[0])
    pica.register_shape("gyroid", made[1])
    return made


def texts() -> list[str]:
    return [material_source("wax").text, shape_source("gyroid").text]


def test_sources_are_those_of_the_files(files):
    assert [source.name for source in registered_sources()] == ["wax", "gyroid"]
    for file in files:
        file.write_text("after")
    assert texts() == ["before"] * 2
    with sources_read_again():
        assert texts() == ["after"] * 2
    assert texts() == ["after"] * 2 and shape_source("gyroid").error is pica.errors.ShapeError


def test_a_fault_puts_all_back(files):
    files[0].write_text("after")
    with pytest.raises(ZeroDivisionError), sources_read_again():
        _ = 1 / 0
    assert texts() == ["before"] * 2
    files[1].write_bytes(b"\xff")
    with pytest.raises(pica.errors.ShapeError, match="not a text file"), sources_read_again():
        pass
    assert texts() == ["before"] * 2


def test_one_without_a_file_stays(files):
    files[0].unlink()
    files[1].write_text("after")
    with sources_read_again():
        assert texts() == ["before", "after"]

"""The record of what is compiled: by what programs are made of, and never in the way."""

import pytest

from pica.caches.compiled_programs import CompiledPrograms


@pytest.fixture
def sources(tmp_path):
    folder = tmp_path / "sources"
    (folder / "effects").mkdir(parents=True)
    (folder / "effects" / "a.slang").write_text("int a;")
    return folder


@pytest.fixture
def record(tmp_path, sources):
    def opened(driver="mesa 1"):
        return CompiledPrograms(tmp_path / "compiled", sources, driver)

    return opened


def test_what_was_compiled_is_known_to_the_next_process(record):
    first = record()
    assert not first.has(("a", 1))
    first.add([("a", 1), ("a", 2)])
    assert first.has(("a", 1))
    assert [record().has(("a", number)) for number in (1, 2, 3)] == [True, True, False]


def test_another_driver_or_another_source_has_nothing(record, sources):
    record().add(["a"])
    assert record().has("a") and not record("mesa 2").has("a")
    (sources / "effects" / "a.slang").write_text("int b;")
    assert not record().has("a")
    (sources / "effects" / "a.slang").write_text("int a;")
    assert record().has("a")
    (sources / "effects" / "a.slang").rename(sources / "a.slang")
    assert not record().has("a")


def test_two_processes_add_to_one_file(record):
    first, second = record(), record()
    first.add(["a"])
    second.add(["b"])
    assert record().has("a") and record().has("b")


def test_it_is_written_once(record, tmp_path):
    record().add(["a", "b"])
    size = (tmp_path / "compiled").stat().st_size
    record().add(["b", "a"])
    assert (tmp_path / "compiled").stat().st_size == size


@pytest.mark.parametrize("content", [b"\xff\xfe\x00", b"a" * 100_000, b"\n\n"])
def test_a_damaged_file_knows_nothing(record, tmp_path, content):
    (tmp_path / "compiled").write_bytes(content)
    assert not record().has("a")


def test_where_nothing_can_be_kept_a_process_knows_its_own(record, tmp_path, sources):
    (tmp_path / "compiled").mkdir()
    for made in (record(), CompiledPrograms(None, sources, "mesa 1")):
        made.add(["a"])
        assert made.has("a")
    assert not record().has("a")

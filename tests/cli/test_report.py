"""What commands say while they work."""

import json

from pica.cli.report import progress
from pica.compiling import Compilation


def test_a_bar_of_its_own_says_how_many_shaders_are_compiled(capsys):
    with progress("Rendering") as advance:
        Compilation(17).tell(7)
        advance(1, 2)
    rendering, compiled = capsys.readouterr().err.splitlines()
    assert rendering.startswith("Rendering ") and "1/2" in rendering
    assert compiled.startswith("Compiling shaders ") and " 7/17" in compiled


def test_nothing_is_said_of_shaders_where_none_are_compiled(capsys):
    with progress("Rendering") as advance:
        advance(1, 2)
    Compilation(2).tell(1)
    assert "Compiling" not in capsys.readouterr().err


def test_with_json_progress_is_lines_of_it(capsys):
    with progress("Rendering", json=True) as advance:
        Compilation(17).tell(7)
        advance(1, 2)
    said = capsys.readouterr()
    assert said.out == ""
    assert [json.loads(line) for line in said.err.splitlines()] == [
        {"progress": "Compiling shaders", "done": 0, "total": 17},
        {"progress": "Compiling shaders", "done": 7, "total": 17},
        {"progress": "Rendering", "done": 1, "total": 2},
    ]

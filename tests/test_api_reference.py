"""The reference of all classes and functions can be made without a warning, and says what their docstrings say."""

import re
import subprocess
import sys
from html import unescape
from pathlib import Path

import pytest

import pica

pytest.importorskip("pdoc", reason="pdoc is not installed: pip install pica[docs]")
ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """The text of pica's own page, without its source."""
    folder = tmp_path_factory.mktemp("reference")
    # In a process of its own, as it alters the classes that it describes.
    program = [sys.executable, "-m", "tools.api_reference", str(folder)]
    run = subprocess.run(program, cwd=ROOT, capture_output=True, text=True, timeout=120)
    assert (run.returncode, run.stderr) == (0, "")
    assert (folder / "pica" / "quality.html").exists()
    text = (folder / "pica.html").read_text()
    missing = [name for name in pica.__all__ if not name.startswith("_") and f'href="#{name}"' not in text]
    pages = {path.stem for path in (folder / "pica").glob("[cegs]*.html")}
    assert set(missing) == {"color", "errors", "graph", "scenes"} == pages
    return unescape(re.sub(r"<[^>]*>", "", text))


@pytest.mark.thorough
def test_fields_look_like_what_they_hold(page):
    assert "CheckedField" not in page and "TrackedField" not in page
    assert re.search(r"roughness:\s*float\s+GGX's alpha is roughness squared\.", page)


@pytest.mark.thorough
def test_settings_say_what_they_do(page):
    text = pica.Settings.schema()["settings"]["shadows.history"]["text"]
    assert "history (1 to 64 frames; default 8): " + text in page

"""Where the shared test assets lie; tests that need them skip where they are absent (tests/conftest.py)."""

from pathlib import Path

import pytest

ASSETS = Path(__file__).resolve().parents[2] / "shared" / "assets"

needs_assets = pytest.mark.assets

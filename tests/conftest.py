"""One graphics device for all tests that render."""

import pytest

from pica.rhi.device import Device


@pytest.fixture(scope="session")
def device() -> Device:
    """The device that an installed pica would choose."""
    return Device()

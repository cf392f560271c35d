"""One graphics device for all tests that render, and which tests those are."""

import os
from collections.abc import Iterator

import pytest
import slangpy as spy

from pica.programs import preparation
from pica.rhi import validation
from pica.rhi.device import Device, open_device


@pytest.fixture(scope="session")
def device() -> Device:
    """The device that an installed pica would choose."""
    return open_device()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark all tests that ask for a device, so that `make test-fast` leaves them out."""
    for item in items:
        if "device" in getattr(item, "fixturenames", ()):
            item.add_marker("device")


@pytest.fixture(autouse=True)
def _no_device_unless_marked(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the mark is missing, opening a device in this process fails, so that the mark stays true."""
    if request.node.get_closest_marker("device") is None:
        monkeypatch.setattr(spy, "Device", _ClosedDevice)


@pytest.fixture(autouse=True)
def _one_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tests run on all cores as it is."""
    monkeypatch.setattr(preparation, "cores", lambda: 1)


@pytest.fixture(autouse=True)
def _nothing_invalid() -> Iterator[None]:
    """With PICA_VALIDATE=1, a test fails of which validation says anything."""
    yield
    if os.environ.get("PICA_VALIDATE"):
        assert not validation.said()


class _ClosedDevice(spy.Device):
    def __new__(cls, *arguments: object, **named: object) -> "_ClosedDevice":
        pytest.fail("this test opens a device: let it ask for the fixture `device`, or mark it `device`")

"""One graphics device for all tests that render, and which tests those are."""

import gc
import os
from collections.abc import Iterator

# Before anything opens a device. Most time goes to lavapipe's compiler, which takes about half as long for narrower
# vectors, and a third of the memory; pictures are the same bit for bit, but for the order in which surfels are born.
os.environ.setdefault("LP_NATIVE_VECTOR_WIDTH", "128")

import pytest
import slangpy as spy

from pica.caches.places import caches
from pica.programs import preparation
from pica.rhi import validation
from pica.rhi.device import Device, open_device
from tests.assets import ASSETS

caches()  # for devices that pica does not open too: Mesa's own place may have programs for wider vectors, which crash


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--graphics-card", action="store_true", help="end where there is none but the processor")


@pytest.fixture(scope="session")
def device(pytestconfig: pytest.Config) -> Device:
    """The device that an installed pica would choose."""
    found = open_device()
    if pytestconfig.getoption("graphics_card") and found.is_software:
        pytest.exit(f"there is no graphics card here: pica would choose {found.name}", returncode=1)
    return found


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark all tests that ask for a device, so that `make test-fast` leaves them out; skip what cannot run, and let
    fail what is known to."""
    for item in items:
        if "device" in getattr(item, "fixturenames", ()):
            item.add_marker("device")
        if item.get_closest_marker("assets") and not ASSETS.is_dir():
            item.add_marker(pytest.mark.skip(reason=f"test assets are not at {ASSETS}"))
        known = item.get_closest_marker("gpu_differs")
        if known is not None and config.getoption("graphics_card"):
            item.add_marker(pytest.mark.xfail(reason=known.args[0], strict=False))


def pytest_collection_finish() -> None:
    """Imports and thousands of tests stay: otherwise each full collection, as after a dropped scene, visits them."""
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True)
def _no_device_unless_marked(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the mark is missing, opening a device in this process fails, so that the mark stays true."""
    if request.node.get_closest_marker("device") is None:
        monkeypatch.setattr(spy, "Device", _ClosedDevice)


@pytest.fixture(autouse=True, scope="session")
def _one_compiler() -> Iterator[None]:
    """Tests run on all cores as it is; fixtures of a module compile too."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(preparation, "cores", lambda: 1)
        yield


@pytest.fixture(autouse=True)
def _nothing_invalid() -> Iterator[None]:
    """With PICA_VALIDATE=1, a test fails of which validation says anything."""
    yield
    if os.environ.get("PICA_VALIDATE"):
        assert not validation.said()


class _ClosedDevice(spy.Device):
    def __new__(cls, *arguments: object, **named: object) -> "_ClosedDevice":
        pytest.fail("this test opens a device: let it ask for the fixture `device`, or mark it `device`")

"""Choosing a device, and what a device says of itself."""

from types import SimpleNamespace

import pytest

from pica.errors import DeviceError
from pica.rhi import adapters
from pica.rhi.device import Device

SOFTWARE = SimpleNamespace(name="llvmpipe (LLVM 19.1.7, 256 bits)")
FAST, FASTER = SimpleNamespace(name="GeForce One"), SimpleNamespace(name="GeForce Two")


@pytest.fixture
def machine(monkeypatch):
    """Pretend that the machine has these adapters."""
    return lambda *known: monkeypatch.setattr(adapters, "adapters", lambda: list(known))


def test_hardware_comes_before_software(machine):
    machine(SOFTWARE, FAST, FASTER)
    assert adapters.choose(None) is FAST


def test_software_is_better_than_nothing(machine):
    machine(SOFTWARE)
    assert adapters.choose(None) is SOFTWARE


def test_a_part_of_the_name_chooses(machine):
    machine(FAST, SOFTWARE, FASTER)
    assert adapters.choose("two") is FASTER
    assert adapters.choose("LLVMPIPE") is SOFTWARE
    assert adapters.choose("geforce") is FAST


def test_unknown_name_is_one_line_that_lists_the_devices(machine):
    machine(FAST, SOFTWARE)
    with pytest.raises(DeviceError, match=r"no device named 'voodoo'.*GeForce One, llvmpipe") as raised:
        adapters.choose("voodoo")
    assert "\n" not in str(raised.value)


def test_no_device_is_one_line_that_says_what_to_do(machine):
    machine()
    with pytest.raises(DeviceError, match=r"no Vulkan device.*pica doctor") as raised:
        adapters.choose(None)
    assert "\n" not in str(raised.value)


def test_opening_an_unknown_device_fails():
    with pytest.raises(DeviceError, match="no such card"):
        Device("no such card")


def test_device_says_what_it_is(device):
    assert device.name and device.tier >= 2
    assert device.info.missing == []
    assert device.is_software == ("llvmpipe" in device.name)


def test_list_has_the_device_with_the_same_description(device):
    assert device.info in adapters.list_devices()


@pytest.mark.device
def test_device_that_lacks_something_is_refused(monkeypatch):
    monkeypatch.setattr(
        "pica.rhi.device.describe",
        lambda *_: adapters.DeviceInfo("old card", "hardware", "", 0, ["bindless resources"]),
    )
    with pytest.raises(DeviceError, match="'old card' lacks bindless resources"):
        Device()


def test_driver_that_does_not_open_is_listed_as_broken(monkeypatch):
    monkeypatch.setattr(adapters, "adapters", lambda: [SimpleNamespace(name="broken", luid=b"")] * 99)
    monkeypatch.setattr(adapters.subprocess, "run", lambda *_, **__: SimpleNamespace(returncode=-11))
    assert adapters.list_devices()[0] == adapters.DeviceInfo("broken", "unknown", "", 0, ["a driver that opens"])


def test_cards_of_one_name_are_told_apart_by_number(machine):
    machine(FAST, SOFTWARE, FASTER)
    assert adapters.choose("#0") is FAST and adapters.choose("#2") is FASTER
    with pytest.raises(DeviceError, match=r"no device #3; there are 3, from #0"):
        adapters.choose("#3")
    assert [adapters.for_worker(number) for number in range(3)] == ["#0", "#2", "#0"]
    machine(FAST, SOFTWARE)
    assert adapters.for_worker(1) is None

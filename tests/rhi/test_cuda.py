"""When a device is opened for sharing with CUDA; no test here has a card."""

import sys
from types import SimpleNamespace

import pytest
import slangpy as spy

from pica.rhi import cuda, device

CARD = SimpleNamespace(name="NVIDIA Card", luid=[1] * 16)
OTHER = SimpleNamespace(name="Another Card", luid=[1] * 16)


def pytorch(cards, uuid):
    found = SimpleNamespace(
        is_available=lambda: cards > 0,
        device_count=lambda: cards,
        get_device_properties=lambda number: SimpleNamespace(uuid=uuid),
    )
    return SimpleNamespace(cuda=found)


@pytest.mark.parametrize(
    ("adapter", "torch", "wanted"),
    [
        (CARD, None, False),
        (CARD, pytorch(0, ""), False),
        (CARD, pytorch(1, "02020202-0202-0202-0202-020202020202"), True),  # the only one is it
        (CARD, pytorch(2, "01010101-0101-0101-0101-010101010101"), True),
        (CARD, pytorch(2, "02020202-0202-0202-0202-020202020202"), False),  # CUDA's first is another card
        (OTHER, pytorch(1, "01010101-0101-0101-0101-010101010101"), False),
    ],
)
def test_memory_is_shared_with_the_first_device_of_an_imported_pytorch(monkeypatch, adapter, torch, wanted):
    monkeypatch.delitem(sys.modules, "torch", raising=False)
    if torch is not None:
        monkeypatch.setitem(sys.modules, "torch", torch)
    assert cuda.is_wanted(adapter) is wanted


def test_where_sharing_fails_the_device_opens_without_it(monkeypatch):
    asked = []

    def opened(enable_cuda_interop, **_):
        asked.append(enable_cuda_interop)
        if enable_cuda_interop:
            raise RuntimeError("no CUDA driver\nmore")
        return "opened"

    monkeypatch.setattr(spy, "Device", opened)
    with pytest.warns(UserWarning, match=r"tensors go through the host \(no CUDA driver\)"):
        assert device._opened(CARD, None, share=True) == "opened"
    assert asked == [True, False]

"""Reads of device memory."""

import numpy as np
import pytest

from pica.rhi import host_memory

pytestmark = pytest.mark.device


def test_a_read_is_the_content_and_stays_so(device):
    """On devices with memory of their own; here the host sees all memory, and needs none of this."""
    reads = host_memory._Readbacks(device)
    first, second = np.arange(64, dtype=np.uint32), np.arange(64, 128, dtype=np.uint32)
    before = reads.read(device.structured("first", first))
    np.testing.assert_array_equal(reads.read(device.structured("second", second)).view(np.uint32), second)
    np.testing.assert_array_equal(before.view(np.uint32), first)


def test_memory_for_reads_is_kept_up_to_a_limit(device, monkeypatch):
    monkeypatch.setattr(host_memory, "_KEPT", 1 << 20)
    reads, before = host_memory._Readbacks(device), device.memory
    for size in [100_000 * number for number in range(1, 11)]:
        buffer = device.buffer("data", size=size)
        assert len(reads.read(buffer)) == size
        device.give_back(buffer)
    assert 1_000_000 <= device.memory - before < 1 << 20, "the newest alone, with which no other fits"
    buffer = device.buffer("data", size=2 << 20)
    assert len(reads.read(buffer)) == 2 << 20
    device.give_back(buffer)
    assert device.memory == before, "none of what is larger than all"

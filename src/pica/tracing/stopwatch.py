"""The time of one piece of work, on the device or on the processor."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

import slangpy as spy

from pica.rhi.device import Device
from pica.rhi.passes import Recording


class Stopwatch:
    """Times what is recorded by timestamps, and what the processor does by its clock."""

    def __init__(self, device: Device) -> None:
        self._pool = device.handle.create_query_pool(spy.QueryType.timestamp, 2)
        self.on_processor = False
        """Whether the processor did the newest work; to be set within the block of `timed`."""
        self._elapsed = 0.0

    @contextmanager
    def timed(self, recording: Recording) -> Iterator["Stopwatch"]:
        """Time the block, which submits nothing."""
        self._pool.reset()
        recording.encoder.write_timestamp(self._pool, 0)
        started = time.perf_counter()
        yield self
        self._elapsed = time.perf_counter() - started
        recording.encoder.write_timestamp(self._pool, 1)

    @property
    def seconds(self) -> float:
        """Of the newest work, once the device has finished it."""
        if self.on_processor:
            return self._elapsed
        first, last = self._pool.get_timestamp_results(0, 2)
        return float(last - first)

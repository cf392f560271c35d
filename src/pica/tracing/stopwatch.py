"""Times of work on a device, outside of any frame."""

import time

import slangpy as spy

from pica.rhi.device import Device
from pica.rhi.passes import Recording


class Stopwatch:
    """Times laps of a recording, each by timestamps of the device, or by the clock where the processor did its work."""

    def __init__(self, device: Device, laps: int) -> None:
        self._pool = device.handle.create_query_pool(spy.QueryType.timestamp, laps + 1)
        self._on_processor: list[float | None] = []

    def begin(self, recording: Recording) -> None:
        """Start the first lap."""
        self._pool.reset()
        recording.encoder.write_timestamp(self._pool, 0)
        self._on_processor, self._since = [], time.perf_counter()

    def lap(self, recording: Recording, on_processor: bool = False) -> None:
        """End a lap. `on_processor`: the work was done, rather than recorded."""
        now = time.perf_counter()
        self._on_processor.append(now - self._since if on_processor else None)
        self._since = now
        recording.encoder.write_timestamp(self._pool, len(self._on_processor))

    def seconds(self, lap: int) -> float:
        """Of a lap, once the device has finished it."""
        by_clock = self._on_processor[lap]
        if by_clock is not None:
            return by_clock
        first, last = self._pool.get_timestamp_results(lap, 2)
        return float(last - first)

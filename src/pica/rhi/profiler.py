"""GPU time of every pass, by name, read back when the GPU is done so that nothing waits."""

import os
from collections import defaultdict, deque
from collections.abc import Hashable
from typing import NamedTuple

import slangpy as spy

MAX_PASSES = 128
"""Timed in a view's frame."""
FRAMES_IN_FLIGHT = 3
MAX_FRAMES = 1024
_MAX_OWNERS = 1 << 16
"""Times in all that `by_owner` holds: batches of many views have thousands a frame."""
_GROUP = spy.float3(0.4, 0.6, 0.9)
_DEBUGGERS = (
    "PICA_LABELS",
    "ENABLE_VULKAN_RENDERDOC_CAPTURE",
    "RENDERDOC_CAPFILE",
    "NSIGHT_LAUNCHED",
    "NVTX_INJECTION64_PATH",
)
"""Environment variables: pica's own, and those that RenderDoc and Nsight set for child processes."""


class _Timed(NamedTuple):
    """A frame that the GPU may still be working on."""

    submission: int
    pool: int
    names: list[tuple[str, Hashable]]
    on_host: dict[tuple[str, Hashable], float]
    sizes: dict[Hashable, int]


class Profiler:
    """Timestamps around named passes. Passes of one name in one frame are added up."""

    def __init__(self, device: spy.Device) -> None:
        self._device = device
        self._labels = any(name in os.environ for name in _DEBUGGERS)
        """Whether a debugger of graphics shows the names of passes; others would pay 0.1 ms a frame for them."""
        self._enabled = device.has_feature(spy.Feature.timestamp_query)
        self._pools = [self._pool(1) for _ in range(FRAMES_IN_FLIGHT if self._enabled else 0)]
        self._pending: list[_Timed] = []
        self._free = list(range(len(self._pools)))
        self._current: int | None = None
        self._room = MAX_PASSES
        self._timing = False
        self.owner: Hashable = None
        """The owner of the passes that follow, for `by_owner`."""
        self._names: list[tuple[str, Hashable]] = []
        self._on_host: defaultdict[tuple[str, Hashable], float] = defaultdict(float)
        self._sizes: defaultdict[Hashable, int] = defaultdict(int)
        self.copied: dict[Hashable, int] = {}
        """Bytes that the newest of the finished frames has copied between devices, by owner."""
        self.by_owner: deque[dict[Hashable, float]] = deque()
        """The times of `finished`, summed by owner; fewer of frames with many owners."""
        self._owned = 0
        self.finished: deque[dict[str, float]] = deque(maxlen=MAX_FRAMES)
        """Milliseconds per pass of the frames that the GPU has finished, newest last."""

    def _pool(self, views: int) -> spy.QueryPool:
        return self._device.create_query_pool(spy.QueryType.timestamp, 2 * MAX_PASSES * views)

    def begin_frame(self, views: int = 1) -> None:
        """Start a frame of so many views; if all query pools are in use, it is not measured, instead of waiting."""
        self._collect()
        self._names, self._on_host, self._sizes, self.owner = [], defaultdict(float), defaultdict(int), None
        if self._current is None:  # otherwise the previous frame was abandoned
            self._current = self._free.pop() if self._free else None
        if self._current is not None:
            self._room = MAX_PASSES * views
            if self._pools[self._current].desc.count < 2 * self._room:
                self._pools[self._current] = self._pool(views)
            self._pools[self._current].reset()

    def begin(self, encoder: spy.CommandEncoder, name: str) -> None:
        """Start timing the commands recorded from here on; `end` follows before the next `begin`."""
        if self._labels:
            encoder.push_debug_group(name, _GROUP)
        self._timing = self._current is not None and len(self._names) < self._room
        if self._current is not None and self._timing:
            self._names.append((name, self.owner))
            encoder.write_timestamp(self._pools[self._current], 2 * len(self._names) - 2)

    def end(self, encoder: spy.CommandEncoder) -> None:
        """Stop timing."""
        if self._labels:
            encoder.pop_debug_group()
        if self._current is not None and self._timing:
            encoder.write_timestamp(self._pools[self._current], 2 * len(self._names) - 1)

    def add(self, name: str, seconds: float, size: int = 0) -> None:
        """Count processor time of work in place of a pass, and bytes that it copies between devices."""
        self._on_host[name, self.owner] += seconds * 1e3
        if size:
            self._sizes[self.owner] += size

    def end_frame(self, submission: int) -> None:
        """The frame was submitted under this id."""
        if self._current is not None:
            self._pending.append(_Timed(submission, self._current, self._names, self._on_host, self._sizes))
            self._current = None

    def flush(self) -> dict[str, float]:
        """Wait for the GPU and return the newest frame's times in milliseconds."""
        self._device.wait_for_idle()
        self._collect()
        return self.finished[-1] if self.finished else {}

    def _collect(self) -> None:
        while self._pending and self._device.is_submit_finished(self._pending[0].submission):
            _, pool, names, on_host, self.copied = self._pending.pop(0)
            self._free.append(pool)
            if not names and not on_host:
                continue
            seconds = self._pools[pool].get_timestamp_results(0, 2 * len(names)) if names else []
            times: defaultdict[str, float] = defaultdict(float)
            owners: defaultdict[Hashable, float] = defaultdict(float)
            taken = [(seconds[2 * index + 1] - seconds[2 * index]) * 1e3 for index in range(len(names))]
            for (name, owner), milliseconds in (*zip(names, taken, strict=True), *on_host.items()):
                times[name] += milliseconds
                owners[owner] += milliseconds
            self.finished.append(dict(times))
            self._keep(dict(owners))

    def _keep(self, owners: dict[Hashable, float]) -> None:
        self.by_owner.append(owners)
        self._owned += len(owners)
        while len(self.by_owner) > MAX_FRAMES or (self._owned > _MAX_OWNERS and len(self.by_owner) > 1):
            self._owned -= len(self.by_owner.popleft())

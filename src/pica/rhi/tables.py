"""Buffers that grow and are allocated in runs, so that rows can be added and removed without moving others."""

from bisect import bisect
from collections.abc import Iterable
from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.rhi.device import Device
from pica.rhi.passes import Recording

_MANY_RUNS = 8
_READ_WRITE = spy.BufferUsage.shader_resource | spy.BufferUsage.unordered_access


class Runs:
    """Allocates runs of numbers, first fit."""

    def __init__(self) -> None:
        self.end = 0
        """One more than the largest number ever handed out."""
        self._free: list[tuple[int, int]] = []

    def take(self, count: int) -> int:
        """The first of `count` consecutive free numbers."""
        for index, (first, free) in enumerate(self._free):
            if free >= count:
                if free == count:
                    del self._free[index]
                else:
                    self._free[index] = (first + count, free - count)
                return first
        self.end += count
        return self.end - count

    def give_back(self, first: int, count: int) -> None:
        """Free these numbers."""
        if not count:
            return
        place = bisect(self._free, (first, count))
        if place < len(self._free) and self._free[place][0] == first + count:
            count += self._free.pop(place)[1]
        if place and sum(self._free[place - 1]) == first:
            first, before = self._free.pop(place - 1)
            place, count = place - 1, before + count
        self._free.insert(place, (first, count))


def rows_of_runs(firsts: NDArray[np.int64], counts: NDArray[np.int64]) -> NDArray[np.int64]:
    """first, first + 1, … of each run, one after the other."""
    before = np.cumsum(counts) - counts
    return np.repeat(firsts - before, counts) + np.arange(counts.sum())


def rows_of_ranges(ranges: Iterable[range]) -> NDArray[np.int64]:
    """The numbers of ranges with step 1, range after range."""
    firsts, counts = np.array([(numbers.start, len(numbers)) for numbers in ranges], np.int64).reshape(-1, 2).T
    return rows_of_runs(firsts, counts)


class RowUpload:
    """Uploads rows to their places in a buffer: neighbours together, and many that lie apart by a shader."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._staging: tuple[spy.Buffer, spy.Buffer] | None = None

    def __call__(
        self, recording: Recording, buffer: spy.Buffer, places: NDArray[np.int64], rows: NDArray[np.void]
    ) -> None:
        """Record the upload of `rows` (n,), a multiple of 4 bytes each, to `places` (n,), which ascend."""
        raw = rows.view(np.uint8).reshape(len(rows), rows.dtype.itemsize)
        starts = np.flatnonzero(np.diff(places, prepend=-2) > 1)
        if len(starts) >= _MANY_RUNS:  # an upload costs the host more than a few rows
            self._scatter(recording, buffer, places, raw)
            return
        for start, end in zip(starts, [*starts[1:], len(rows)], strict=True):
            recording.encoder.upload_buffer_data(buffer, int(places[start]) * rows.dtype.itemsize, raw[start:end])

    def _scatter(
        self, recording: Recording, buffer: spy.Buffer, rows: NDArray[np.int64], content: NDArray[np.uint8]
    ) -> None:
        if self._staging is None or self._staging[0].size < content.nbytes:
            self._device.give_back(*(self._staging or ()))
            self._staging = (
                self._device.buffer("rows", size=2 * content.nbytes, struct_size=4),
                self._device.buffer("places of rows", size=8 * len(rows), struct_size=4),
            )
        source, places = self._staging
        recording.encoder.upload_buffer_data(source, 0, content)
        recording.encoder.upload_buffer_data(places, 0, rows.astype(np.uint32))
        words = content.nbytes // 4
        self._device.scatter(
            recording,
            (words, 1, 1),
            source=source,
            places=places,
            table=buffer,
            wordsPerRow=content.shape[1] // 4,
            wordCount=words,
        )


class HostTable:
    """Rows of a structured buffer with a copy on the host; `flush` uploads touched rows."""

    def __init__(self, device: Device, label: str, row: np.dtype[Any], usage: spy.BufferUsage = _READ_WRITE) -> None:
        self._device, self._label, self._usage = device, label, usage
        self._runs = Runs()
        self._touched = np.zeros(1, bool)
        self._quiet = True
        """Nothing has been touched since the last flush."""
        self._upload = RowUpload(device)
        self.rows: NDArray[Any] = np.zeros(1, row)
        self.buffer = device.structured(label, self.rows, usage)

    @property
    def count(self) -> int:
        """Rows in use, holes included."""
        return self._runs.end

    def take(self, count: int) -> int:
        """The first of `count` new rows, which are zero."""
        first = self._runs.take(count)
        self.reserve(first + count)
        self.touch(slice(first, first + count))
        return first

    def take_runs(self, counts: NDArray[np.int64]) -> NDArray[np.int64]:
        """As `take` for each of these counts, in one call."""
        firsts = np.array([self._runs.take(count) for count in counts.tolist()], np.int64)
        self.reserve(int((firsts + counts).max(initial=0)))
        self.touch(rows_of_runs(firsts, counts))
        return firsts

    def reserve(self, count: int) -> None:
        """Grow to `count` rows, numbered by the caller; new ones are zero."""
        if count > len(self.rows):
            more = np.zeros(max(count, 2 * len(self.rows)) - len(self.rows), self.rows.dtype)
            self.rows = np.concatenate([self.rows, more])
            self._touched = np.append(self._touched, np.zeros(len(more), bool))

    def give_back(self, first: int, count: int) -> None:
        """Free rows; they become zero."""
        self.rows[first : first + count] = 0
        self.touch(slice(first, first + count))
        self._runs.give_back(first, count)

    def touch(self, rows: NDArray[np.int64] | slice) -> None:
        """Mark rows as changed."""
        self._touched[rows] = True
        self._quiet = False

    def flush(self, recording: Recording) -> None:
        """Upload changes; a table that has outgrown its buffer gets a new one."""
        if self._quiet:
            return
        rows, self._quiet = np.flatnonzero(self._touched), True
        if not len(rows):
            return
        self._touched[rows] = False
        if self.rows.nbytes > self.buffer.size:
            self._device.give_back(self.buffer)
            self.buffer = self._device.structured(self._label, self.rows, self._usage)
        else:
            self._upload(recording, self.buffer, rows, self.rows[rows])


class GrowingBuffer:
    """Rows of a structured buffer on the device alone, numbered by the caller."""

    def __init__(self, device: Device, label: str, stride: int, usage: spy.BufferUsage = _READ_WRITE) -> None:
        self._device, self._label, self._stride, self._usage = device, label, stride, usage
        self.buffer = device.buffer(label, size=stride, struct_size=stride, usage=usage)

    def reserve(self, encoder: spy.CommandEncoder, count: int) -> None:
        """Grow to `count` rows; existing content is preserved."""
        if count * self._stride <= self.buffer.size:
            return
        old = self.buffer
        size = max(count * self._stride, 2 * old.size)
        self.buffer = self._device.buffer(self._label, size=size, struct_size=self._stride, usage=self._usage)
        self._device.give_back(old)
        encoder.copy_buffer(self.buffer, 0, old, 0, old.size)


class DeviceTable:
    """Rows of a structured buffer that lives on the device alone, handed out in runs."""

    def __init__(self, device: Device, label: str, stride: int, usage: spy.BufferUsage = _READ_WRITE) -> None:
        self._stride = stride
        self._runs = Runs()
        self._rows = GrowingBuffer(device, label, stride, usage)

    @property
    def buffer(self) -> spy.Buffer:
        """The rows; another one after the table has grown."""
        return self._rows.buffer

    def take(self, encoder: spy.CommandEncoder, rows: NDArray[Any]) -> int:
        """The first of new rows with this content."""
        count = rows.nbytes // self._stride
        first = self._runs.take(count)
        self._rows.reserve(encoder, first + count)
        content = np.require(rows, requirements=["C", "W"]).view(np.uint8).ravel()  # SlangPy takes no read-only arrays
        encoder.upload_buffer_data(self.buffer, first * self._stride, content)
        return first

    def give_back(self, first: int, count: int) -> None:
        """Free rows."""
        self._runs.give_back(first, count)

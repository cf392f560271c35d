"""Buffers that grow and are handed out in runs, so that things can come and go without moving the others."""

from typing import Any

import numpy as np
import slangpy as spy
from numpy.typing import NDArray

from pica.rhi.device import Device
from pica.rhi.passes import Recording

_MANY_RUNS = 8
_READ_WRITE = spy.BufferUsage.shader_resource | spy.BufferUsage.unordered_access


class Runs:
    """Hands out runs of numbers, first fit, and takes them back."""

    def __init__(self) -> None:
        self.end = 0
        """One more than the largest number ever handed out."""
        self._free: list[tuple[int, int]] = []

    def take(self, count: int) -> int:
        """The first of `count` consecutive numbers that nobody else has."""
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
        """These numbers are free again."""
        merged: list[tuple[int, int]] = []
        for start, length in sorted([*self._free, (first, count)]):
            if merged and merged[-1][0] + merged[-1][1] == start:
                merged[-1] = merged[-1][0], merged[-1][1] + length
            else:
                merged.append((start, length))
        self._free = [run for run in merged if run[1]]


class HostTable:
    """Rows of a structured buffer that the host keeps a copy of; what was touched is uploaded by `flush`."""

    def __init__(self, device: Device, label: str, row: np.dtype[Any], usage: spy.BufferUsage = _READ_WRITE) -> None:
        self._device, self._label, self._usage = device, label, usage
        self._runs = Runs()
        self._touched: list[NDArray[np.int64]] = []
        self._staging: tuple[spy.Buffer, spy.Buffer] | None = None
        self.rows: NDArray[Any] = np.zeros(1, row)
        self.buffer = device.structured(label, self.rows, usage)

    @property
    def count(self) -> int:
        """Rows in use, holes included."""
        return self._runs.end

    def take(self, count: int) -> int:
        """The first of `count` new rows, which are zero."""
        first = self._runs.take(count)
        if first + count > len(self.rows):
            more = np.zeros(max(first + count, 2 * len(self.rows)) - len(self.rows), self.rows.dtype)
            self.rows = np.concatenate([self.rows, more])
        self.rows[first : first + count] = 0
        self.touch(np.arange(first, first + count))
        return first

    def give_back(self, first: int, count: int) -> None:
        """Free rows; they become zero."""
        self.rows[first : first + count] = 0
        self.touch(np.arange(first, first + count))
        self._runs.give_back(first, count)

    def touch(self, rows: NDArray[np.int64]) -> None:
        """These rows have changed."""
        self._touched.append(rows)

    def flush(self, recording: Recording) -> None:
        """Upload what changed; a table that has outgrown its buffer gets a new one."""
        if not self._touched:
            return
        rows = np.unique(np.concatenate(self._touched))
        self._touched = []
        size = self.rows.dtype.itemsize
        if len(self.rows) * size > self.buffer.size:
            self._device.give_back(self.buffer)
            self.buffer = self._device.structured(self._label, self.rows, self._usage)
            return
        raw = self.rows.view(np.uint8).reshape(len(self.rows), size)
        # An upload costs the host more than a few rows: neighbours go together, and many far apart by a shader.
        splits = np.flatnonzero(np.diff(rows) > 1024 // size) + 1
        if len(splits) >= _MANY_RUNS:
            self._scatter(recording, rows, raw[rows])
            return
        for run in np.split(rows, splits):
            first, end = int(run[0]), int(run[-1]) + 1
            recording.encoder.upload_buffer_data(self.buffer, first * size, raw[first:end])

    def _scatter(self, recording: Recording, rows: NDArray[np.int64], content: NDArray[np.uint8]) -> None:
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
            table=self.buffer,
            wordsPerRow=content.shape[1] // 4,
            wordCount=words,
        )


class DeviceTable:
    """Rows of a structured buffer that lives on the device alone."""

    def __init__(self, device: Device, label: str, stride: int, usage: spy.BufferUsage = _READ_WRITE) -> None:
        self._device, self._label, self._stride, self._usage = device, label, stride, usage
        self._runs = Runs()
        self.buffer = device.buffer(label, size=stride, struct_size=stride, usage=usage)

    def take(self, encoder: spy.CommandEncoder, rows: NDArray[Any]) -> int:
        """The first of new rows with this content."""
        count = rows.nbytes // self._stride
        first = self._runs.take(count)
        self._grow(encoder, first + count)
        encoder.upload_buffer_data(self.buffer, first * self._stride, np.ascontiguousarray(rows).view(np.uint8).ravel())
        return first

    def give_back(self, first: int, count: int) -> None:
        """Free rows."""
        self._runs.give_back(first, count)

    def _grow(self, encoder: spy.CommandEncoder, count: int) -> None:
        if count * self._stride <= self.buffer.size:
            return
        old = self.buffer
        size = max(count * self._stride, 2 * old.size)
        self.buffer = self._device.buffer(self._label, size=size, struct_size=self._stride, usage=self._usage)
        encoder.copy_buffer(self.buffer, 0, old, 0, old.size)
        self._device.give_back(old)

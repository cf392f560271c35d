"""Small graphs over textures of one word a texel, replayed frame by frame."""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Any

import numpy as np
import slangpy as spy

from pica.graph.graph import FrameGraph
from pica.graph.memory import Memory
from pica.graph.plan import Plan
from pica.rhi.device import Device
from pica.rhi.passes import DeviceRecording

SIZE = (6, 4)
WORD = spy.Format.r32_uint


@dataclass
class Frame:
    """What a graph asks of a frame."""

    recording: DeviceRecording
    index: int
    requested: frozenset[str]
    variant: int = 0

    @property
    def encoder(self) -> spy.CommandEncoder:
        return self.recording.encoder

    @property
    def profiler(self) -> Any:
        return self.recording.profiler


class Frames:
    """One frame after another, by graphs that share a memory."""

    def __init__(self, device: Device) -> None:
        self.device, self.memory = device, Memory(device)
        self.index = 0

    def graph(self, size: tuple[int, int] = SIZE, requested: Collection[str] = ()) -> FrameGraph:
        return FrameGraph(self.memory, size, size, requested=frozenset(requested))

    def replay(self, plan: Plan, *names: str, only: str | None = None) -> Any:
        """What the next frame gives of these names: of one it alone."""
        with self.device.record() as recording:
            found = plan.replay(Frame(recording, self.index, frozenset(names)), only)
        self.index += 1
        assert found.keys() == set(names)
        arrays = [found[name]() for name in names]
        return arrays[0] if len(arrays) == 1 else arrays


def filling(value: int | Callable[[], int]) -> Callable[..., None]:
    """Records a fill of all textures with a number, or with what a function gives then."""

    def fill(frame: Frame, **targets: spy.Texture) -> None:
        number = value() if callable(value) else value
        for target in targets.values():
            frame.encoder.clear_texture_uint(target, clear_value=spy.uint4(number, 0, 0, 0))

    return fill


def copying(frame: Frame, source: spy.Texture, target: spy.Texture) -> None:
    """Records a copy."""
    nowhere = spy.uint3(0)
    frame.encoder.copy_texture(target, 0, 0, nowhere, source, 0, 0, nowhere)


def looking(frame: Frame, **textures: spy.Texture) -> None:
    """Records nothing: stands for a pass that reads, or leaves alone what it is given."""


def offer(graph: FrameGraph, **textures: Any) -> None:
    """By these names, as they are."""
    for name, texture in textures.items():
        graph.offer(name, (texture,), lambda values: values)


def same(values: Any, number: int | Collection[int]) -> bool:
    """Whether all texels have this number."""
    return bool((np.asarray(values) == number).all())

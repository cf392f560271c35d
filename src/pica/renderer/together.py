"""Frames of several views at once, so that neither the device nor the host waits for the other while there is work."""

import time
from collections import deque
from collections.abc import Sequence
from itertools import pairwise

from pica.frame.context import Batch, FrameContext
from pica.graph.plan import Capture, Replay
from pica.renderer.view import View
from pica.rhi.device import Device, DeviceRecording
from pica.scene.camera import Camera

_GROUP = 8
"""Frames of a submission. Fewer would be more submissions; with more the device would wait for the first one."""


class _Group:
    """Frames that are recorded together."""

    def __init__(self, recording: DeviceRecording, replays: Sequence[tuple[int, Replay]]) -> None:
        self.recording, self.replays = recording, replays
        self.submission: int | None = None

    def go_on(self, device: Device, captured: dict[int, dict[str, Capture]]) -> bool:
        """Record until all its frames wait for the device or are complete; False in the second case."""
        seconds = None
        if self.submission is not None:
            started = time.perf_counter()
            device.handle.wait_for_submit(self.submission)
            seconds = (time.perf_counter() - started) / len(self.replays)
        waiting = []
        for number, replay in self.replays:
            try:
                replay.send(seconds)
                waiting.append((number, replay))
            except StopIteration as end:
                captured[number] = end.value
        self.replays = waiting
        return bool(waiting)


def begin_together(
    device: Device, views: Sequence[View], cameras: Sequence[Camera], wait: bool, jittered: bool
) -> list[FrameContext]:
    """A frame of each view, in which the scene is up to date, all in one recording. `wait`: as SceneView.sync."""
    for view in views:
        view.scene.sync(wait)  # may raise an error, before anything is recorded
    batch = Batch(device, len(views))
    frames = [view.begin(camera, batch, jittered) for view, camera in zip(views, cameras, strict=True)]
    for view in views[:-1]:
        view.scene.bind()  # views after it may have moved what all share to larger buffers
    return frames


def replay_together(
    device: Device, frames: Sequence[FrameContext], replays: Sequence[Replay]
) -> list[dict[str, Capture]]:
    """Record frames of as many views, by Plan.replay_in_parts. Returns their captures.

    They share one recording up to here, and at the end: its last part, in that of the first frame, is yet to be
    submitted. In between, some are submitted while others are recorded, or traced by the processor.
    """
    count = _groups(len(frames))
    bounds = [len(frames) * number // count for number in range(count + 1)]
    numbered, first = list(enumerate(replays)), frames[0]
    groups = deque[_Group]()
    for start, end in pairwise(bounds):
        recording = first.recording
        if start:
            recording = DeviceRecording(device.handle.create_command_encoder(), device.profiler)
            for frame in frames[start:end]:
                frame.recording = recording
        groups.append(_Group(recording, numbered[start:end]))
    captured: dict[int, dict[str, Capture]] = {}
    while groups:
        group = groups.popleft()
        if group.go_on(device, captured):
            groups.append(group)
        if groups:
            group.submission = device.submit(group.recording)
        else:
            first.recording.encoder = group.recording.encoder
    return [captured[number] for number in range(len(frames))]


def _groups(frames: int) -> int:
    """Into how many groups frames are split: two at least."""
    return min(frames, max(2, -(-frames // _GROUP)))

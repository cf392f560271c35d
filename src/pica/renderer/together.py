"""Frames of several views at once, so that neither the device nor the host waits for the other while there is work."""

import time
from collections import deque
from collections.abc import Sequence

from pica.frame.context import Batch, FrameContext
from pica.graph.plan import Capture, Plan, Replay
from pica.many_views.merged_plans import MergedFrames
from pica.renderer.view import View
from pica.rhi.device import Device
from pica.rhi.passes import DeviceRecording
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
            device.submissions.wait(self.submission)
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
    device: Device,
    views: Sequence[View],
    cameras: Sequence[Camera],
    wait: bool,
    jittered: bool,
    merged: MergedFrames | None = None,
) -> list[FrameContext]:
    """A frame of each view, in which the scene is up to date, all in one recording. `wait`: as SceneView.sync."""
    for view in {id(view.scene.scene): view for view in views}.values():
        view.sync(wait)  # may raise an error, before anything is recorded
    batch = Batch(device, len(views))
    frames = [views[0].begin(cameras[0], batch, jittered)]
    for view, camera in zip(views[1:], cameras[1:], strict=True):
        frames.append(view.begin(camera, batch, jittered, follows=merged is not None and _share_scene(views[0], view)))
    if merged is None:
        _bind(views[:-1])
    return frames


def replay_together(
    device: Device,
    views: Sequence[View],
    frames: Sequence[FrameContext],
    plans: Sequence[Plan],
    merged: MergedFrames | None = None,
    only: str | None = None,
) -> list[dict[str, Capture]]:
    """Record a frame of each view by its plan. Returns their captures. `merged`: records them together where it can.
    `only`: as Plan.replay.

    Frames share one recording up to here, and at the end: its last part, in that of the first frame, is yet to be
    submitted. In between, some are submitted while others are recorded, or traced by the processor.
    """
    if merged is not None:
        if merged.takes(plans) and all(_share_scene(views[0], view) for view in views):
            return merged.replay(plans, frames, only)
        _bind(views)
        merged.stop()
    replays = [plan.replay_in_parts(frame, only) for plan, frame in zip(plans, frames, strict=True)]
    captured: dict[int, dict[str, Capture]] = {}
    for leads in (True, False):
        numbers = [number for number, view in enumerate(views) if (view.leader is None) == leads]
        _replay(device, frames, replays, numbers, captured)
    return [captured[number] for number in range(len(views))]


def _share_scene(first: View, view: View) -> bool:
    """Whether both see the same of one scene: nothing in it faces their cameras."""
    return view.scene.scene is first.scene.scene and first.scene.own.is_empty and view.scene.own.is_empty


def _bind(views: Sequence[View]) -> None:
    """Views after one may have moved what all share to larger buffers."""
    for view in views:
        view.scene.bind()


def _replay(
    device: Device,
    frames: Sequence[FrameContext],
    replays: Sequence[Replay],
    numbers: Sequence[int],
    captured: dict[int, dict[str, Capture]],
) -> None:
    """Record the frames of these numbers."""
    count, first = _groups(len(numbers)), frames[0].recording
    groups = deque[_Group]()
    for group in range(count):
        members = numbers[len(numbers) * group // count : len(numbers) * (group + 1) // count]
        recording = first if group == 0 else DeviceRecording(device.handle.create_command_encoder(), device.profiler)
        for number in members:
            frames[number].recording = recording
        groups.append(_Group(recording, [(number, replays[number]) for number in members]))
    while groups:
        recorded = groups.popleft()
        if recorded.go_on(device, captured):
            groups.append(recorded)
        if groups:
            recorded.submission = device.submit(recorded.recording)
        else:
            first.encoder = recorded.recording.encoder


def _groups(frames: int) -> int:
    """Into how many groups frames are split: two at least."""
    return min(frames, max(2, -(-frames // _GROUP)))

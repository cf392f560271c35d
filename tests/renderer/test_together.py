"""The order in which frames of several views are recorded and submitted, without a device."""

import time
from types import SimpleNamespace

import pytest

from pica.renderer.together import replay_together
from pica.rhi.passes import DeviceRecording

_WAIT = 0.02


class FakeDevice:
    """Notes submissions; each takes a while."""

    def __init__(self, notes):
        self.handle, self.submissions, self.profiler, self._notes = self, self, None, notes

    def create_command_encoder(self):
        return object()

    def submit(self, recording):
        self._notes.append("submit")
        recording.encoder = object()
        return len(self._notes)

    def wait(self, submission):
        time.sleep(_WAIT)


def run(leaders, bounces=1):
    """What is noted of frames that wait `bounces` times each, the seconds that they are sent, and their results."""
    notes, sent, recordings = [], [], []

    def replay(number):
        for _ in range(bounces):
            notes.append(number)
            recordings.append(frames[number].recording)
            sent.append((yield))
        notes.append(f"end {number}")
        return {str(number): number}

    views = [SimpleNamespace(leader=leader) for leader in leaders]
    first = DeviceRecording(object(), None)
    frames = [SimpleNamespace(recording=first) for _ in views]
    plans = [SimpleNamespace(replay_in_parts=lambda frame, only, of=number: replay(of)) for number in range(len(views))]
    captured = replay_together(FakeDevice(notes), views, frames, plans)
    assert captured == [{str(number): number} for number in range(len(views))]
    return notes, sent, recordings


def test_groups_are_submitted_while_others_are_recorded():
    notes, _, recordings = run([None] * 4)
    assert notes == [0, 1, "submit", 2, 3, "submit", "end 0", "end 1", "submit", "end 2", "end 3"]
    assert recordings[0] is recordings[1] is not recordings[2] is recordings[3]


def test_followers_begin_when_their_leaders_have_ended():
    notes, *_ = run([None, "first", "first", None], bounces=2)
    followers = [index for index, note in enumerate(notes) if note in (1, 2)]
    assert min(followers) > max(notes.index("end 0"), notes.index("end 3"))


def test_a_frame_alone_is_submitted_between_its_parts_only():
    notes, *_ = run([None], bounces=2)
    assert notes == [0, "submit", 0, "submit", "end 0"]


@pytest.mark.parametrize("count", [1, 8, 20])
def test_a_wait_is_shared_out_among_those_that_wait(count):
    _, sent, _ = run([None] * count)
    groups = min(count, max(2, -(-count // 8)))
    assert len(sent) == count and groups * _WAIT <= sum(sent) < 2 * groups * _WAIT

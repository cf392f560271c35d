from collections import deque
from types import SimpleNamespace

import pytest

from pica.graph.plan import PlanPart
from pica.quality.benchmark import benchmark


class Renderer:
    """Counts its frames; each takes a millisecond."""

    size = (8, 4)
    host_seconds = 0.001
    effects = ()

    def __init__(self, is_software):
        self.finished = deque()
        self.by_owner = deque(maxlen=1024)
        profiler = SimpleNamespace(finished=self.finished, by_owner=self.by_owner, flush=lambda: None)
        self.device = SimpleNamespace(is_software=is_software, profiler=profiler, peak_memory=7)

        passes = [SimpleNamespace(name="shadow_rays", effect="shadows")]
        passes += [SimpleNamespace(name=f"{name}_rays", effect="reflections") for name in ("reflection", "more")]
        self.graph = SimpleNamespace(passes=passes, memory={"shadows": 64})
        self.cameras = []

    def advance(self, camera):
        self.cameras.append(camera)
        number = len(self.by_owner)
        self.finished.append({"lighting": 1.0 + number, "embree": 2.0, "skinning": 0.5})
        lighting = PlanPart(1, "lighting", 3)
        self.by_owner.append({lighting: 1.0 + number, PlanPart(1, "lighting", 4): 2.0, None: 0.5})

    def count_rays(self, camera):
        self.cameras.append(camera)
        return {"shadow_rays": 32, "reflection_rays": 8, "more_rays": 2}


@pytest.mark.parametrize(
    ("is_software", "asked", "frames", "warm_up"),
    [
        (False, {}, 200, 50),
        (True, {}, 20, 3),
        (True, {"frames": 5}, 5, 3),
        (True, {"warm_up": 0}, 20, 0),
        (False, {"frames": 5, "warm_up": 2}, 5, 2),
    ],
)
def test_fewer_frames_on_the_processor_and_each_is_told(is_software, asked, frames, warm_up):
    renderer, told = Renderer(is_software), []
    result = benchmark(renderer, camera="any", progress=lambda *counts: told.append(counts), **asked)
    assert (result["frames"], result["warm_up"]) == (frames, warm_up)
    assert len(renderer.finished) == frames
    assert told == [(done + 1, frames + warm_up) for done in range(frames + warm_up)]
    assert result["rays"] == {"shadow_rays": 32, "reflection_rays": 8, "more_rays": 2}
    assert result["effect_rays"] == {"shadows": 32, "reflections": 10}
    assert result["effect_bytes"] == {"shadows": 64}


def test_times_by_effect_are_medians_of_the_measured_frames():
    result = benchmark(Renderer(True), camera="any", frames=3, warm_up=2)
    assert result["effect_ms"] == {"lighting": 3.0 + 1.0 + 2.0, "scene": 0.5}
    assert result["gpu_ms"]["frame"] == sum(result["effect_ms"].values())


def test_rays_are_counted_in_one_more_frame_of_the_sequence():
    renderer = Renderer(True)
    benchmark(renderer, frames=3, warm_up=2, play=lambda frame: f"camera {frame}")
    assert renderer.cameras == [f"camera {frame}" for frame in range(6)]

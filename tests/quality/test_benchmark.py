from collections import deque
from types import SimpleNamespace

import pytest

from pica.quality.benchmark import benchmark


class Renderer:
    """Counts its frames; each takes a millisecond."""

    size = (8, 4)
    host_seconds = 0.001
    effects = ()

    def __init__(self, is_software):
        self.finished = deque()
        profiler = SimpleNamespace(finished=self.finished, flush=lambda: None)
        self.device = SimpleNamespace(is_software=is_software, profiler=profiler, peak_memory=7)

    def advance(self, camera):
        self.finished.append({"lighting": 1.0})

    def count_rays(self, camera):
        return {"shadow_rays": 32, "reflection_rays": 8}


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
    assert result["rays"] == {"shadow_rays": 32, "reflection_rays": 8}

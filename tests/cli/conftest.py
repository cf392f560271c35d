"""A renderer that answers at once, so that the command line is tested without a device."""

from types import SimpleNamespace

import numpy as np
import pytest

import pica
from pica.cli.main import main
from pica.images.output import Frame
from pica.scene.camera import Camera


def fake_frame(width, height, level=0.5):
    def color():
        return np.full((height, width, 3), level, np.float32)

    aovs = {
        "depth": lambda: np.ones((height, width), np.float32),
        "normal": lambda: np.ones((height, width, 3), np.float32),
    }
    display = np.full((height, width, 3), round(255 * level), np.uint8)
    return Frame((width, height), color, lambda: display, aovs, {"gbuffer": 1.5})


def fake_benchmark(renderer, camera=None, frames=None, warm_up=None, progress=None, play=None):
    progress(1, 1)
    asked = {"camera": camera, "frames": frames, "warm_up": warm_up, "play": play}
    FakeRenderer.calls.append(SimpleNamespace(**vars(renderer.asked), **asked))
    frame = 0.5 if play is None else 0.75
    rays = {"shadow_rays": 7} if play is None else {"shadow_rays": 8, "surfel_rays": 9}
    return {
        "frames": frames or 20,
        "gpu_ms": {"gbuffer": frame, "frame": frame},
        "host_ms": 0.25,
        "rays": rays,
        "peak_gpu_memory": 5,
    }


def fake_path_traced_sample(renderer, frame_ms, camera=None, progress=None):
    progress(5, 5)
    return {"samples": 3, "sample_ms": 2 * frame_ms, "frame_over_sample": 0.5}


class FakeRenderer:
    """Stands for Renderer and PathTracer; `calls` tells what was asked."""

    calls: list[SimpleNamespace] = []  # noqa: RUF012
    error: BaseException | None = None
    device_name = "fake device"

    def __init__(
        self, scene, *, size, settings=None, device=None, devices=None, max_depth=None, light_map=None, lut=None
    ):
        if device == "nothing":
            raise pica.errors.DeviceError("no device named 'nothing'")
        self.scene, self.size, self.settings = scene, size, settings
        self.device = f"opened {device}"
        asked = {"scene": scene, "size": size, "settings": settings, "device": device, "max_depth": max_depth}
        self.asked = SimpleNamespace(**asked, devices=devices, light_map=light_map)

    def reset(self, frame=0):
        pass

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def render(self, frames=16, *, camera=None, progress=None, denoise=False, aovs=None, seconds=None):
        return self._answer(camera, progress, frames, frames=frames, denoise=denoise)

    def _answer(self, camera, progress, count, **counts):
        if FakeRenderer.error is not None:
            raise FakeRenderer.error
        if progress is not None:
            progress(count, count)
        FakeRenderer.calls.append(SimpleNamespace(**vars(self.asked), **counts, camera=camera))
        return fake_frame(*self.size)


class FakePathTracer(FakeRenderer):
    def __init__(self, scene, *, size, max_depth=None, settings=None, device=None, devices=None, lut=None):
        super().__init__(scene, size=size, settings=settings, device=device, devices=devices, max_depth=max_depth)

    def render(self, samples=1024, *, camera=None, progress=None, denoise=False, aovs=None):
        return self._answer(camera, progress, samples, samples=samples, denoise=denoise)


@pytest.fixture
def calls(monkeypatch):
    """Replace the renderers and the loader, which are not even imported; what they were asked to render."""
    side = Camera.look_at((1, 0, 0), (0, 0, 0), name="side")

    class Fake(pica.Scene):
        def cameras(self):
            return [side]

    scene = Fake("fake")
    monkeypatch.setitem(vars(pica), "load", lambda path, *, environment=None, **_: scene)
    monkeypatch.setitem(vars(pica), "Renderer", FakeRenderer)
    monkeypatch.setitem(vars(pica), "PathTracer", FakePathTracer)
    monkeypatch.setattr("pica.quality.benchmark.benchmark", fake_benchmark)
    monkeypatch.setattr("pica.quality.benchmark.path_traced_sample", fake_path_traced_sample)
    monkeypatch.setattr(FakeRenderer, "calls", [])
    monkeypatch.setattr(FakeRenderer, "error", None)
    return FakeRenderer.calls


@pytest.fixture
def run(capsys):
    """Run the command line in this process: (exit code, stdout, stderr)."""

    def call(*arguments):
        code = main([str(argument) for argument in arguments])
        said = capsys.readouterr()
        return code, said.out, said.err

    return call

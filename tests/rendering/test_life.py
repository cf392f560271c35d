"""Renderers come and go, in many threads: nothing stays behind, and nobody disturbs another."""

import gc
import os
import threading
import time
import weakref

import numpy as np
import pytest

import pica
from pica.errors import DeviceError, PicaError
from pica.programs.library import programs
from pica.rhi.device import Device, open_device
from pica.scene import scene_gc
from tests.building import CAMERA, still_life
from tests.scene.gltf_files import GltfFile

RASTER = pica.Settings.preset("raster")
SIZE = (24, 16)


@pytest.mark.parametrize("just_collected", [False, True])
def test_renderers_that_are_dropped_leave_nothing(device, tmp_path, monkeypatch, just_collected):
    """Not on the device, no thread, no open file; and of the scenes nothing once the next one comes."""
    monkeypatch.setattr(scene_gc, "_due", time.monotonic() + 3600 * just_collected)
    file = GltfFile()
    file.mesh(node={"children": [1]})
    file.mesh()
    path = file.write(tmp_path)
    # Compilers leave circles that hold who called them.
    pica.Renderer(pica.load(path), size=SIZE, settings=RASTER).render(2)
    gc.collect()
    gc.disable()
    try:
        scenes, left = [], []
        for _ in range(4):
            scene = pica.load(path, environment=pica.Environment(np.ones((2, 4, 3), np.float32)))
            assert not any(other() for other in scenes)
            scenes = [weakref.ref(each) for each in (scene, scene.roots[0], scene.roots[0].mesh)]
            renderer = pica.Renderer(scene, size=SIZE, settings=RASTER)
            assert renderer.device is device
            assert renderer.render(2).display.any()
            renderer = weakref.ref(renderer)
            assert renderer() is None
            files = len(os.listdir("/proc/self/fd")) if os.path.isdir("/proc/self/fd") else 0
            left.append((device.memory, threading.active_count(), files))
            del scene
    finally:
        gc.enable()
    assert len(set(left[1:])) == 1, left


def test_scenes_that_are_only_loaded_go_too(tmp_path):
    file = GltfFile()
    file.mesh(node={"children": [1]})
    file.mesh()
    path = file.write(tmp_path)
    gc.disable()
    try:
        for _ in range(3):
            scene = pica.load(path, environment=pica.Environment(np.ones((2, 4, 3), np.float32)))
            root = weakref.ref(scene.roots[0])
            del scene
            assert root() is not None, "a circle"
            pica.load(path, environment=pica.Environment(np.ones((2, 4, 3), np.float32)))
            assert root() is None
    finally:
        gc.enable()


def test_renderers_in_threads_take_turns(device):
    """Frame by frame, and give what they give alone."""
    alone = pica.Renderer(still_life(), size=SIZE, settings=RASTER).render(6, camera=CAMERA)
    log, found, start = [], {}, threading.Barrier(3)

    def work(name):
        start.wait()
        with pica.Renderer(still_life(), size=SIZE, settings=RASTER) as renderer:
            frame = renderer.render(6, camera=CAMERA, progress=lambda done, frames: log.append(name))
        found[name] = frame.color, frame.timings

    threads = [threading.Thread(target=work, args=(name,)) for name in "abc"]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(200)
    assert sorted(found) == ["a", "b", "c"]
    for color, timings in found.values():
        np.testing.assert_array_equal(color, alone.color)
        assert timings.keys() == alone.timings.keys()
    assert "".join(sorted(log)) == 6 * "a" + 6 * "b" + 6 * "c" != "".join(log)


def test_threads_that_share_a_renderer_use_it_one_after_the_other(device):
    renderer = pica.Renderer(still_life(), size=SIZE, settings=RASTER)
    log, found = [], []

    def work(name):
        found.append(renderer.render(4, camera=CAMERA, progress=lambda done, frames: log.append(name)))

    threads = [threading.Thread(target=work, args=(name,)) for name in "ab"]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(200)
    assert len(found) == 2 and "".join(log) in ("aaaabbbb", "bbbbaaaa")


@pytest.mark.parametrize("kind", [pica.Renderer, pica.PathTracer])
def test_who_waits_for_a_renderer_that_is_closed_is_told(device, kind):
    renderer = kind(still_life(), size=SIZE, settings=RASTER)
    told = []

    def work():
        try:
            renderer.render(1, camera=CAMERA)
        except PicaError as error:
            told.append(str(error))

    def in_between(done, frames):
        if done == 1:
            thread.start()
        if done == frames:
            renderer.close()

    thread = threading.Thread(target=work)
    frame = renderer.render(3, camera=CAMERA, progress=in_between)
    thread.join(100)
    assert frame.color.shape == (16, 24, 3), "what was rendered stays"
    assert told == [f"{kind.__name__}: it is closed; make another one"]


def test_dropping_in_the_midst_of_a_frame_waits_for_its_end(device):
    """As when Python's collector finds something there, or another thread drops it."""
    scene = still_life()
    first, second = (pica.Renderer(scene, size=SIZE, settings=RASTER) for _ in range(2))
    first.render(1, camera=CAMERA)
    view, own = second.view.scene, second.view.own
    closed, close = [], own.close
    own.close = lambda: (closed.append(True), close())
    second.view._finalizer.detach()
    weakref.finalize(second.view, device.lock.defer, own.close)
    with device.lock:
        dropped = [second]
        del second
        thread = threading.Thread(target=dropped.clear)
        thread.start()
        thread.join(30)
        assert not thread.is_alive() and not closed
    assert closed and view is first.view.scene


@pytest.mark.device
def test_a_device_that_is_closed_says_so():
    mine = Device()
    assert mine is not open_device()
    scene = still_life()
    renderer = pica.Renderer(scene, size=SIZE, settings=RASTER, device=mine)
    frame, unread = renderer.render(1, camera=CAMERA), renderer.render(1, camera=CAMERA)
    assert frame.color.shape == (16, 24, 3)
    ended = []
    mine.handle.register_device_close_callback(ended.append)
    mine.close()
    mine.close()
    assert mine.closed and len(ended) == 1
    calls = (
        lambda: renderer.render(1, camera=CAMERA),
        lambda: renderer.advance(CAMERA),
        lambda: renderer.resize((8, 8)),
        lambda: renderer.configure(RASTER),
        lambda: unread.color,
        lambda: pica.Renderer(scene, size=SIZE, settings=RASTER, device=mine),
    )
    for call in calls:
        with pytest.raises(DeviceError, match=r"device .*: it is closed"):
            call()
    assert frame.color.shape == (16, 24, 3)
    with renderer:
        pass
    assert renderer.closed
    pica.Renderer(scene, size=SIZE, settings=RASTER).render(1, camera=CAMERA)


@pytest.mark.device
def test_the_shared_device_can_be_closed_and_opens_again(monkeypatch):
    monkeypatch.setattr("pica.rhi.device._OPEN", {})
    before = open_device()
    assert before is open_device()
    before.memory_scope().close()
    with open_device().lock:
        after = open_device()
    assert before.closed and after is not before and after is open_device() and not after.closed
    after.close()


@pytest.mark.device
def test_a_device_goes_when_it_is_dropped():
    mine, ended = Device(), []
    mine.at_close(lambda: ended.append("library"))
    mine.handle.register_device_close_callback(lambda _: ended.append("device"))
    mine.compute("path_tracer/average.slang")
    programs(mine)
    del mine
    gc.collect()
    assert ended == ["library", "device"]

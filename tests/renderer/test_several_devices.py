"""Frames whose rays several devices trace: the same bits as one device's."""

import gc
import os
import subprocess
import sys
import threading

import numpy as np
import pytest

import pica
from pica.errors import DeviceError, PicaError, SettingsError
from pica.rhi.device import Device
from pica.rhi.fair_lock import SeveralLocks
from pica.scene.camera import Camera
from pica.scene.light import PointLight
from pica.scene.material import Material
from pica.scene.sheen import Sheen
from pica.scenes.basic_meshes import box, sphere
from pica.scenes.placing import move, rotate
from pica.settings import PRESETS
from pica.tracing import balance, embree, shared_tracer
from pica.tracing.balance import Balance
from tests.building import lambert, placed, settings, shining, still_life
from tests.gpu_scene.edits import glass, named
from tests.gpu_scene.test_dynamic_geometry import CAMERA, zoo

SIZE = (48, 32)
DEVICE = {"rays.scheduler": "buffers", "rays.tracer": "device"}
EMBREE = {"rays.scheduler": "buffers", "rays.tracer": "embree"}
TRACERS = [DEVICE] if embree.missing() else [DEVICE, EMBREE]
UNDEFINED = "debug.translucency.maps", "debug.reflections.of_image"
"""In parts that nothing reads."""


@pytest.fixture(scope="module")
def second(device):
    """Another logical device on the same adapter."""
    own = Device(device.name)
    yield own
    own.close()


@pytest.fixture(autouse=True)
def _every_ray_is_shared(monkeypatch):
    """However few there are, and although one processor is both devices."""
    monkeypatch.setattr(shared_tracer, "FEWEST", 1)
    monkeypatch.setattr(balance, "TRIAL", sys.maxsize)


def camera(step: int) -> Camera:
    return Camera.look_at((0.4 + 0.05 * step, 1.5, 3.4), (0.1, 0.4, 0), vertical_fov=np.radians(42))


def lively() -> pica.Scene:
    """A still life with glass, wax and a lamp."""
    scene = still_life()
    wax = Material(base_color=(0.9, 0.8, 0.7, 1), diffuse_transmission=0.8, scattering=(60.0, 40.0, 30.0))
    scene.add(placed(sphere(0.25, glass()), move(0.3, 0.5, 1.2), "glass"))
    scene.add(placed(box(0.3, wax), move(-0.3, 0.16, 0.9), "wax"))
    scene.add(shining(PointLight(intensity=3.0, radius=0.1), move(-1, 1.2, 1)))
    return scene


def stir(scene: pica.Scene, step: int) -> None:
    """Move an object, a lamp and a light."""
    named(scene, "ball").transform = move(-0.9 + 0.05 * step, 0.5, 0.02 * step)
    named(scene, "mask").transform = move(0.9, 0.5, 0.4) @ rotate("x", 70) @ rotate("y", 20 + 5 * step)
    named(scene, "glow").transform = move(-0.3, 1.6 - 0.04 * step, -0.9) @ rotate("x", 110)


def tracer_of(renderer: pica.Renderer) -> shared_tracer.SharedTracer:
    assert isinstance(renderer.tracer, shared_tracer.SharedTracer)
    return renderer.tracer


def assert_same(alone: pica.Frame, shared: pica.Frame, what: object) -> None:
    assert alone.aov_names == shared.aov_names
    surfaces = np.isfinite(alone.aov("depth"))
    for name in alone.aov_names:
        if name in UNDEFINED:
            continue
        expected, found = alone.aov(name), shared.aov(name)
        if name.startswith("debug.") and found.shape[:2] == surfaces.shape:  # of the background they are undefined
            expected, found = expected[surfaces], found[surfaces]
        np.testing.assert_array_equal(found, expected, err_msg=f"{name}, {what}")
    np.testing.assert_array_equal(alone.color, shared.color)
    np.testing.assert_array_equal(alone.display, shared.display)


def compare(device, second, chosen: pica.Settings, scene=None, steps: int = 4) -> pica.Frame:
    """Frames of a moving scene, with all buffers of all effects."""
    scene = scene or lively()
    with (
        pica.Renderer(scene, size=SIZE, settings=chosen, device=device) as alone,
        pica.Renderer(scene, size=SIZE, settings=chosen, devices=[device, second]) as shared,
    ):
        alone.debug = shared.debug = True
        for step in range(steps):
            stir(scene, step)
            expected, found = (renderer.render(1, camera=camera(step)) for renderer in (alone, shared))
            assert_same(expected, found, step)
        return found


@pytest.mark.parametrize("tracer", TRACERS, ids=lambda values: values["rays.tracer"])
@pytest.mark.parametrize("preset", [name for name in PRESETS if name not in ("raster", "pica_pica")])
def test_every_buffer_of_every_preset_is_that_of_one_device(device, second, preset, tracer):
    found = compare(device, second, pica.Settings.preset(preset).with_values(tracer))
    assert found.color.mean() > 0.1 and found.timings["trace_rays on secondary 1"] > 0


@pytest.mark.parametrize(
    "tracer",
    [pytest.param(values, marks=pytest.mark.slow if values is DEVICE else ()) for values in TRACERS],
    ids=lambda values: values["rays.tracer"],
)
def test_surfels_are_those_of_one_device(device, tracer):
    """On one thread of lavapipe: on several, surfels are born in another order each time."""
    run = "import sys, tests.renderer.test_several_devices as tests; tests.compare_alone(*sys.argv[1:])"
    arguments = [sys.executable, "-c", run, device.name, "pica_pica", tracer["rays.tracer"]]
    subprocess.run(arguments, env=os.environ | {"LP_NUM_THREADS": "1"}, check=True, timeout=300)


def compare_alone(name: str, preset: str, tracer: str) -> None:
    """What a process for one comparison runs."""
    shared_tracer.FEWEST, balance.TRIAL = 1, sys.maxsize
    chosen = pica.Settings.preset(preset).with_values({"rays.scheduler": "buffers", "rays.tracer": tracer})
    found = compare(Device(name), Device(name), chosen)
    assert found.timings["trace_rays on secondary 1"] > 0


EFFECTS = {
    "primary rays": {"visibility.primary": "rays"},
    "hard shadows": {"shadows.mode": "hard", "shadows.max_lights": 8},
    "occlusion": {"ambient_occlusion.mode": "ray_traced", "ambient_occlusion.rays": 4},
    "restir": {"global_illumination.mode": "restir"},
    "no translucency": {"translucency.mode": "off", "reflections.bounces": 3},
}


@pytest.mark.parametrize("values", EFFECTS.values(), ids=EFFECTS)
def test_every_effect_is_that_of_one_device(device, second, values):
    compare(device, second, pica.Settings().with_values(TRACERS[-1] | values), steps=3)


@pytest.mark.parametrize("tracer", TRACERS, ids=lambda values: values["rays.tracer"])
def test_what_comes_goes_and_deforms_is_that_of_one_device(device, second, tracer):
    """Copies of a scene that are of different age number its records differently."""
    scene, kinds = zoo()
    chosen = pica.Settings().with_values(tracer | {"visibility.primary": "rays"})
    visitors, numbered = [], []

    def come_and_go(step: int) -> None:
        visitors.append(scene.add(placed(box(0.3, lambert(0.8, 0.2, 0.1)), move(0.3 * step - 1, 1, 0.5))))
        if step % 2:
            scene.remove(visitors.pop(0))

    with pica.Renderer(scene, size=SIZE, settings=chosen, device=device) as older:
        for step in range(4):
            come_and_go(step)
            older.labels(camera=CAMERA)
        with (
            pica.Renderer(scene, size=SIZE, settings=chosen, device=device) as alone,
            pica.Renderer(scene, size=SIZE, settings=chosen, devices=[device, second]) as shared,
        ):
            for step in range(8):
                come_and_go(step)
                kinds[step % len(kinds)].at(0.3 * step)
                expected, found = (renderer.render(1, camera=camera(step)) for renderer in (alone, shared))
                assert_same(expected, found, step)
                numbered.append(tracer_of(shared).secondaries[0]._numbers[1])
    assert all(numbers is not None for numbers in numbered)


def test_resized_and_configured_it_goes_on_as_one_device(device, second):
    scene, chosen = lively(), pica.Settings().with_values(DEVICE | {"visibility.primary": "rays"})
    with (
        pica.Renderer(scene, size=SIZE, settings=chosen, device=device) as alone,
        pica.Renderer(scene, size=SIZE, settings=chosen, devices=[device, second]) as shared,
    ):
        changes = [
            lambda renderer: renderer.resize((40, 20)),
            lambda renderer: renderer.configure(chosen.with_values({"shadows.transparent": False})),
            lambda renderer: renderer.configure(chosen.with_values(TRACERS[-1])),
            lambda renderer: renderer.resize(SIZE),
            lambda renderer: renderer.reset(frame=9),
        ]
        for step, change in enumerate(changes):
            for renderer in (alone, shared):
                change(renderer)
            stir(scene, step)
            assert_same(*(renderer.render(2, camera=camera(step)) for renderer in (alone, shared)), step)


def test_memory_of_both_stays(device, second):
    scene, chosen = lively(), pica.Settings().with_values(TRACERS[-1])
    pica.Renderer(lively(), size=SIZE, settings=chosen, devices=[device, second]).close()
    gc.collect()
    before = second.memory
    with pica.Renderer(scene, size=SIZE, settings=chosen, devices=[device, second]) as shared:
        memory = []
        for step in range(60):
            visitor = scene.add(placed(sphere(0.2, lambert(0.8)), move(0.02 * step, 1, 0)))
            stir(scene, step % 5)
            if step % 10 == 5:
                shared.resize((40, 20) if step % 20 == 5 else SIZE)
            shared.advance(camera(step % 7))
            scene.remove(visitor)
            memory.append((device.memory, second.memory))
        assert memory[-1] == memory[39] and memory[-1][1] > before
    del shared, visitor
    gc.collect()
    assert second.memory == before


def test_a_device_that_fails_is_named_and_the_next_picture_is_whole(device, second, monkeypatch):
    scene, chosen = lively(), pica.Settings().with_values(TRACERS[-1])
    with pica.Renderer(scene, size=SIZE, settings=chosen, devices=[device, second]) as shared:
        expected = shared.render(2, camera=camera(0))
        shared.render(2, camera=camera(1))
        with monkeypatch.context() as patch:
            patch.setattr(tracer_of(shared).secondaries[0], "_tracer", lambda recording, queue: 1 / 0)
            with pytest.raises(
                DeviceError, match=r"^secondary device 1 \('llvmpipe.* failed while it traced rays .*: div"
            ):
                shared.render(2, camera=camera(2))
        assert_same(expected, shared.render(2, camera=camera(0)), "the frame after")


def test_a_device_that_misses_a_change_of_the_scene_makes_no_picture(device, second, monkeypatch):
    scene, chosen = lively(), pica.Settings().with_values(TRACERS[-1])
    with pica.Renderer(scene, size=SIZE, settings=chosen, devices=[device, second]) as shared:
        shared.render(1, camera=camera(0))
        stir(scene, 1)
        with monkeypatch.context() as patch:
            patch.setattr(tracer_of(shared).secondaries[0].scene, "update", lambda recording, camera: 1 / 0)
            with pytest.raises(DeviceError, match="failed while it took over a change of the scene: division"):
                shared.render(1, camera=camera(0))
        with pytest.raises(DeviceError, match="failed while it took over a change of the scene: division"):
            shared.render(1, camera=camera(0))


def test_three_devices_make_the_picture_of_one(device, second):
    third = Device(device.name)
    scene, chosen = lively(), pica.Settings().with_values(TRACERS[-1])
    with (
        pica.Renderer(scene, size=SIZE, settings=chosen, device=device) as alone,
        pica.Renderer(scene, size=SIZE, settings=chosen, devices=[device, second, third]) as shared,
    ):
        for step in range(3):
            stir(scene, step)
            pictures = [renderer.render(1, camera=camera(step)) for renderer in (alone, shared)]
            assert_same(*pictures, step)
    assert pictures[1].timings["trace_rays on secondary 2"] > 0
    third.close()


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_two_thousand_frames_end_with_the_picture_of_one_device(device, second):
    """Objects come and go, and size and settings change."""
    scene, chosen = lively(), pica.Settings().with_values(TRACERS[-1])
    other = chosen.with_values({"transparency.mode": "off", "reflections.bounces": 1})
    memory: list[tuple[int, int]] = []
    with (
        pica.Renderer(scene, size=SIZE, settings=chosen, device=device) as alone,
        pica.Renderer(scene, size=SIZE, settings=chosen, devices=[device, second]) as shared,
    ):
        for step in range(2000):
            if step % 3 == 0:
                visitor = scene.add(placed(sphere(0.2, lambert(0.8, 0.1, 0.1)), move(0.01 * (step % 50), 1, 0)))
            elif step % 3 == 2:
                scene.remove(visitor)
            stir(scene, step % 7)
            for renderer in (alone, shared):
                if step % 250 == 100:
                    renderer.resize((40, 20) if step % 500 == 100 else SIZE)
                if step % 500 == 200:
                    renderer.configure(other if step % 1000 == 200 else chosen)
                renderer.advance(camera(step % 11))
            if step % 1000 == 999:
                assert_same(*(renderer.render(1, camera=camera(0)) for renderer in (alone, shared)), step)
                gc.collect()
                memory.append((device.memory, second.memory))
    assert memory[0] == memory[1]


def test_copies_are_passes_of_the_frame_graph_with_their_bytes(device, second):
    with pica.Renderer(lively(), size=SIZE, devices=[device, second]) as shared:
        frame = shared.render(3, camera=camera(0))
        copies = [node for node in shared.graph.passes if node.bytes is not None]
        resources = {resource.key: resource for resource in shared.graph.resources}
        passes = shared.graph.passes
    assert {node.effect for node in copies} >= {"shadows", "reflections", "global_illumination"}
    names = "rays to secondary 1", "hits from secondary 1"
    sent, received = ([node for node in copies if node.name == name] for name in names)
    assert len(sent) == len(received) == len(copies) / 2
    assert [node.bytes * 24 for node in sent] == [node.bytes * 44 for node in received]
    for copy in names:
        milliseconds = sum(node.milliseconds for node in copies if node.name == copy)
        assert frame.timings[copy] == pytest.approx(milliseconds) and milliseconds > 0
    for key, resource in resources.items():  # they are counted among the passes
        assert key in passes[resource.first].writes + passes[resource.first].reads + passes[resource.first].previous


def test_the_second_device_traces_its_share(device, second, monkeypatch):
    """Ten times slower by its clock, it ends with a tenth of what the first one has."""
    with pica.Renderer(lively(), size=SIZE, devices=[device, second]) as shared:
        tracer = tracer_of(shared)
        note = tracer.balance.note
        slow = np.array([1.0, 10.0])
        monkeypatch.setattr(tracer.balance, "note", lambda rays, _, elapsed: note(rays, rays * slow, elapsed))
        for step in range(4):
            shared.advance(camera(step))
        np.testing.assert_allclose(tracer.balance.shares, [10 / 11, 1 / 11])
        copies = {node.name: node.bytes for node in shared.graph.passes if node.effect == "shadows" and node.bytes}
        rays = shared.count_rays(camera(5))["shadow_rays"]
    assert copies["rays to secondary 1"] == pytest.approx(44 * rays / 11, rel=0.1)


def test_where_it_does_not_pay_one_line_says_so_and_one_device_renders(device, second, monkeypatch):
    scene, chosen = lively(), pica.Settings().with_values(TRACERS[-1])
    monkeypatch.setattr(balance, "TRIAL", 6)
    with (
        pica.Renderer(scene, size=SIZE, settings=chosen, device=device) as alone,
        pica.Renderer(scene, size=SIZE, settings=chosen, devices=[device, second]) as shared,
    ):
        monkeypatch.setattr(tracer_of(shared).balance, "_alone", -1e9)
        with pytest.warns(
            UserWarning, match=r"^devices: copies of rays take longer .* the first renders alone"
        ) as said:
            pictures = [renderer.render(10, camera=camera(0)) for renderer in (alone, shared)]
        assert len(said) == 1 and not tracer_of(shared).secondaries
        assert_same(*pictures, "after ten frames")
        assert "trace_rays on secondary 1" not in pictures[1].timings


def test_with_ray_tracing_pipelines_one_line_says_so_and_one_device_renders(device, second, monkeypatch):
    monkeypatch.setattr(type(device), "is_software", False)
    with pytest.warns(UserWarning, match=r"devices: one graphics card alone is faster.*rays.scheduler=buffers"):
        renderer = pica.Renderer(lively(), size=SIZE, devices=[device, second])
    with renderer:
        assert not isinstance(renderer.tracer, shared_tracer.SharedTracer)


def test_a_device_without_rays_is_left_out(device, second, monkeypatch):
    monkeypatch.setattr(shared_tracer, "traces", lambda other: other is not second)
    with pytest.warns(UserWarning, match="traces no rays; the others do without it"):
        shared = pica.Renderer(lively(), size=SIZE, devices=[device, second])
    with shared:
        assert "trace_rays on secondary 1" not in shared.render(1, camera=camera(0)).timings


def test_new_material_types_show_at_once_on_all_devices(device, second):
    """In the background they would be ready on one before the other."""
    scene = still_life()
    few = settings({"transparency.mode": "off", "translucency.mode": "off"})
    with pica.Renderer(scene, size=SIZE, settings=few, devices=[device, second]) as shared:
        shared.advance(camera(0))
        scene.add(placed(sphere(0.3, Material(sheen=Sheen(color=(0.9, 0.5, 0.5)))), move(0, 0.8, 1)))
        shared.advance(camera(0), jittered=False, capture=["instance"])
        found = shared.captured["instance"]()
        assert shared.pending_shaders == 0
        assert set(np.unique(found)) == set(np.unique(shared.labels(camera=camera(0)).aov("instance")))


def test_what_does_not_go_together_is_one_line(device, second):
    with pytest.raises(PicaError, match="device and devices are two ways"):
        pica.Renderer(lively(), size=SIZE, device=device, devices=[device])
    with pytest.raises(PicaError, match="views and several devices do not go together"):
        pica.Renderer(lively(), size=SIZE, devices=[device, second], views=2)
    with pytest.raises(DeviceError, match="no device #99; there are"):
        pica.Renderer(lively(), size=SIZE, devices=[0, 99])
    pipeline = pica.Settings().with_values({"rays.scheduler": "pipeline"})
    with pytest.raises(SettingsError, match=r"rays\.scheduler: must be auto or buffers"):
        pica.Renderer(lively(), size=SIZE, devices=[device, second], settings=pipeline)
    with pica.Renderer(lively(), size=SIZE, devices=[device, second]) as shared:
        assert shared.device_name == f"{device.name} and {device.name}"
        with pytest.raises(SettingsError, match=r"rays\.scheduler"):
            shared.configure(pipeline)
        shared.render(1, camera=camera(0))
    assert shared.closed and "and" in repr(shared.device_name)


def test_renderers_of_the_same_devices_in_another_order_do_not_wait_for_each_other(device, second):
    locks = [SeveralLocks(each.lock for each in order) for order in ((device, second), (second, device))]
    done = []

    def work(lock: SeveralLocks) -> None:
        for _ in range(200):
            with lock:
                pass
        done.append(lock)

    threads = [threading.Thread(target=work, args=[lock], daemon=True) for lock in locks]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(20)
    assert len(done) == 2


@pytest.mark.parametrize("speeds", [(1.0, 1.0), (10.0, 1.0), (1.0, 3.0, 2.0), (1.0, 0.001)])
def test_shares_follow_the_times_of_the_frame_before(speeds):
    shared = Balance(len(speeds))
    for _ in range(3):
        rays = np.array(shared.split(100_000), float)
        assert rays.sum() == 100_000
        shared.note(rays, rays / speeds, (rays / speeds).max())
        shared.end_frame()
    expected = np.maximum(np.array(speeds) / sum(speeds), 1 / 64)
    np.testing.assert_allclose(shared.shares, expected / expected.sum(), rtol=1e-3)


def test_devices_are_done_at_the_same_time_whatever_copies_cost_at_least():
    """A second device of the same speed needs .4 s before its first ray."""
    shared = Balance(2)
    for _ in range(40):
        rays = np.array(shared.split(1000), float)
        seconds = rays / 1000 + [0.0, 0.4]
        shared.note(rays, seconds, seconds.max())
        shared.end_frame()
    np.testing.assert_allclose(seconds, 0.7, rtol=0.01)


@pytest.mark.parametrize(("latency", "pays"), [(0.0, True), (0.3, True), (0.6, False)])
def test_it_pays_if_rays_take_less_time_than_the_first_device_alone(monkeypatch, latency, pays):
    """Two equal devices halve the time; beyond half of it, what sharing costs is lost."""
    monkeypatch.setattr(balance, "TRIAL", 10)
    shared = Balance(2)
    for frame in range(10):
        assert shared.pays, frame
        shared.note(np.full(2, 500.0), np.full(2, 0.5), 0.5 + latency)
        shared.end_frame()
    assert shared.pays == pays


def test_frames_without_rays_leave_the_shares_as_they_are():
    shared = Balance(2)
    shared.end_frame()
    shared.note(np.array([5.0, 0.0]), np.array([1.0, 0.0]), 1.0)
    shared.end_frame()
    np.testing.assert_array_equal(shared.shares, [0.5, 0.5])

"""Material types that come to a running renderer: frames go on, and objects appear when their programs are ready."""

import pickle
import signal
import sys
import time
import warnings
import weakref
from dataclasses import dataclass
from io import BytesIO
from typing import ClassVar

import numpy as np
import pytest

import pica
from pica.errors import DeviceError, MaterialTypeError
from pica.programs.compile_worker import serve
from pica.programs.compiler import Compiler, Task
from pica.programs.library import programs
from pica.programs.material_types import STANDARD_ONLY
from pica.programs.program_round import ProgramRound
from pica.programs.recipes import TypeRecipe
from pica.rhi.profiler import FRAMES_IN_FLIGHT
from pica.scene import material_registry as material_types
from pica.scene.material import Material
from pica.scene.material_registry import material_source
from pica.scene.model import Mesh, Node
from pica.scene.primitives import spheres
from pica.scenes.basic_meshes import plane
from pica.scenes.placing import move, rotate
from tests.building import RASTER, RAYS, lambert, orthographic, placed, render, scene_of, settings, uniform

PLAIN = """
import materials.material_type;
struct Plain : IMaterialType
{
    static void evaluate(MaterialInput input, inout Surface surface) { surface.brdf.baseColor = 0.25; }
}
"""
FAULTY = PLAIN.replace("baseColor", "color")
CAMERA = orthographic((0, 0, 2), (0, 0, 0), 2.0)
SIZE = (16, 16)
QUICK = {"shadows.mode": "off", **RASTER}
SECONDS = 200


@pytest.fixture(autouse=True)
def fresh_registry(monkeypatch):
    monkeypatch.setattr(material_types, "_registered", {})


@pytest.fixture
def register(tmp_path):
    def write(name: str, source: str) -> None:
        path = tmp_path / f"{name}.slang"
        path.write_text(source)
        pica.register_material(name, path)

    return write


def wall(material: Material):
    return placed(plane(2, 2, material), rotate("x", 90))


def backdrop():
    """Grey 0.6 behind everything."""
    return scene_of(placed(plane(2, 2, lambert(0.6)), move(0, 0, -1) @ rotate("x", 90)), environment=uniform(1, 1, 1))


def running(device, scene, values=None) -> pica.Renderer:
    renderer = pica.Renderer(scene, size=SIZE, settings=settings({**QUICK, **(values or {})}), device=device)
    renderer.advance(CAMERA)
    return renderer


def albedo(renderer: pica.Renderer) -> float:
    """What a frame shows in the middle."""
    renderer.advance(CAMERA, capture=("albedo",))
    picture = renderer.captured["albedo"]()
    return round(float(picture[SIZE[1] // 2, SIZE[0] // 2, 0]), 3)


def until_ready(renderer: pica.Renderer) -> list[float]:
    """What was shown while programs were pending, frame by frame."""
    begun, seen = time.monotonic(), [albedo(renderer)]
    while renderer.pending_shaders:
        assert time.monotonic() - begun < SECONDS
        seen.append(albedo(renderer))
    return seen


@pytest.mark.parametrize("values", [RASTER, RAYS])
def test_a_new_type_is_shown_once_it_is_ready(device, register, values):
    scene = backdrop()
    renderer = running(device, scene, values)
    assert renderer.pending_shaders == 0
    register("plain", PLAIN)
    scene.add(wall(Material(type="plain")))
    seen = until_ready(renderer)
    assert len(seen) > 3, "frames went on"
    assert set(seen[:-1]) == {0.6} and seen[-1] == 0.25
    settled = renderer.render(1, camera=CAMERA)
    fresh = render(device, scene, 1, CAMERA, SIZE, {**QUICK, **values})
    np.testing.assert_array_equal(settled.aov("albedo"), fresh.aov("albedo"))


@pytest.mark.slow
def test_a_new_shape_waits_too(device, register):
    """On a type that is in use and on a new one, at once."""
    scene = backdrop()
    renderer = running(device, scene, RAYS)
    register("plain", PLAIN)
    balls = [spheres([(x, 0, 0)], 0.7, material) for x, material in ((0, Material(type="plain")), (0.5, lambert(0.5)))]
    node = Node(mesh=Mesh([], primitives=balls))
    scene.add(node)
    seen = until_ready(renderer)
    assert set(seen[:-1]) == {0.6} and seen[-1] == 0.25
    register("plain", PLAIN.replace("0.25", "0.75"))
    seen = until_ready(renderer)
    assert set(seen[:-1]) == {0.25} and seen[-1] == 0.75
    renderer.reset()  # to frame 0, which looks through the pixels' centres
    settled = renderer.render(1, camera=CAMERA)
    fresh = render(device, scene, 1, CAMERA, SIZE, {**QUICK, **RAYS})
    np.testing.assert_array_equal(settled.aov("albedo"), fresh.aov("albedo"))


def test_render_shows_all_at_once(device, register):
    scene = backdrop()
    renderer = running(device, scene)
    register("plain", PLAIN)
    scene.add(wall(Material(type="plain")))
    albedo(renderer)
    assert renderer.pending_shaders > 0
    assert renderer.render(1, camera=CAMERA).aov("albedo")[8, 8, 0] == pytest.approx(0.25, abs=1e-3)
    assert renderer.pending_shaders == 0
    assert albedo(renderer) == 0.25


def test_a_replaced_type_shows_as_it_was_until_it_is_ready(device, register):
    register("plain", PLAIN)
    scene = scene_of(wall(Material(type="plain")), environment=uniform(1, 1, 1))
    renderer = running(device, scene)
    for before, after in ((0.25, 0.75), (0.75, 0.25)):
        old = material_source("plain")
        assert any(old in types for _, types in device._products)
        register("plain", PLAIN.replace("0.25", str(after)))
        seen = until_ready(renderer)
        assert set(seen[:-1]) == {before} and seen[-1] == after
    kept = [sum(old in types for _, types in device._products)]
    for _ in range(FRAMES_IN_FLIGHT):
        renderer.advance(CAMERA)
        kept.append(sum(old in types for _, types in device._products))
    assert all(kept[:-1]) and kept[-1] == 0, "the old programs stay for the frames in flight, and no longer"


def test_a_faulty_type_is_reported_once_and_shown_when_mended(device, register):
    scene = backdrop()
    renderer = running(device, scene)
    register("plain", FAULTY)
    scene.add(wall(Material(type="plain")))
    with pytest.raises(MaterialTypeError, match=r"'plain': .*plain.slang:5: 'color' is not a member"):
        until_ready(renderer)
    assert albedo(renderer) == 0.6
    assert renderer.pending_shaders == 0
    with pytest.raises(MaterialTypeError, match="'color' is not a member"):
        renderer.render(1, camera=CAMERA)
    register("plain", PLAIN)
    assert until_ready(renderer)[-1] == 0.25


def test_a_faulty_replacement_leaves_the_type_as_it_was(device, register):
    register("plain", PLAIN)
    scene = scene_of(wall(Material(type="plain")), environment=uniform(1, 1, 1))
    renderer = running(device, scene)
    wants = PLAIN.replace("{\n", "{\n    struct Parameters { float level; }\n", 1)
    for source, fault in ((FAULTY, "'color' is not a member"), (wants, "lacks 'level'")):
        register("plain", source)
        with pytest.raises(MaterialTypeError, match=fault):
            until_ready(renderer)
        assert until_ready(renderer) == [0.25]


def test_a_name_that_nobody_registered_is_reported_once(device, register):
    scene = backdrop()
    renderer = running(device, scene)
    scene.add(wall(Material(type="plain")))
    with pytest.raises(MaterialTypeError, match="'plain' is not registered"):
        renderer.advance(CAMERA)
    assert until_ready(renderer) == [0.6]
    register("plain", PLAIN)
    assert until_ready(renderer)[-1] == 0.25


def test_a_node_may_go_while_it_waits(device, register):
    scene = backdrop()
    renderer = running(device, scene)
    register("plain", PLAIN)
    node = scene.add(wall(Material(type="plain")))
    renderer.advance(CAMERA)
    scene.remove(node)
    assert set(until_ready(renderer)) == {0.6}


@pytest.mark.slow
def test_who_comes_while_others_wait_is_in_the_next_round(device, register):
    scene = backdrop()
    renderer = running(device, scene)
    register("plain", PLAIN)
    register("other", PLAIN.replace("0.25", "0.75"))
    first = scene.add(wall(Material(type="plain")))
    albedo(renderer)
    second = scene.add(placed(plane(2, 2, Material(type="other")), move(0, 0, 0.5) @ rotate("x", 90)))
    seen = until_ready(renderer)
    assert sorted(set(seen), key=seen.index) == [0.6, 0.25, 0.75]
    scene.remove(first)
    scene.remove(second)
    albedo(renderer)
    register("third", PLAIN.replace("0.25", "0.5"))
    scene.add(wall(Material(type="third")))
    assert until_ready(renderer)[-1] == 0.5
    names = [source.name for source in renderer.view.material_types]
    assert len(names) - ("features/" in names) == 3 and "third" in names, (
        "a type that nobody uses any more gives up its place"
    )


def test_a_worker_that_dies_gets_a_successor(device, register):
    scene = backdrop()
    renderer = running(device, scene)
    compiler = programs(device).compiler
    if compiler.process is not None:
        compiler.process.send_signal(signal.SIGSTOP)  # so that it dies before its work is done
    register("plain", PLAIN)
    scene.add(wall(Material(type="plain")))
    renderer.advance(CAMERA)
    while compiler.process is None:
        time.sleep(0.01)
    died = compiler.process
    died.kill()
    assert until_ready(renderer)[-1] == 0.25
    assert compiler.process is not died


def test_a_worker_that_cannot_start_is_told_once(device, register, monkeypatch):
    """And programs are made all the same, here."""
    compiler = programs(device).compiler
    for name, value in (("process", None), ("failure", ""), ("warned", False)):
        monkeypatch.setattr(compiler, name, value)
    monkeypatch.setattr(sys, "executable", "/nowhere/python")
    before = tuple(list(STANDARD_ONLY))  # that no pass has: a round of the new types alone
    begun = time.monotonic()
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        for level in ("0.25", "0.75"):
            register("plain", PLAIN.replace("0.25", level))
            types = (*before, material_source("plain"))
            making = ProgramRound(device, before, types)
            assert making.left == 1
            while not making.step():
                assert time.monotonic() - begun < SECONDS
                time.sleep(0.01)
            assert any(kept == types for _, kept in device._products)
            device.forget(types)
    said = [str(warning.message) for warning in told]
    assert len(said) == 1
    assert "cannot start" in said[0] and "/nowhere/python" in said[0] and "frames wait" in said[0]


def test_the_worker_ends_with_its_compiler(device, register, tmp_path):
    register("plain", FAULTY)
    task = Task(TypeRecipe(material_source("plain")), STANDARD_ONLY)
    compiler = Compiler(device.name, tmp_path)
    compiler.submit(task)
    begun = time.monotonic()
    while not task.done:
        assert time.monotonic() - begun < SECONDS
        time.sleep(0.01)
    assert "'color' is not a member" in str(task.fault)
    process = compiler.process
    assert process is not None and process.poll() is None
    compiler.close()
    assert process.wait(10) != 0


class _Made:
    """Stands for a pipeline."""

    alive: ClassVar[weakref.WeakSet["_Made"]] = weakref.WeakSet()

    def __init__(self) -> None:
        self.alive.add(self)


@dataclass(frozen=True)
class _LonelyRecipe:
    """Fails where what it made before still lives."""

    def link(self, device, types):
        return None

    def make(self, device, linked):
        if _Made.alive:
            raise DeviceError("not alone")
        return _Made()


def test_the_worker_lets_go_of_a_pipeline_before_the_next(device):
    """Where two ray tracing pipelines live at once, NVIDIA's driver gives the cache half of the second."""
    tasks, answers = BytesIO(), BytesIO()
    pickle.dump(device.name, tasks)
    for _ in range(3):
        pickle.dump((_LonelyRecipe(), STANDARD_ONLY), tasks)
    tasks.seek(0)
    serve(tasks, answers)
    answers.seek(0)
    assert [pickle.load(answers) for _ in range(3)] == [None] * 3


@pytest.mark.slow
def test_frames_go_on_where_a_build_in_the_frame_would_stall(device, register):
    """On a CPU the worker takes frames' time, so they are compared with what they would wait otherwise."""
    longest = {}
    for way in ("in the frame", "in the background"):
        scene = backdrop()
        renderer = running(device, scene, RAYS)
        register(way.split()[-1], PLAIN.replace("0.25", str(time.time())))  # a source that no cache knows
        scene.add(wall(Material(type=way.split()[-1])))
        times = []
        while renderer.pending_shaders or not times:
            begun = time.monotonic()
            renderer._advance([CAMERA], wait=way == "in the frame")
            device.handle.wait_for_idle()
            times.append(time.monotonic() - begun)
        longest[way] = max(times)
    assert longest["in the background"] < longest["in the frame"] / 5, longest

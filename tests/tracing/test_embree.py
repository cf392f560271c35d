"""Tier 1 on the processor meets what the device's own pipelines meet, and gives the same pictures."""

from dataclasses import replace

import numpy as np
import pytest

import pica
from pica.errors import DeviceError
from pica.rhi.host_memory import HostBuffer
from pica.rhi.profiler import Profiler
from pica.scene.material import AlphaMode
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import move, rotate, stretch
from pica.settings import RaysSettings
from pica.tracing import embree
from pica.tracing.tracers import uses_embree
from tests.building import CAMERA, SIZE, lambert, leaves, placed, scene_of, settings, still_life, trace
from tests.rays import CAMERA as FROM_CAMERA
from tests.rays import SHADOW, SURFACE, RayCaster

needs_embree = pytest.mark.skipif(embree.missing() is not None, reason=f"Embree cannot trace: {embree.missing()}")
EMBREE = {"rays.scheduler": "buffers", "rays.tracer": "embree"}
PIPELINE = {"rays.scheduler": "pipeline"}
PATHS = {"global_illumination.mode": "path_traced"}


def casters(device, scene) -> list[RayCaster]:
    """Rays through the device's pipelines, and through Embree."""
    from pica.tracing.embree_tracer import EmbreeTracer

    return [RayCaster(device, scene), RayCaster(device, scene, lambda c: EmbreeTracer(device, c.scene.rt_scene))]


def random_rays(count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """From around the origin, towards points near it."""
    random = np.random.default_rng(seed)
    origins = random.normal(size=(count, 3))
    origins *= 4 / np.linalg.norm(origins, axis=1, keepdims=True)
    directions = random.uniform(-1.2, 1.2, (count, 3)) - origins
    return np.float32(origins), np.float32(directions / np.linalg.norm(directions, axis=1, keepdims=True))


def assert_alike(both: list[RayCaster], count: int = 4000) -> None:
    origins, directions = random_rays(count)
    seeds = np.arange(count)
    for kind in (FROM_CAMERA, SURFACE):
        ours, embrees = (cast(origins, directions, kind, seeds) for cast in both)
        assert 0.1 < (ours["distance"] >= 0).mean() < 0.99
        same = (ours["record"] == embrees["record"]) & (ours["primitive"] == embrees["primitive"])
        same |= (ours["distance"] < 0) & (embrees["distance"] < 0)
        assert same.mean() > 0.999, "but for rays that pass along edges"
        met = same & (ours["distance"] >= 0)
        np.testing.assert_allclose(embrees["distance"][met], ours["distance"][met], rtol=2e-5)
        np.testing.assert_allclose(embrees["barycentrics"][met], ours["barycentrics"][met], atol=1e-3)
    ours, embrees = (cast(origins, directions, SHADOW, seeds, maximum=4.0) for cast in both)
    assert ((ours["distance"] >= 0) == (embrees["distance"] >= 0)).mean() > 0.999


@needs_embree
@pytest.mark.parametrize("mirrored", [False, True])
def test_instances_of_both_kinds_of_sides(device, mirrored):
    kinds = [plane(1, 1, lambert(0.1)), sphere(0.4, lambert(0.2, double_sided=True)), box(0.5, lambert(0.3))]
    node = placed(kinds)
    flip = stretch(-1 if mirrored else 1, 1, 0.7)
    node.instances = np.stack([move(0.9 * x, 0.4 * x, -0.3 * x) @ rotate("y", 40 * x) @ flip for x in (-1, 0, 1)])
    assert_alike(casters(device, scene_of(placed(plane(3, 3, lambert()), move(0, -0.8, 0)), node)))


@needs_embree
def test_moved_removed_and_added_nodes(device):
    still, moving = placed(box(1, lambert()), name="still"), placed(sphere(0.5, lambert()), move(5, 0, 0))
    scene = scene_of(still, moving)
    both = casters(device, scene)
    assert_alike(both)
    moving.transform = move(0.8, 0.2, 0.1) @ stretch(1, 2, 1)
    for cast in both:
        cast.update()
    assert_alike(both)
    scene.remove(still)
    scene.add(placed(plane(2, 2, lambert()), move(0, -0.5, 0)))
    for cast in both:
        cast.update()
    assert_alike(both)


@needs_embree
def test_a_deforming_mesh_is_met_as_it_is_now(device):
    ball = sphere(0.6, lambert())
    node = placed(replace(ball, morph_positions=ball.positions[None] * np.float32([0.8, -0.4, 0.3])))
    node.weights = [0.0]
    both = casters(device, scene_of(node, placed(plane(3, 3, lambert()), move(0, -0.8, 0))))
    for weight in (0.0, 0.5, 1.0):
        node.weights = [weight]
        for cast in both:
            cast.update()
        tip = both[1]([3, 0.013, 0.017], [-1.0, 0, 0])["distance"]
        np.testing.assert_allclose(tip, 3 - 0.6 * (1 + 0.8 * weight), atol=0.01)
        assert_alike(both)


@needs_embree
def test_an_object_flattened_to_nothing_is_not_met(device):
    scene = scene_of(
        placed(box(1, lambert())),
        placed(box(2, lambert()), stretch(0, 0, 0)),
        placed(box(2, lambert()), stretch(1, 0, 1)),
    )
    cast = casters(device, scene)[1]
    np.testing.assert_allclose(cast([0.1, 0.1, 4], [0, 0, -1.0])["distance"], 3.5, rtol=1e-6)


@needs_embree
def test_rays_without_length_miss(device):
    cast = casters(device, scene_of(placed(box(1, lambert()))))[1]
    for kind in (FROM_CAMERA, SURFACE, SHADOW):
        assert cast([0, 0, 4], [0, 0, -1.0], kind, maximum=-1)["distance"] < 0
        assert cast([0, 0, 4], [0, 0, -1.0], kind, maximum=9)["distance"] >= 0


@needs_embree
def test_shadow_rays_name_the_cutout_in_the_way(device):
    """Of surfaces with holes the nearest is told, for its coverage to be looked up; opaque ones settle it."""
    board = placed(plane(2, 2, leaves()), move(0, 1, 0))
    down = [0.1, 2, 0.1], [0, -1.0, 0]
    alone = casters(device, scene_of(board))[1](*down, SHADOW)
    np.testing.assert_allclose(alone["distance"], 1, rtol=1e-6)
    board = placed(plane(2, 2, leaves()), move(0, 1, 0))
    above_floor = casters(device, scene_of(board, placed(plane(2, 2, lambert()))))[1](*down, SHADOW)
    assert above_floor["distance"] >= 0 and above_floor["record"] == 0xFFFFFFFF


def assert_same_picture(ours: pica.Frame, other: pica.Frame) -> None:
    """Alike but for a few pixels at edges, where rounding decides."""
    difference = np.abs(ours.color - other.color).max(-1)
    scale = np.maximum(ours.color.max(-1), ours.color.mean())
    assert ours.color.mean() > 0.05
    assert (difference > 2e-3 * scale).mean() < 0.004
    assert other.color.mean() == pytest.approx(ours.color.mean(), rel=2e-3)


@needs_embree
def test_path_traced_pictures_are_equal(device):
    """still_life has holes, half-transparent boards, sidedness, an emissive quad and a sky."""
    first, second = (trace(device, still_life(), 2, CAMERA, values=values) for values in (PIPELINE, EMBREE))
    assert_same_picture(first, second)


@needs_embree
def test_hybrid_pictures_are_equal_while_a_node_moves(device):
    pictures = []
    for values in (PIPELINE, EMBREE):
        scene = still_life()
        renderer = pica.Renderer(
            scene, size=SIZE, settings=settings({"visibility.primary": "rays"} | values), device=device
        )
        renderer.render(2, camera=CAMERA)
        board = next(node for node in scene.nodes() if node.name == "mask")
        board.transform = move(-0.2, 0.3, 0) @ board.transform
        pictures.append(renderer.render(2, camera=CAMERA))
    assert_same_picture(*pictures)


@needs_embree
def test_layers_of_half_transparent_boards(device):
    """Each ray goes on behind each board that does not cover it."""
    glass = lambert(0.8, alpha_mode=AlphaMode.BLEND, double_sided=True)
    glass.base_color = (0.8, 0.5, 0.3, 0.3)
    boards = [placed(plane(2, 2, glass), move(0, 0, -0.2 * n) @ rotate("x", 90)) for n in range(8)]
    scene = scene_of(*boards, environment=still_life().environment)
    camera = pica.Camera.look_at((0, 0, 3), (0, 0, 0), vertical_fov=np.radians(40))
    first, second = (trace(device, scene, 4, camera, max_depth=4, values=v) for v in (PIPELINE, EMBREE))
    assert_same_picture(first, second)


@needs_embree
def test_cornell_pictures_are_equal(device):
    scene = pica.scenes.cornell()
    first, second = (trace(device, scene, 2, size=(64, 64), max_depth=5, values=v) for v in (PIPELINE, EMBREE))
    assert_same_picture(first, second)


def test_host_buffers_read_and_write(device):
    data = np.arange(64, dtype=np.uint32)
    host = HostBuffer(device, device.structured("data", data))
    device.handle.wait_for_idle()
    bytes_ = host.read()
    np.testing.assert_array_equal(bytes_.view(np.uint32), data)
    changed = bytes_.copy() if not bytes_.flags.writeable else bytes_
    changed.view(np.uint32)[3] = 77
    host.write(changed)
    assert host.read().view(np.uint32)[3] == 77


def test_missing_embree_is_an_error_only_where_it_is_asked_for(device, monkeypatch):
    monkeypatch.setattr(embree, "missing", lambda: "the package embreex is not installed; do this")
    assert not uses_embree(device, RaysSettings())
    assert not uses_embree(device, RaysSettings(tracer="device"))
    with pytest.raises(DeviceError, match=r"rays\.tracer.*embreex is not installed; do this"):
        uses_embree(device, RaysSettings(tracer="embree"))


@needs_embree
def test_embree_is_chosen_on_the_processor_alone(device):
    assert uses_embree(device, RaysSettings()) == device.is_software


@needs_embree
def test_only_the_first_of_a_paths_steps_takes_timestamps(device, monkeypatch):
    """A hundred of them would take longer than the last steps do, and a frame has room for 64 passes."""
    begun, begin = [], Profiler.begin
    monkeypatch.setattr(Profiler, "begin", lambda *arguments: begun.append(arguments[-1]) or begin(*arguments))
    frame = pica.Renderer(
        pica.scenes.cornell(), size=(16, 16), settings=settings(EMBREE | PATHS), device=device
    ).render(1)
    assert begun.count("indirect_rays kernels") == 1
    assert frame.timings["indirect_rays kernels"] > 0 and frame.timings["embree"] > 0

"""Rays against acceleration structures: distances, sidedness, holes, moving."""

import numpy as np
import pytest

from pica.gpu_scene.materials import MATERIAL
from pica.rhi.acceleration import without_rounding
from pica.rhi.binding import parameters_of
from pica.rhi.build_scratch import BuildScratch
from pica.scene.material import AlphaMode
from pica.scenes.basic_meshes import box, plane
from pica.scenes.placing import move, rotate, stretch
from tests.building import lambert, leaves, placed, scene_of
from tests.rays import CAMERA, HIT, RAY, SHADOW, SURFACE, RayCaster, fields_of
from tests.tracing.kernels import read

DOWN, UP = (0.0, -1.0, 0.0), (0.0, 1.0, 0.0)


def above(x, z, height=1.0):
    x, z = np.broadcast_arrays(x, z)
    return np.stack([x, np.full(x.shape, height), z], -1).reshape(-1, 3)


def test_rays_and_hits_are_laid_out_as_the_shaders_have_them(device):
    module = device.handle.load_module("tracing/trace_rays.slang")
    program = device.handle.link_program([module], [module.entry_point("main")])
    layouts = {p.name: p.type_layout.element_type_layout for p in parameters_of(program) if p.name in ("rays", "hits")}
    for name, dtype in (("rays", RAY), ("hits", HIT)):
        ours = [
            (field.replace("_and_m", "AndM"), dtype.fields[field][1], dtype.fields[field][0].itemsize)
            for field in dtype.names
        ]
        assert fields_of(layouts[name]) == ours and layouts[name].stride == dtype.itemsize


def test_distance_place_and_miss(device):
    wall = plane(2, 2, lambert())
    cast = RayCaster(device, scene_of(placed(wall)))
    hits = cast(above([0.5, -0.25, 3.0], [0.25, 0.75, 0.0], 1.5), DOWN)
    np.testing.assert_allclose(hits["distance"], [1.5, 1.5, -1], rtol=1e-6)
    corners = wall.positions[wall.indices[hits["primitive"][:2]]]
    weights = hits["barycentrics"][:2]
    weights = np.concatenate([1 - weights.sum(1, keepdims=True), weights], axis=1)
    met = np.einsum("nc,nci->ni", weights, corners)
    np.testing.assert_allclose(met, [[0.5, 0, 0.25], [-0.25, 0, 0.75]], atol=1e-6)


def test_rays_keep_to_their_length(device):
    cast = RayCaster(device, scene_of(placed(plane(2, 2, lambert()))))
    assert cast(above(0, 0), DOWN, maximum=0.99)["distance"] < 0
    assert cast(above(0, 0), DOWN, maximum=1.01)["distance"] > 0
    assert cast(above(0, 0), DOWN, minimum=1.01)["distance"] < 0
    assert cast(above(0, 0), DOWN, maximum=-1)["distance"] < 0, "a ray without length is a miss"


@pytest.mark.parametrize("double_sided", [False, True])
@pytest.mark.parametrize("mirrored", [False, True])
def test_camera_rays_alone_pass_through_backs(device, double_sided, mirrored):
    transform = stretch(-1 if mirrored else 1, 1, 1)
    cast = RayCaster(device, scene_of(placed(plane(2, 2, lambert(double_sided=double_sided)), transform)))
    for kind in (CAMERA, SURFACE, SHADOW):
        assert cast(above(0.3, 0.1), DOWN, kind)["distance"] >= 0
        met_behind = cast(above(0.3, 0.1, -1), UP, kind)["distance"] >= 0
        assert met_behind == (kind != CAMERA or double_sided)


def test_records_tell_sections_and_copies_apart(device):
    """Two sections of either sidedness in one mesh, three times: each hit names its own record."""
    kinds = [lambert(0.1), lambert(0.2, double_sided=True), lambert(0.3), lambert(0.4, double_sided=True)]
    sections = []
    for number, material in enumerate(kinds):
        section = plane(0.5, 0.5, material)
        section.positions = section.positions + np.array([number, 0, 0], np.float32)
        sections.append(section)
    node = placed(sections)
    node.instances = np.stack([move(0, 0, 2.0 * copy) for copy in range(3)])
    scene = scene_of(placed(plane(1, 1, lambert(0.9)), move(0, 0, -5)), node)
    cast = RayCaster(device, scene)
    x, z = np.meshgrid(np.arange(4.0), 2.0 * np.arange(3))
    hits = cast(above(x, z), DOWN)
    records = cast.scene.records[hits["record"]]
    materials = read(cast.scene.scene.materials.table.buffer, MATERIAL)
    colors = materials["base_color"][records["material"], 0]
    np.testing.assert_allclose(colors, np.tile([0.1, 0.2, 0.3, 0.4], 3), rtol=1e-6)
    np.testing.assert_array_equal(records["instance"], np.repeat([1, 2, 3], 4))


def test_masked_holes_let_rays_through(device):
    """The board of `leaves`: four by four fields, every other clear."""
    cast = RayCaster(device, scene_of(placed(plane(4, 4, leaves()))))
    x, z = np.meshgrid(np.arange(4) - 1.5, np.arange(4) - 1.5)
    solid = np.indices((4, 4)).sum(0) % 2 == 1
    for kind in (CAMERA, SURFACE, SHADOW):
        met = cast(above(x, z), DOWN, kind)["distance"].reshape(4, 4) >= 0
        np.testing.assert_array_equal(met, solid)


def test_blending_meets_a_share_of_the_rays_that_equals_alpha(device):
    material = lambert(alpha_mode=AlphaMode.BLEND)
    material.base_color = (1, 1, 1, 0.3)
    cast = RayCaster(device, scene_of(placed(plane(2, 2, material))))
    seeds = np.arange(20_000)
    for kind in (CAMERA, SURFACE, SHADOW):
        first, again = (cast(np.tile([0.2, 1.0, 0.1], (20_000, 1)), DOWN, kind, seeds) for _ in range(2))
        assert (first["distance"] >= 0).mean() == pytest.approx(0.3, abs=0.015)  # 4.6 standard deviations
        np.testing.assert_array_equal(first, again)


def test_a_moved_object_is_met_where_it_is_now(device):
    still, moving = placed(box(1, lambert())), placed(box(1, lambert()), move(5, 0, 0))
    cast = RayCaster(device, scene_of(still, moving))
    spots = above([0.1, 5.1], 0.2, 3)
    np.testing.assert_allclose(cast(spots, DOWN)["distance"], [2.5, 2.5], rtol=1e-6)
    moving.transform = move(5, 1, 0) @ rotate("y", 40)
    np.testing.assert_allclose(cast(spots, DOWN)["distance"], [2.5, 2.5], rtol=1e-6, err_msg="not before the update")
    cast.update()
    np.testing.assert_allclose(cast(spots, DOWN)["distance"], [2.5, 1.5], rtol=1e-6)


def test_a_thousand_copies(device):
    node = placed(plane(0.5, 0.5, lambert()))
    spots = np.stack(np.meshgrid(np.arange(40), np.arange(25)), -1).reshape(-1, 2)
    node.instances = np.stack([move(x, 0.01 * index, z) for index, (x, z) in enumerate(spots)])
    cast = RayCaster(device, scene_of(node))
    hits = cast(above(spots[:, 0], spots[:, 1], 20), DOWN)
    np.testing.assert_allclose(hits["distance"], 20 - 0.01 * np.arange(1000), rtol=1e-5)


def test_a_turned_floor_is_flat_to_rays():
    """A turn by 90 degrees leaves 6e-17 where 0 should be, which some graphics cards stumble over."""
    floor, tilted = rotate("x", 90)[:3], rotate("x", 90.001)[:3]
    assert 0 < abs(floor[1, 1]) < 1e-15
    cleaned = without_rounding(np.stack([1e-4 * floor, tilted]))
    assert cleaned[0, 1, 1] == cleaned[0, 2, 2] == 0 and cleaned[0, 2, 1] == np.float32(1e-4)
    np.testing.assert_array_equal(cleaned[1], tilted.astype(np.float32))
    place = np.float32([[[1, 0, 0, 1e-9], [0, 1, 0, 5], [0, 0, 1, 0]]])
    np.testing.assert_array_equal(without_rounding(place), place, err_msg="places are left alone")


def test_builds_share_scratch_in_turn(device):
    scratch = BuildScratch(device)
    before, size = device.memory, scratch.size
    offsets = [scratch.take(4000).offset for _ in range(500)]
    assert device.memory == before and scratch.size == size, "one buffer, made once"
    assert not any(offset % 256 for offset in offsets) and max(offsets) + 4000 <= size
    steps = np.diff(offsets)
    assert (steps[steps > 0] >= 4000).all() and (steps > 0).sum() > 490, "apart until the last of it is given"
    assert scratch.take(size + 1).offset + size + 1 <= scratch.size
    assert device.memory - before == scratch.size - size

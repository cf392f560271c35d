"""What a picture of a scene without a camera shows: the objects, not the ground on which they stand."""

import math

import numpy as np
import pytest

import pica
from pica.scene.camera import Camera
from pica.scene.mesh import Mesh
from pica.scene.model import Node, Scene
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import move, rotate, stretch
from tests.building import lambert, placed, projected, scene_of

HELMET = (np.array((-0.25, 0.0, -0.25)), np.array((0.25, 0.5, 0.25)))


def helmet(name="helmet"):
    """Half a metre, of several parts, one of which is flat."""
    shell, visor = sphere(0.25, lambert()), box((0.3, 0.2, 0.01), lambert())
    return placed([shell, visor], move(0, 0.25, 0), name)


def walls(width, height, depth, thickness=0.0):
    """A closed room that is looked at from inside."""
    sides = []
    for turned, offset, size in (
        (np.eye(4), (0, 0, 0), (width, depth)),
        (rotate("x", 180), (0, height, 0), (width, depth)),
        (rotate("x", 90), (0, height / 2, -depth / 2), (width, height)),
        (rotate("x", -90), (0, height / 2, depth / 2), (width, height)),
        (rotate("z", -90), (-width / 2, height / 2, 0), (height, depth)),
        (rotate("z", 90), (width / 2, height / 2, 0), (height, depth)),
    ):
        part = box((size[0], thickness, size[1]), lambert()) if thickness else plane(*size, lambert())
        sides.append(placed(part, move(*offset) @ turned))
    return sides


def tiles(side, count):
    """A square ground of so many copies of one tile along each edge."""
    steps = (np.arange(count) - (count - 1) / 2) * side
    node = placed(box((side, 0.02, side), lambert()), name="tiles")
    node.instances = np.stack([move(x, -0.01, z) for x in steps for z in steps])
    return node


GROUNDS = {
    "none": [],
    "a plane of 100 m": [placed(plane(100, 100, lambert()))],
    "one that is not level": [placed(plane(100, 100, lambert()), rotate("x", 8) @ rotate("z", 5))],
    "a slab": [placed(box((60, 2, 80), lambert()), move(0, -1, 0))],
    "a large sky too": [placed(plane(100, 100, lambert())), placed(sphere(300, lambert()))],
    "a sky alone": [placed(sphere(300, lambert()))],
    "skies in skies": [placed(sphere(300, lambert())), placed(sphere(30, lambert()))],
    "large tiles": [tiles(5, 20)],
    "small tiles": [tiles(0.4, 60)],
    "a room": walls(12, 5, 16),
    "a room with thick walls": walls(12, 5, 16, 0.3),
    "a ground and a street": [placed(plane(100, 100, lambert())), placed(plane(100, 4, lambert()), move(0, 0.01, 0))],
}


@pytest.mark.parametrize("ground", GROUNDS)
def test_the_object_is_looked_at(ground):
    scene = scene_of(helmet(), *GROUNDS[ground])
    np.testing.assert_allclose(scene.subject_bounds(), HELMET, atol=1e-6)
    for node in list(scene.roots):
        scene.remove(node)


def test_bounds_stay_those_of_all():
    scene = scene_of(helmet(), placed(plane(100, 100, lambert())))
    np.testing.assert_allclose(scene.bounds(), [(-50, 0, -50), (50, 0.5, 50)])


def test_one_mesh_of_object_and_ground_too():
    """Its sections tell them apart."""
    scene = scene_of(placed([plane(100, 100, lambert()), sphere(0.25, lambert())]))
    np.testing.assert_allclose(scene.subject_bounds(), [(-0.25,) * 3, (0.25,) * 3], atol=1e-6)


def test_flat_things_that_are_no_ground():
    """A laptop is two slabs; on a table that is as flat it is what is looked at, and so it is on a ground."""
    lid = placed(box((0.3, 0.2, 0.005), lambert()), move(0, 0.1, -0.1))
    base = placed(box((0.3, 0.01, 0.2), lambert()))
    expected = [(-0.15, -0.005, -0.1025), (0.15, 0.2, 0.1)]
    scene = scene_of(lid, base)
    scene.add(placed(plane(100, 100, lambert()), move(0, -0.005, 0)))
    np.testing.assert_allclose(scene.subject_bounds(), expected, atol=1e-6)


@pytest.mark.parametrize("side", [0.3, 1.2])
def test_a_base_that_is_not_much_larger_belongs_to_it(side):
    scene = scene_of(helmet(), placed(plane(side, side, lambert())))
    expected = np.maximum(HELMET[1], (side / 2, 0, side / 2))
    np.testing.assert_allclose(scene.subject_bounds()[1], expected, atol=1e-6)


def test_many_copies_are_all_looked_at():
    """A forest is not a ground, however far it reaches."""
    tree = placed(box((1, 5, 1), lambert()))
    tree.instances = np.stack([move(x, 2.5, z) for x in range(-200, 201, 40) for z in range(-200, 201, 40)])
    scene = scene_of(tree, placed(box(2, lambert())), placed(plane(3000, 3000, lambert())))
    np.testing.assert_allclose(scene.subject_bounds(), [(-200.5, -1, -200.5), (200.5, 5, 200.5)])


NOTHING_ELSE = {
    "a plane": [placed(plane(100, 100, lambert()))],
    "tiles": [tiles(5, 8)],
    "a room": walls(6, 3, 8),
    "hills": None,
}


@pytest.mark.parametrize("kind", NOTHING_ELSE)
def test_where_nothing_else_is_the_ground_is_looked_at(kind):
    if NOTHING_ELSE[kind] is None:
        heights = np.random.default_rng(0).uniform(0, 1, (33, 33))
        scene = scene_of(pica.Landscape(heights, spacing=1.0, material=lambert(), patch=8, levels=2).node)
    else:
        scene = scene_of(*NOTHING_ELSE[kind])
    np.testing.assert_allclose(scene.subject_bounds(), scene.bounds(), atol=1e-9)


def test_a_sky_over_a_ground_shows_the_ground():
    scene = scene_of(placed(plane(10, 10, lambert())), placed(sphere(300, lambert())))
    np.testing.assert_allclose(scene.subject_bounds(), [(-5, 0, -5), (5, 0, 5)], atol=1e-6)


def test_the_landscape_is_seen_as_a_whole():
    scene = pica.scenes.landscape(plants=200)
    low, high = scene.subject_bounds()
    whole = scene.bounds()
    assert (high - low)[[0, 2]] == pytest.approx((whole[1] - whole[0])[[0, 2]], rel=0.05)


@pytest.mark.parametrize("name", ["cornell", "rooms", "court"])
def test_small_scenes_are_seen_as_a_whole(name):
    """Their grounds and walls are not far larger than what stands there."""
    scene = getattr(pica.scenes, name)()
    sizes = [np.linalg.norm(high - low) for low, high in (scene.subject_bounds(), scene.bounds())]
    assert sizes[0] > sizes[1] / 4


def test_an_empty_scene():
    np.testing.assert_allclose(Scene().subject_bounds(), Scene().bounds())
    empty = scene_of(Node("empty", mesh=Mesh()))
    assert empty.default_camera(1.0).vertical_fov > 0


def corners_in(camera, low, high, aspect):
    size = (round(1000 * aspect), 1000)
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    pixels = projected(camera, corners, size)
    return ((pixels >= 0) & (pixels <= size)).all(1)


def test_cameras_in_rooms_stand_in_them():
    """A table in a room that is a little larger: from the usual distance a wall would be in between."""
    table = placed(box((1.6, 0.8, 2.0), lambert()), move(0, 0.4, 0))
    scene = scene_of(table, *walls(10, 3, 5))
    camera = scene.default_camera(1.5)
    assert np.abs(camera.transform[[0, 2], 3]).max() < 2.5 and 0 < camera.transform[1, 3] < 3
    assert corners_in(camera, *scene.subject_bounds(), 1.5).all()
    free = scene_of(placed(box((1.6, 0.8, 2.0), lambert()), move(0, 0.4, 0))).default_camera(1.5)
    assert free.transform[2, 3] > 2.5, "or this would show nothing"
    assert camera.vertical_fov > free.vertical_fov


def test_a_nearer_camera_is_wider():
    low, high = (-1, -1, -1), (1, 1, 1)
    usual = Camera.framing(low, high, aspect=1.5)
    assert Camera.framing(low, high, aspect=1.5, farthest=100.0).transform == pytest.approx(usual.transform)
    near = Camera.framing(low, high, aspect=1.5, farthest=3.0)
    assert np.linalg.norm(near.transform[:3, 3]) == pytest.approx(3.0)
    assert near.vertical_fov > usual.vertical_fov and corners_in(near, low, high, 1.5).all()
    inside = Camera.framing(low, high, aspect=1.5, farthest=0.5)
    assert inside.vertical_fov == pytest.approx(math.radians(100))
    with pytest.raises(pica.SceneError, match=r"^camera 'framing': farthest: 0\.0 is not above 0$"):
        Camera.framing(low, high, aspect=1.0, farthest=0)


def test_sizes_of_nodes_count():
    """A ground that its node makes large, an object that its node makes small."""
    ball = placed(sphere(5, lambert()), stretch(0.05, 0.05, 0.05))
    ground = placed(plane(1, 1, lambert()), stretch(100, 1, 100))
    np.testing.assert_allclose(scene_of(ball, ground).subject_bounds(), [(-0.25,) * 3, (0.25,) * 3], atol=1e-6)


def test_of_any_parts_some_are_looked_at():
    """Whatever stands wherever, the box is part of the whole one, and the camera sees it."""
    random = np.random.default_rng(0)
    for _ in range(60):
        scene = Scene()
        for _ in range(random.integers(1, 6)):
            size = 10.0 ** random.uniform(-3, 3, 3)
            size[random.integers(0, 3)] *= random.choice([1, 1e-4])
            where = (
                move(*random.normal(0, 10, 3))
                @ rotate("x", random.uniform(0, 360))
                @ rotate("y", random.uniform(0, 360))
            )
            scene.add(placed(box(size, lambert()), where))
        (low, high), whole = scene.subject_bounds(), scene.bounds()
        slack = 1e-9 * (1 + np.abs(whole).max())
        assert (low >= whole[0] - slack).all() and (high <= whole[1] + slack).all() and (low <= high).all()
        assert np.isfinite(scene.default_camera(1.5).transform).all()

"""The showroom: what there is, and how it moves."""

import numpy as np
import pytest

import pica
from pica.errors import SceneError
from pica.scene.light import RectangleLight
from pica.scenes.car import HEIGHT, LENGTH, WIDTH
from pica.scenes.motion import LOOP


@pytest.fixture(scope="module")
def hall():
    return pica.scenes.showroom()


def node(scene, name):
    (found,) = (each for each in scene.nodes() if each.name == name)
    return found


def points(root):
    """(count, 3) all vertices below a node, in metres relative to it."""
    back = np.linalg.inv(root.world)
    return np.concatenate([
        (section.positions @ each.world[:3, :3].T + each.world[:3, 3]) @ back[:3, :3].T + back[:3, 3]
        for each in root.walk()
        if each.mesh
        for section in each.mesh.sections
    ])  # fmt: skip


def test_the_car_has_the_size_of_a_car_and_stands_on_the_turntable(hall):
    car = node(hall, "car")
    low, high = points(car).min(0), points(car).max(0)
    np.testing.assert_allclose(high - low, (LENGTH, HEIGHT, WIDTH), atol=0.06)
    assert low[1] == pytest.approx(0, abs=2e-3)
    table = points(node(hall, "turntable"))
    top = (node(hall, "turntable").mesh.sections[0].positions[:, 1]).max()
    assert car.transform[1, 3] == pytest.approx(top) and np.hypot(table[:, 0], table[:, 2]).max() < 3


def test_the_body_is_in_one_piece(hall):
    """Panes, lamps and trims fill the holes that they were cut out of, so that no edge is left open."""
    sections = node(hall, "body").mesh.sections
    corners = np.concatenate([section.positions[section.indices] for section in sections])
    _, names = np.unique(np.round(corners.reshape(-1, 3), 6), axis=0, return_inverse=True)
    triangles = names.reshape(-1, 3)
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    counts = np.unique(edges[edges[:, 0] != edges[:, 1]], axis=0, return_counts=True)[1]
    assert (counts == 2).mean() > 0.99
    a, b, c = np.moveaxis(corners, 1, 0)
    assert np.linalg.norm(np.cross(b - a, c - a).sum(0)) < 1e-3  # as of closed surfaces


def test_wheels_are_in_their_arches(hall):
    body = np.concatenate([section.positions for section in node(hall, "body").mesh.sections])
    for wheel in (each for each in node(hall, "car").children if each.name.endswith("wheel")):
        tyre = wheel.transform[:3, 3]
        high = np.abs(body[:, 2] - tyre[2]) < 0.12
        gap = np.hypot(*(body[high] - tyre)[:, :2].T).min() - 0.345
        assert 0.02 < gap < 0.1
        assert np.abs(points(wheel)[:, 2]).max() + abs(tyre[2]) < np.abs(body[:, 2]).max()


def test_the_paint_has_a_clear_coat_over_flakes(hall):
    paint = next(s.material for s in node(hall, "body").mesh.sections if s.material.name == "flake paint")
    assert paint.metallic == 1 and paint.coats[0].roughness < 0.1 < paint.roughness
    tilt = paint.normal_texture.image.pixels[..., :2].astype(float)
    assert 2 < tilt.std() < 20 and tilt.mean() == pytest.approx(127.5, abs=1)
    others = pica.scenes.showroom(seed=2)
    again = next(s.material for s in node(others, "body").mesh.sections if s.material.name == "flake paint")
    assert (again.normal_texture.image.pixels != paint.normal_texture.image.pixels).any()


def test_rectangle_lights_face_the_car_at_all_times(hall):
    lights = [each for each in hall.nodes() if each.light]
    assert len(lights) == 5 and all(isinstance(each.light, RectangleLight) for each in lights)
    assert max(each.light.width * each.light.height for each in lights) > 15
    for time in np.linspace(0, LOOP, 25):
        hall.animate(time)
        for each in lights:
            assert ((0, 0.6, 0) - each.world[:3, 3]) @ -each.world[:3, 2] > 1, (each.name, time)


def test_the_showroom_ends_where_it_began_and_nothing_jumps(hall):
    assert {animation.name for animation in hall.animations} == {"turntable", "lights"}
    moving = list({channel.node: None for animation in hall.animations for channel in animation.channels})
    assert len(moving) == 5
    places = []
    for time in np.linspace(0, LOOP, 361):
        hall.animate(time)
        places.append([each.world for each in moving])
    matrices = np.array(places)
    np.testing.assert_allclose(matrices[-1], matrices[0], atol=1e-6)
    speed = np.linalg.norm(np.diff(matrices[..., :3, 3], axis=0), axis=-1) * 15
    assert 1 < speed.max() < 3
    assert (np.ptp(matrices, axis=0).max((1, 2)) > 0.5).all()


def test_a_seed_out_of_range():
    with pytest.raises(SceneError, match="showroom: seed"):
        pica.scenes.showroom(seed=-1)

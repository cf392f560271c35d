"""The machine world: what there is, and how it moves."""

import math

import numpy as np
import pytest

import pica
from pica.errors import SceneError
from pica.scene.light import DirectionalLight, PointLight, RectangleLight, SpotLight
from pica.scenes import motion as motions
from pica.scenes import tour
from pica.scenes.conveyor import goods
from pica.scenes.lane import Lane
from pica.scenes.motion import LOOP
from pica.scenes.palette import Palette


@pytest.fixture(scope="module")
def world():
    return pica.scenes.machine_world(seed=1)


def test_machine_world_is_rich_enough_and_not_too_heavy(world):
    assert 30_000 <= world.triangle_count() <= 150_000
    nodes = list(world.nodes())
    kinds = {type(node.light) for node in nodes if node.light}
    assert {DirectionalLight, RectangleLight, PointLight, SpotLight} <= kinds
    meshes = [node.mesh for node in nodes if node.mesh]
    assert len({id(made) for made in meshes}) < 0.6 * len(meshes)
    assert all(node.name for node in nodes)
    materials = [section.material for made in meshes for section in made.sections]
    assert any(any(material.emission) for material in materials)
    assert any(material.metallic == 1 for material in materials)


def test_machine_world_has_parts_that_can_move_about_their_pivots(world):
    for name in ("ram", "belt", "left wheel", "head", "ball", "front left leg", "valve wheel"):
        assert any(node.name == name for node in world.nodes()), name
    for node in world.nodes():
        if node.name in ("left wheel", "ball"):
            low, high = node.mesh.sections[0].positions.min(0), node.mesh.sections[0].positions.max(0)
            np.testing.assert_allclose(low[1:], -high[1:], atol=0.02)  # round about its own X axis


@pytest.mark.thorough
def test_machine_world_depends_on_the_seed_only():
    def places(seed):
        return np.array([node.world for node in pica.scenes.machine_world(seed).nodes()])

    three = places(3)
    assert np.array_equal(three, places(3)) and not np.array_equal(three, places(4))


@pytest.mark.thorough
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_nothing_in_machine_world_intersects_while_it_moves(seed):
    scene = pica.scenes.machine_world(seed, machines=5, robots=8)
    (root,) = scene.roots
    parts = [child for node in root.children if node.name == "factory 0" for child in node.children]
    parts += [node for node in root.children if node.name == "slab"]
    things = [part for part in parts if any(node.mesh for node in part.walk())]
    moving = [bool(set(thing.walk()) & set(movers(scene))) for thing in things]
    triangles, boxes = [None] * len(things), [None] * len(things)
    for time in (0.0, *np.random.default_rng(seed).uniform(0, LOOP, 9)):
        scene.animate(time)
        for i in np.flatnonzero(np.array(moving) | (time == 0)):
            triangles[i] = world_triangles(things[i])
            points = np.ascontiguousarray(triangles[i].reshape(-1, 3).T)
            boxes[i] = points.min(1), points.max(1)
        for i, first in enumerate(triangles):
            for j, second in enumerate(triangles[:i]):
                low, high = np.maximum(boxes[i][0], boxes[j][0]), np.minimum(boxes[i][1], boxes[j][1])
                still = time > 0 and not moving[i] and not moving[j]
                if (low < high).all() and not still and not mingle(things[i].name, things[j].name):
                    a, b = near(first, low, high), near(second, low, high)
                    assert not cuts(a, b) and not cuts(b, a), (time, things[i].name, things[j].name)


def mingle(name, other):
    """Steam comes out of the oven's chimney; chips and puffs pass through one another."""
    kinds = {name.split()[0], other.split()[0]}
    return kinds in ({"puff"}, {"chip"}, {"puff", "oven"})


def movers(scene):
    return list({channel.node: None for animation in scene.animations for channel in animation.channels})


def worlds(scene, times):
    """(times, movers, 4, 4) where everything that moves is."""
    nodes, found = movers(scene), []
    for time in times:
        scene.animate(time)
        found.append([node.world for node in nodes])
    return np.array(found)


def world_triangles(root):
    parts = [
        section.positions[section.indices] @ node.world[:3, :3].T + node.world[:3, 3]
        for node in root.walk()
        if node.mesh
        for section in node.mesh.sections
    ]
    return np.concatenate(parts)


def near(triangles, low, high):
    """Those that reach into a box."""
    return triangles[((triangles.max(1) >= low) & (triangles.min(1) <= high)).all(1)]


def cuts(edges_of, triangles):
    """Whether an edge of the first passes through one of the others (Möller and Trumbore 1997)."""
    a, u, v = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    for corner in range(3):
        start, end = edges_of[:, corner], edges_of[:, (corner + 1) % 3]
        for chunk in np.array_split(np.arange(len(start)), max(1, len(start) * len(a) // 2_000_000)):
            along = (end - start)[chunk, None]
            p = np.cross(along, v)
            determinant = np.einsum("etk,tk->et", p, u)
            with np.errstate(divide="ignore", invalid="ignore"):
                offset = start[chunk, None] - a
                x = np.einsum("etk,etk->et", offset, p) / determinant
                q = np.cross(offset, u)
                y = np.einsum("etk,etk->et", q, along + np.zeros_like(q)) / determinant
                t = np.einsum("etk,tk->et", q, v) / determinant
                if ((x > 0) & (y > 0) & (x + y < 1) & (t > 0) & (t < 1)).any():
                    return True
    return False


@pytest.fixture(scope="module")
def motion(world):
    """Times and places of all movers, 60 times a second."""
    times = np.arange(0, LOOP + 1e-9, 1 / 60)
    return times, worlds(world, times)


def rows(world, *names):
    return [row for row, node in enumerate(movers(world)) if node.name in names]


def test_machine_world_ends_where_it_began(world, motion):
    _, matrices = motion
    assert {animation.name for animation in world.animations} == {"belts", "machines", "robots", "particles"}
    assert all(animation.duration == pytest.approx(LOOP) for animation in world.animations)
    np.testing.assert_allclose(matrices[-1], matrices[0], atol=1e-6)


def test_nothing_that_can_be_seen_jumps(motion):
    _, matrices = motion
    steps = np.linalg.norm(np.diff(matrices[..., :3, 3], axis=0), axis=-1) * 60
    seen = np.minimum(*(np.linalg.norm(m[..., :3, 0], axis=-1) for m in (matrices[1:], matrices[:-1]))) > 0.3
    assert 6 < steps[seen].max() < 10  # metres per second: what the kicker throws
    axes = matrices[..., :3, :3] / np.linalg.norm(matrices[..., :3, :3], axis=-2, keepdims=True)
    cosine = (np.einsum("tnij,tnij->tn", axes[1:], axes[:-1]) - 1) / 2
    assert cosine[seen].min() > math.cos(math.radians(30))


def test_everything_that_should_move_does(world, motion):
    _, matrices = motion
    moved = np.ptp(matrices, axis=0).max((1, 2)) > 0.02
    assert moved.all()
    kinds = {node.name.rstrip(" 0123456789") for node in movers(world)}
    assert {"slat", "drive wheel", "ram", "pad", "large gear", "blades", "drum", "lamp", "puff", "chip"} <= kinds
    assert {"roller", "walker", "balancer", "left wheel", "ball", "head", "eye", "front left foot"} <= kinds


def test_wheels_turn_as_far_as_they_roll(world, motion):
    _, matrices = motion
    for row in rows(world, "left wheel", "right wheel", "ball"):
        path = matrices[:, row]
        radius = path[0, 1, 3]
        # The point that touches the floor: its speed is that of the middle plus the turn's.
        spin = np.cross(path[:-1, :3, :3], path[1:, :3, :3], axis=1).sum(-1) / 2
        slip = np.diff(path[:, :3, 3], axis=0) + np.cross(spin, (0, -radius, 0))
        rolled = np.linalg.norm(np.diff(path[:, :3, 3], axis=0), axis=1).sum()
        assert np.linalg.norm(slip, axis=1).sum() < 0.06 * rolled


def test_feet_stand_still_while_they_are_down(world, motion):
    _, matrices = motion
    names = (f"{a} {b} foot" for a in ("front", "back") for b in ("left", "right"))
    feet = matrices[:, rows(world, *names)][..., :3, 3]
    floor = feet[..., 1].min()
    down = (feet[1:, :, 1] < floor + 1e-3) & (feet[:-1, :, 1] < floor + 1e-3)
    slide = np.linalg.norm(np.diff(feet[..., [0, 2]], axis=0), axis=-1) * 60
    assert 0.4 < down.mean() < 0.6
    assert slide[down].max() < 0.06 and np.median(slide[down]) < 0.005  # metres per second; they go at 0.6
    assert feet[..., 1].max() - floor == pytest.approx(0.05, abs=0.005)


def test_gears_turn_against_each_other_as_their_teeth(world):
    turns = {}
    for channel in world.animations[1].channels:
        if channel.node.name.endswith("gear"):
            half = np.unwrap(np.arctan2(channel.values[:, 2], channel.values[:, 3]), period=math.pi)
            turns[channel.node.name] = (half[-1] - half[0]) / math.pi
    assert turns["large gear"] * 16 == pytest.approx(-turns["upper gear"] * 10)
    assert turns["upper gear"] == pytest.approx(turns["lower gear"])


def test_goods_ride_on_the_belts_as_fast_as_the_slats(world, motion):
    _, matrices = motion
    slats = np.diff(matrices[:, rows(world, *(f"slat {i}" for i in range(8)))][..., :3, 3], axis=0) * 60
    kinds = ("orange", "apple", "plum", "tin")
    riding = [row for row, node in enumerate(movers(world)) if node.name.split()[0] in kinds]
    speed = np.diff(matrices[:, riding][..., :3, 3], axis=0) * 60
    at_rest = (np.abs(speed[..., 1]) < 1e-6) & (np.linalg.norm(speed, axis=-1) > 0.1)
    for axis, share in ((0, 0.44), (2, 0.38)):
        fastest = slats[..., axis].max()
        assert speed[at_rest][:, axis].max() == pytest.approx(fastest, rel=1e-3)
        carried = at_rest & (np.abs(speed[..., axis] - fastest) < 1e-3)
        assert carried.mean() == pytest.approx(share, abs=0.03)
    heights = matrices[1:, riding][..., 1, 3][at_rest & (speed[..., 0] > 0.3)]
    np.testing.assert_allclose(heights, 0.72 + 0.012, atol=1e-6)


@pytest.mark.parametrize("side", [-0.07, 0.07])
def test_goods_are_on_the_kicker_before_it_kicks(side):
    for good in goods(Palette()):
        times, _ = tour._path(good, side)
        assert (np.diff(times) > 0).all() and times[0] == 0 and times[-1] == LOOP


def test_robots_keep_apart():
    scene = pica.scenes.machine_world(2, robots=8)
    robots = [row for row, node in enumerate(movers(scene)) if node.name.split()[0] in ("roller", "walker", "balancer")]
    places = worlds(scene, np.linspace(0, LOOP, 97))[:, robots][..., :3, 3]
    gaps = np.linalg.norm(places[:, :, None] - places[:, None], axis=-1)[:, *np.triu_indices(8, 1)]
    assert gaps.min() > 0.95


def test_machine_world_grows_to_a_million_triangles():
    scene = pica.scenes.machine_world(machines=28, robots=42, glass=False)
    assert 900_000 < scene.triangle_count() < 1_010_000
    factories = [node for node in scene.roots[0].children if node.name.startswith("factory")]
    names = [child.name.split()[0] for factory in factories for child in factory.children]
    assert sum(names.count(kind) for kind in ("tank", "gear", "fan", "mixer")) == 28
    assert sum(names.count(kind) for kind in ("roller", "walker", "balancer")) == 42
    assert len({id(node.mesh) for node in scene.nodes() if node.mesh}) < 120
    changes = scene.subscribe()
    scene.animate(1.0)
    below = {node for mover in movers(scene) for node in mover.walk()}
    assert set(changes.take().moved) <= below


@pytest.mark.parametrize("counts", [{"machines": 29}, {"machines": -1}, {"robots": 43}])
def test_a_world_out_of_range_is_an_error_of_one_line(counts):
    with pytest.raises(SceneError, match=r"machine_world: (machines|robots)=-?\d+ is out of range; ask for 0 to \d+$"):
        pica.scenes.machine_world(**counts)


def test_lanes_close_and_turn_left():
    lane = Lane(center=(1.0, -2.0), straight=(2.0, 0.5), radius=0.7)
    distance = np.linspace(0, lane.length, 2001)
    places, headings = lane.at(distance)
    np.testing.assert_allclose(places[-1], places[0], atol=1e-9)
    assert headings[-1] - headings[0] == pytest.approx(2 * math.pi)
    steps = np.diff(places, axis=0) / np.diff(distance)[:, None]
    ahead = np.stack([np.sin(headings), np.zeros_like(headings), np.cos(headings)], -1)
    np.testing.assert_allclose(steps, ahead[:-1], atol=0.006)
    np.testing.assert_allclose((places.min(0) + places.max(0)) / 2, (1, 0, -2), atol=1e-3)


def test_rotations_out_of_matrices_are_those_that_went_in():
    for axis in np.eye(3):
        for degrees in (0, 30, 180, 300):
            (rotation,) = motions.about(axis, math.radians(degrees))
            matrix = np.eye(4)
            matrix[:3, :3] = motions.turned(np.repeat(rotation[None], 3, 0), np.eye(3)).T
            assert abs(motions.rotation_of(matrix) @ rotation) == pytest.approx(1)

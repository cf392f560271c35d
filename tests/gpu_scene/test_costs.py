"""Scenes that change: draw lists and lights are what they would be in a new copy, and cost what has changed."""

import numpy as np
import pytest

import pica
from pica.gpu_scene.draws import DrawLists
from pica.gpu_scene.lights import emissive_triangles, placed_lights
from pica.gpu_scene.record_set import RecordSet
from pica.rhi.acceleration import RtScene
from pica.rhi.tables import Runs
from pica.scene.light import DirectionalLight, PointLight, SphereLight
from pica.scene.model import Mesh, Node
from pica.scene.primitives import spheres
from pica.scenes.basic_meshes import box, plane
from pica.scenes.placing import move, rotate
from tests.building import lambert, leaves, scene_of, uniform
from tests.rays import gpu_scene

CAMERA = pica.Camera.look_at((0, 2, 6), (0, 0, 0))
MESHES = [
    Mesh([box(0.4, lambert()), plane(0.5, 0.5, leaves())]),
    Mesh([plane(0.5, 0.5, lambert(emission=(3.0, 2.0, 1.0)), 2)]),
    Mesh([box(0.3, lambert(emission=(1.0, 2.0, 1.0), double_sided=True)), box(0.2, lambert())]),
    Mesh([box(0.3, lambert())], primitives=[spheres([[0, 0, 0]], 0.3, lambert())]),
]
LIGHTS = [PointLight(intensity=3.0), DirectionalLight(illuminance=1.0), SphereLight(radiance=4.0, radius=0.2)]


class Follower:
    """A copy of a scene on a device that follows it, and what it lists."""

    def __init__(self, device, scene):
        self.device, self.scene = device, scene
        self.view = gpu_scene(device, scene)
        self.update()

    def update(self):
        with self.device.record() as recording:
            self.view.update(recording, CAMERA)
            self.lists = {"draws": self.view.draws(recording), "casters": self.view.casters(recording)}
        self.device.handle.wait_for_idle()
        return self

    def draws(self, name):
        """(node, material, kind, indices, instances) of every draw that is not a hole."""
        labels, names = self.view.labels(), self._names()
        found = []
        for draws in self.lists[name]:
            rows = draws.arguments.to_numpy().view(np.uint32).reshape(-1, 5)[: draws.count]
            rows = rows[rows[:, 1] > 0]
            found += [(names[labels[row[4], 0]], draws.kind, *row[:2].tolist()) for row in rows]
        return sorted(found, key=repr)

    def lights(self):
        """(name, share) of the lights, and the share of each triangle that shines by node and number."""
        table, labels, names = self.view.lights, self.view.labels(), self._names()
        rows = table._table
        emissive = table.parameters["emissiveTriangles"].to_numpy().view(np.uint8).reshape(-1)
        emissive = emissive.view(emissive_triangles.EMISSIVE_TRIANGLE)[: table.parameters["emissiveCount"]]
        shares = np.diff(emissive["cumulative"].astype(np.float64), prepend=0)
        triangles = []
        for index in np.flatnonzero(shares > 0):
            record, primitive = emissive[index]["record"], int(emissive[index]["primitive"])
            assert self.view.records["first_emissive"][record] + primitive == index
            material = self.view.records["material"][record]
            triangles.append((names[labels[record, 0]], bool(material), primitive, round(shares[index], 5)))
        lights = sorted(
            (name, round(float(share), 5))
            for name, share in zip(table.names, rows["selectionProbability"], strict=False)
        )
        assert (np.diff(table._table["selectionProbability"][: table.light_count]) <= 0).all(), "strongest first"
        return lights, sorted((name, primitive, share) for name, _, primitive, share in triangles)

    def _names(self):
        return {number: node.name for node, number in self.view.scene.arrivals.numbers.items()}


def newcomer(rng, number):
    node = Node(f"node {number}")
    if rng.random() < 0.75:
        node.mesh = MESHES[rng.integers(len(MESHES))]
        if rng.random() < 0.3:
            node.instances = np.stack([move(x=0.1 * i) for i in range(3)])
    if node.mesh is None or rng.random() < 0.1:
        node.light = LIGHTS[rng.integers(len(LIGHTS))]
    mirror = np.diag([rng.choice([-1.0, 1.0]), 1, 1, 1])
    node.transform = move(*rng.uniform(-1, 1, 3)) @ rotate("y", rng.uniform(0, 360)) @ mirror
    return node


def corner(x):
    """A small thing at a corner of the scene, so that its size is the same in all copies."""
    node = Node(f"corner {x}", mesh=Mesh([box(0.1, lambert())]))
    node.transform = move(x, x, x)
    return node


def test_lists_and_lights_are_those_of_a_new_copy(device):
    rng = np.random.default_rng(7)
    nodes = [newcomer(rng, number) for number in range(12)]
    scene = scene_of(corner(-4.0), corner(4.0), *nodes, environment=uniform(0.2, 0.2, 0.2))
    follower = Follower(device, scene)
    for step in range(12):
        for node in rng.choice(nodes, 2, replace=False):
            scene.remove(node)
            nodes.remove(node)
        for extra in range(int(rng.integers(4))):
            nodes.append(scene.add(newcomer(rng, 100 * (step + 1) + extra)))
        some = nodes[int(rng.integers(len(nodes)))]
        some.transform = some.transform @ np.diag([-1.0, 1, 1, 1])
        some.visible_to_camera = not some.visible_to_camera
        other = nodes[int(rng.integers(len(nodes)))]
        other.visible_to_reflections = not other.visible_to_reflections
        other.light = None if other.light else LIGHTS[0]
        follower.update()
        with_new_copy = Follower(device, copied(scene))
        for name in follower.lists:
            assert follower.draws(name) == with_new_copy.draws(name), (step, name)
        lights, triangles = follower.lights()
        expected_lights, expected_triangles = with_new_copy.lights()
        assert lights == expected_lights, step
        assert [t[:2] for t in triangles] == [t[:2] for t in expected_triangles], step
        np.testing.assert_allclose([t[2] for t in triangles], [t[2] for t in expected_triangles], atol=2e-5)


def copied(scene):
    """Another scene with nodes like these."""
    copies = []
    for node in scene.nodes():
        like = Node(node.name, mesh=node.mesh, light=node.light, instances=node.instances)
        like.transform = node.transform
        like.visible_to_camera, like.visible_to_reflections = node.visible_to_camera, node.visible_to_reflections
        copies.append(like)
    return scene_of(*copies, environment=scene.environment)


@pytest.fixture
def counted(monkeypatch):
    """How much work was done: records listed, lights packed, sections' triangles measured."""
    counts = {"records": 0, "lights": 0, "triangles": 0}

    def counting(name, function, size):
        def wrapper(*arguments):
            counts[name] += size(*arguments)
            return function(*arguments)

        return wrapper

    monkeypatch.setattr(DrawLists, "put", counting("records", DrawLists.put, lambda lists, records, *_: len(records)))
    monkeypatch.setattr(placed_lights, "pack_light", counting("lights", placed_lights.pack_light, lambda *_: 1))
    areas = emissive_triangles._areas
    monkeypatch.setattr(
        emissive_triangles, "_areas", counting("triangles", areas, lambda s, linear: len(s.indices) * len(linear))
    )
    return counts


def test_what_comes_and_goes_costs_what_it_is_and_not_what_is_there(device, counted):
    nodes = []
    for number in range(200):
        node = Node(mesh=MESHES[number % 4], light=LIGHTS[0] if number % 5 == 0 else None)
        node.transform = move(x=0.1 * number)
        nodes.append(node)
    follower = Follower(device, scene_of(*nodes, environment=uniform(1, 1, 1)))

    def cost(change):
        counted.update(dict.fromkeys(counted, 0))
        change()
        follower.update()
        return tuple(counted.values())

    matt, glow, lamp = Node(mesh=MESHES[0]), Node(mesh=MESHES[1]), Node(light=LIGHTS[0])
    triangles = len(MESHES[1].sections[0].indices)
    follower.update()
    assert cost(lambda: None) == (0, 0, 0)
    # Records count twice: for the camera and for shadow maps.
    for node, expected in ((matt, (4, 0, 0)), (glow, (2, 0, triangles)), (lamp, (0, 1, 0))):
        assert cost(lambda node=node: follower.scene.add(node)) == expected
        assert cost(lambda node=node: follower.scene.remove(node)) == (expected[0], 0, 0)
    assert cost(lambda: setattr(nodes[0], "transform", move(y=2.0))) == (0, 1, 0)
    assert cost(lambda: setattr(nodes[4], "visible_to_camera", False)) == (4, 0, 0)
    assert len(follower.draws("draws")) == record_count(follower) - 2


def test_nodes_that_come_together_are_taken_in_together(device, monkeypatch):
    follower = Follower(device, scene_of(corner(0.0), environment=uniform(1, 1, 1)))
    calls = []

    def called(holder, name):
        function = getattr(holder, name)
        monkeypatch.setattr(holder, name, lambda *values: calls.append(name) or function(*values))

    called(RecordSet, "add")
    called(RtScene, "place")
    for mesh in MESHES[1:3]:
        for number in range(50):
            copies = np.tile(move(x=0.1 * number), (number % 3, 1, 1))
            follower.scene.add(Node(mesh=mesh, instances=copies))
    follower.update()
    assert sorted(calls) == ["add", "add", "place", "place", "place"], "once a mesh, once a part of a mesh"
    assert len(follower.view.scene.placements) == 1 + 2 * 33
    objects = follower.view.scene.rt_scene
    rows = objects.slots.rows[sorted(objects.objects)]
    assert sorted(rows["id_and_mask"] & 0xFFFFFF) == list(range(record_count(follower)))


def record_count(follower):
    return follower.view.scene.records.count


def test_runs_that_are_given_back_join():
    rng = np.random.default_rng(3)
    runs, taken = Runs(), {}
    for _ in range(400):
        if taken and rng.random() < 0.5:
            first = list(taken)[rng.integers(len(taken))]
            runs.give_back(first, taken.pop(first))
        else:
            count = int(rng.integers(1, 6))
            first = runs.take(count)
            assert all(first + count <= other or other + size <= first for other, size in taken.items())
            taken[first] = count
    for first, count in taken.items():
        runs.give_back(first, count)
    assert runs._free == [(0, runs.end)] and runs.take(runs.end) == 0


def test_holes_are_filled_before_lists_grow(device):
    scene = scene_of(Node(mesh=MESHES[0]), environment=uniform(1, 1, 1))
    follower = Follower(device, scene)
    for _ in range(30):
        guest = scene.add(Node(mesh=MESHES[0]))
        follower.update()
        scene.remove(guest)
        follower.update()
    assert all(draws.count <= 2 for draws in follower.lists["draws"])

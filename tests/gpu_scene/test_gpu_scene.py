"""A scene on the GPU follows what moves, and uploads no more than that."""

from collections import Counter

import numpy as np
import pytest

import pica
from pica.gpu_scene.previous_frame import PLACE
from pica.gpu_scene.table_rows import INSTANCE
from pica.scene.light import DirectionalLight, PointLight
from pica.scene.material import Material
from pica.scene.model import Mesh, Node
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import aim, at, move, rotate, stretch
from tests.building import (
    CAMERA,
    RASTER,
    RAYS,
    SIZE,
    bumps,
    edges,
    lambert,
    leaves,
    placed,
    render,
    scene_of,
    settings,
    shining,
    sky,
    still_life,
    uniform,
)
from tests.rays import gpu_scene

WAYS = pytest.mark.parametrize("values", [RASTER, RAYS], ids=["raster", "rays"])


class CountingEncoder:
    """Passes everything on and counts uploads, in bytes, and builds."""

    def __init__(self, encoder):
        self.encoder = encoder
        self.calls = Counter()
        self.uploaded = 0

    def __getattr__(self, name):
        return getattr(self.encoder, name)

    def upload_buffer_data(self, buffer, offset, data):
        self.calls["upload"] += 1
        self.uploaded += np.asarray(data).nbytes
        self.encoder.upload_buffer_data(buffer, offset, data)

    def build_acceleration_structure(self, desc, **more):
        self.calls[type(desc.inputs[0]).__name__] += 1
        self.encoder.build_acceleration_structure(desc=desc, **more)


def update(device, scene):
    """What an update recorded, and whether it says that something moved."""
    with device.record() as recording:
        recording.encoder = counting = CountingEncoder(recording.encoder)
        moved = scene.update(recording, CAMERA)
        recording.encoder = counting.encoder
    return counting, moved


def test_moving_one_node_uploads_that_node_and_builds_the_top_level_only(device):
    nodes = [placed(box(1, lambert()), move(2 * place, 0, 0)) for place in range(50)]
    scene = gpu_scene(device, scene_of(*nodes))
    assert update(device, scene)[1], "a view's first frame"
    still, moved = update(device, scene)
    assert not moved and not still.calls
    nodes[7].transform = move(0, 3, 0)
    one, moved = update(device, scene)
    assert moved
    assert one.calls["AccelerationStructureBuildInputInstances"] == 1
    assert one.calls["AccelerationStructureBuildInputTriangles"] == 0
    assert 0 < one.uploaded <= 64 + INSTANCE.itemsize, "one driver record and one instance"
    after, moved = update(device, scene)
    assert not moved, "the frame after only makes the motion zero again"
    assert set(after.calls) == {"upload"} and after.uploaded <= PLACE.itemsize, "where it was before is where it is"
    assert not update(device, scene)[0].calls


def test_moving_a_parent_moves_what_hangs_on_it(device):
    parent = Node("parent")
    parent.add(placed(box(1, lambert())))
    bystander = placed(box(1, lambert()), move(9, 0, 0))
    scene = gpu_scene(device, scene_of(parent, bystander))
    update(device, scene)
    parent.transform = move(1, 2, 3)
    counted, moved = update(device, scene)
    assert moved and 0 < counted.uploaded <= 64 + INSTANCE.itemsize
    np.testing.assert_array_equal(scene.instances["to_world"][0][:, 3], [1, 2, 3])
    np.testing.assert_array_equal(scene.instances["to_world"][1][:, 3], [9, 0, 0])


def test_a_node_without_anything_to_see_does_not_count_as_moved(device):
    empty = Node("empty")
    scene = gpu_scene(device, scene_of(empty, placed(box(1, lambert()))))
    update(device, scene)
    empty.transform = move(1, 0, 0)
    counted, moved = update(device, scene)
    assert not moved and not counted.calls


def compare_with_new_scene(device, change, values=None, frames=2, tolerance=0.0):
    """The picture after `change` is the one of a scene that was built that way, to the last bit or `tolerance`."""
    scene = still_life()
    renderer = pica.Renderer(scene, size=SIZE, settings=settings(values), device=device)
    before = renderer.render(1, camera=CAMERA)
    change({node.name: node for node in scene.nodes()})
    renderer.advance(CAMERA)
    renderer.reset()
    after = renderer.render(frames, camera=CAMERA)
    fresh = still_life()
    change({node.name: node for node in fresh.nodes()})
    new = render(device, fresh, frames, CAMERA, values=values)
    assert not np.array_equal(before.color, new.color)
    np.testing.assert_allclose(after.color, new.color, rtol=tolerance)
    for name in ("depth", "normal", "motion", "instance"):
        np.testing.assert_array_equal(after.aov(name), new.aov(name), err_msg=name)


@WAYS
def test_picture_after_moving_an_object_is_that_of_a_new_scene(device, values):
    def change(nodes):
        nodes["box"].transform = move(0.3, 0.9, -0.2) @ rotate("x", 40)
        nodes["ball"].transform = move(-0.9, 0.5, 0) @ stretch(1, 0.5, 1)

    compare_with_new_scene(device, change, values)


@WAYS
def test_picture_after_mirroring_an_object_is_that_of_a_new_scene(device, values):
    def change(nodes):
        nodes["cone"].transform = nodes["cone"].transform @ stretch(-1, 1, 1)

    compare_with_new_scene(device, change, values)


def test_picture_after_moving_a_light_is_that_of_a_new_scene(device):
    def change(nodes):
        nodes["light"].transform = aim((-2, 2, 1), (0, 0, 0))

    compare_with_new_scene(device, change)


def test_picture_after_moving_what_shines_is_that_of_a_new_scene(device):
    def change(nodes):
        nodes["glow"].transform = move(0.5, 1.4, 0.5) @ rotate("x", 180)

    # How often the sky is sampled goes by the scene's bounds, which only grow. The last bits of a triangle's area say
    # on which side of a border some points of it lie. Layers are lit by samples of all lights, the sky's among them.
    values = {"lighting.environment": "prefiltered", "transparency.mode": "off"}
    compare_with_new_scene(device, change, values, tolerance=0.01)


@WAYS
@pytest.mark.parametrize("mirror", [stretch(-1, 1, 1), stretch(1, -1, 1), stretch(-1.5, -1, -0.7)])
def test_a_mirroring_node_shows_what_mirrored_triangles_show(device, values, mirror):
    """Front faces, normals, normal maps and texture all mirror, single-sided and double-sided alike."""
    bumpy = Material(base_color=(0.7, 0.5, 0.4, 1), metallic=0.0, roughness=0.6, normal_texture=bumps())
    shapes = [
        (at(box(0.8, bumpy), rotate("y", 25)), move(-0.5, 0.5, 0)),
        (at(plane(0.9, 0.9, leaves()), rotate("x", 60), rotate("y", 20)), move(0.7, 0.5, 0)),
    ]
    sun = DirectionalLight(illuminance=3.0)

    def picture(mirrored):
        nodes = [mirrored(section, place) for section, place in shapes]
        lights = [shining(sun, aim((1, 2, 2), (0, 0, 0)))]
        return render(device, scene_of(*nodes, *lights, environment=uniform(0.2)), 1, CAMERA, values=values)

    by_node = picture(lambda section, place: placed(section, place @ mirror))
    by_triangles = picture(lambda section, place: placed(at(section, mirror), place))
    inside = ~edges(by_triangles.aov("instance")) & ~edges(by_node.aov("instance"))
    assert (by_triangles.aov("instance")[inside] == 1).sum() > 100
    np.testing.assert_array_equal(by_node.aov("instance")[inside], by_triangles.aov("instance")[inside])
    np.testing.assert_allclose(by_node.aov("normal")[inside], by_triangles.aov("normal")[inside], atol=0.02)
    assert np.abs(by_node.color - by_triangles.color)[inside].mean() < 2e-3


@WAYS
def test_copies_look_like_nodes_of_their_own(device, values):
    section = at(box(0.5, lambert(0.7, 0.5, 0.3)), rotate("y", 20))
    section_turn = rotate("z", 15)
    spots = [move(x, 0.4, z) @ section_turn for x in (-0.8, 0, 0.8) for z in (-0.5, 0.5)]
    spots[2] = spots[2] @ stretch(-1, 1, 1)
    copied = Node("copies", mesh=Mesh([section]))
    copied.transform = rotate("y", 30)
    copied.instances = np.stack(spots)
    apart = [placed(section, rotate("y", 30) @ spot) for spot in spots]
    one, many = (
        render(device, scene_of(*nodes, environment=sky()), 1, CAMERA, values=values) for nodes in ([copied], apart)
    )
    assert set(np.unique(one.aov("instance"))) == {0, 1}
    assert set(np.unique(many.aov("instance"))) == set(range(7))
    np.testing.assert_array_equal(one.color, many.color)
    np.testing.assert_array_equal(one.aov("depth"), many.aov("depth"))


def test_copies_follow_their_node(device):
    node = placed(box(0.5, lambert()))
    node.instances = np.stack([move(-1, 0, 0), move(1, 0, 0)])
    scene = scene_of(node, environment=uniform(1))
    renderer = pica.Renderer(scene, size=SIZE, settings=settings(), device=device)
    renderer.render(1, camera=CAMERA)
    node.transform = move(0, 0.7, 0) @ rotate("y", 50)
    renderer.advance(CAMERA)
    renderer.reset()
    moved = renderer.render(1, camera=CAMERA)
    new = render(device, scene, 1, CAMERA)
    np.testing.assert_array_equal(moved.color, new.color)


@WAYS
def test_no_copies_at_all(device, values):
    node = placed(box(0.5, lambert()))
    node.instances = np.zeros((0, 4, 4))
    frame = render(device, scene_of(node, environment=uniform(1)), values=values)
    assert not frame.aov("instance").any()


@WAYS
def test_an_empty_scene_shows_its_surroundings(device, values):
    frame = render(device, scene_of(environment=uniform(0.25, 0.5, 1)), 2, CAMERA, values=values)
    np.testing.assert_allclose(frame.color, np.broadcast_to([0.25, 0.5, 1], frame.color.shape), rtol=1e-6)
    assert not frame.aov("instance").any() and np.isinf(frame.aov("depth")).all()
    black = render(device, scene_of(), 1, values=values)
    assert not black.color.any()
    np.testing.assert_array_equal(black.display, 0)


def test_an_empty_scene_can_be_path_traced(device):
    scene = scene_of(environment=uniform(0.25, 0.5, 1))
    frame = pica.PathTracer(scene, size=SIZE, device=device).render(2)
    np.testing.assert_allclose(frame.color, np.broadcast_to([0.25, 0.5, 1], frame.color.shape), rtol=1e-6)


@WAYS
def test_a_scene_without_lights_is_dark(device, values):
    frame = render(device, scene_of(placed(box(1, lambert()))), 2, values=values)
    assert frame.aov("instance").any() and not frame.color.any()


def test_lights_without_anything_to_light(device):
    frame = render(device, scene_of(shining(PointLight()), shining(DirectionalLight())))
    assert not frame.color.any()


@WAYS
def test_collapsed_transforms_are_harmless(device, values):
    flat = placed(sphere(0.6, lambert()), move(0, 0.5, 0) @ stretch(1, 0, 1))
    point = placed(box(0.5, lambert()), stretch(0, 0, 0))
    frame = render(device, scene_of(flat, point, environment=uniform(1)), 2, CAMERA, values=values)
    assert np.isfinite(frame.color).all()

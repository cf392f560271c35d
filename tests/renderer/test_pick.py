"""Renderer.pick: what a pixel shows, of every kind of surface, and what lies behind glass."""

from dataclasses import replace

import numpy as np
import pytest

import pica
from pica.scene.camera import Camera
from pica.scene.material import AlphaMode, Material
from pica.scene.mesh import Mesh
from pica.scene.model import Node
from pica.scene.primitives import spheres
from pica.scene.skin import Skin
from pica.scenes.basic_meshes import box, plane
from pica.scenes.placing import move, rotate, stretch
from tests.building import EMBREE, RAYS, lambert, leaves, orthographic, placed, projected, scene_of, settings

SIZE = (120, 60)
CAMERA = Camera.look_at((0, 0, 10), (0, 0, 0), vertical_fov=np.radians(40))
PLAIN = {"transparency.mode": "off", "shadows.mode": "off", "ambient_occlusion.mode": "off"}
"""What is picked does not depend on these, and their programs are large."""


def stands(material: Material, x: float, y: float, z: float, name: str) -> Node:
    """One metre of a material, upright, towards +Z."""
    return placed(plane(1, 1, material), move(x, y, z) @ rotate("x", 90), name)


def tall() -> Node:
    """A bar that a joint lifts by half of its height."""
    bar = Node("bar", mesh=Mesh([box((0.6, 1, 0.2), lambert(0.7, name="bar's"))], "bar"))
    section = bar.mesh.sections[0]
    count = len(section.positions)
    section.joints, section.weights = np.zeros((count, 1), np.uint16), np.ones((count, 1), np.float32)
    root, joint = Node("root"), Node("joint")
    root.add(joint)
    root.transform = move(3, -1.5, 0)
    root.add(bar)
    bar.skin = Skin([joint], np.eye(4)[None])
    joint.transform = move(0, 0.5, 0)
    return root


def scene() -> pica.Scene:
    """In the upper row surfaces of one kind each, in front of a wall; below, others. All from x = -4 to 4."""
    wall = placed(plane(12, 6, lambert(0.5, name="plaster")), move(0, 0, -1) @ rotate("x", 90), "wall")
    single = Mesh(
        [
            box(0.5, lambert(0.2, name="two sides", double_sided=True)),
            box((0.5, 0.5, 0.01), lambert(0.9, name="front"), 0.0),
        ],
        "two sections",
    )
    single.sections[1].positions = single.sections[1].positions + np.float32((0, 0, 0.5))
    mirrored = Node("mirrored", mesh=single)
    mirrored.transform = move(-4, 1, 0) @ stretch(-1, 1, 1)
    crowd = Node("crowd", mesh=Mesh([box(0.3, lambert(0.4))], "small box"))
    crowd.instances = np.stack([move(x, 1, 0) for x in (-2.5, -2, -1.5)])
    ball = Node("balls", mesh=Mesh(primitives=[spheres([(9, 9, 9), (0, 0, 0)], 0.5, lambert(0.6, name="ball"))]))
    ball.transform = move(0, 1, 0) @ stretch(1, 0.5, 1)
    glass = Material("glass", transmission=1.0, roughness=0.0, thin_walled=True)
    return scene_of(
        wall,
        mirrored,
        crowd,
        ball,
        stands(glass, 2, 1, 0, "pane"),
        stands(glass, 2, 1, 0.5, "front pane"),
        tall(),
        stands(leaves(AlphaMode.MASK), -4, -1, 0, "mask"),
        stands(leaves(AlphaMode.BLEND), -2, -1, 0, "blend"),
        stands(lambert(0.5, 0.5, 0.5, base_color=(1, 1, 1, 0), alpha_mode=AlphaMode.BLEND), 0, -1, 0, "nothing"),
    )


def pixel_of(*point: float) -> tuple[int, int]:
    x, y = np.floor(projected(CAMERA, [point], SIZE)[0])
    return int(x), int(y)


@pytest.fixture(scope="module", params=[RAYS | PLAIN, EMBREE | PLAIN], ids=["pipeline", "embree"])
def renderer(request, device):
    made = pica.Renderer(scene(), size=SIZE, settings=settings(request.param), device=device)
    made.render(frames=3, camera=CAMERA, aovs=())  # the last frame is jittered
    return made


def test_a_surface_is_found_with_all_that_makes_it(renderer):
    found = renderer.pick(*pixel_of(5, 0, -1))
    assert (found.node.name, found.material.name, found.section, found.primitives) == ("wall", "plaster", 0, None)
    assert found.mesh is found.node.mesh and found.instance == 0
    x, y = pixel_of(5, 0, -1)
    np.testing.assert_allclose(projected(CAMERA, [found.position], SIZE)[0], (x + 0.5, y + 0.5), atol=1e-3)
    np.testing.assert_allclose(found.position[2], -1, atol=1e-5)
    np.testing.assert_allclose(found.normal, (0, 0, 1), atol=1e-6)
    np.testing.assert_allclose(found.distance, np.linalg.norm(found.position - (0, 0, 10)), rtol=1e-6)
    assert found.element in (0, 1)
    assert renderer.pick(0, 0) is None and renderer.pick(119, 59) is None


def test_sections_of_a_mirrored_node_count_as_the_mesh_has_them(renderer):
    found = renderer.pick(*pixel_of(-4, 1, 0.5))
    assert (found.node.name, found.section, found.material.name) == ("mirrored", 1, "front")
    np.testing.assert_allclose(found.normal, (0, 0, 1), atol=1e-6)


def test_instances_are_told_apart(renderer):
    found = [renderer.pick(*pixel_of(x, 1, 0.15)) for x in (-2.5, -2, -1.5)]
    assert [each.instance for each in found] == [0, 1, 2]
    assert {each.node.name for each in found} == {"crowd"}


def test_shapes_have_their_number_and_their_normal(renderer):
    found = renderer.pick(*pixel_of(0, 1.1, 0.45))
    assert (found.node.name, found.section, found.primitives, found.element) == ("balls", None, 0, 1)
    gradient = (found.position - (0, 1, 0)) / np.square((0.5, 0.25, 0.5))
    np.testing.assert_allclose(np.square((found.position - (0, 1, 0)) / (0.5, 0.25, 0.5)).sum(), 1, atol=1e-4)
    np.testing.assert_allclose(found.normal, gradient / np.linalg.norm(gradient), atol=1e-3)


def test_skinned_vertices_are_where_the_picture_has_them(renderer):
    assert renderer.pick(*pixel_of(3, -0.6, 0.1)).node.name == "bar"
    assert renderer.pick(*pixel_of(3, -1.9, 0.1)).node.name == "wall"


def test_glass_is_first_and_can_be_looked_through(renderer):
    place = pixel_of(2, 1, 0.5)
    assert renderer.pick(*place).node.name == "front pane"
    assert renderer.pick(*place, through_glass=True).node.name == "wall"


def test_masks_have_holes_and_blended_surfaces_have_not(renderer):
    # The board has 4x4 fields: of two neighbours one is a hole, alpha 40 of 255 there.
    fields = [-0.125, 0.125]
    assert {renderer.pick(*pixel_of(-4 + x, -1.125, 0)).node.name for x in fields} == {"mask", "wall"}
    assert {renderer.pick(*pixel_of(-2 + x, -1.125, 0)).node.name for x in fields} == {"blend"}
    behind = {renderer.pick(*pixel_of(-2 + x, -1.125, 0), through_glass=True).node.name for x in fields}
    assert behind == {"blend", "wall"}, "points that cover all stay"
    assert renderer.pick(*pixel_of(0, -1, 0)).node.name == "wall", "alpha 0"


def test_the_scene_is_that_of_the_frame(device, renderer):
    [node] = [node for node in renderer.scene.nodes() if node.name == "crowd"]
    before = node.transform
    node.transform = move(0, 30, 0)
    assert renderer.pick(*pixel_of(-2, 1, 0.15)).node is node
    renderer.render(frames=1, camera=CAMERA, aovs=())
    assert renderer.pick(*pixel_of(-2, 1, 0.15)).node.name == "wall"
    node.transform = before
    renderer.render(frames=1, camera=CAMERA, aovs=())


def test_pixels_outside_are_refused(renderer):
    for place, fault in [((120, 0), "x: 120"), ((0, -1), "y: -1"), ((0.5, 0), "x: 0.5"), (("a", 0), "x: 'a'")]:
        with pytest.raises(pica.PicaError, match=f"pick: {fault}"):
            renderer.pick(*place)
    with pytest.raises(pica.PicaError, match="through_glass"):
        renderer.pick(0, 0, through_glass="yes")


def test_there_is_nothing_to_pick_before_a_frame(renderer):
    renderer.resize((60, 30))
    with pytest.raises(pica.PicaError, match="no frame yet"):
        renderer.pick(0, 0)
    renderer.resize(SIZE)
    renderer.render(frames=1, camera=CAMERA, aovs=())
    assert renderer.pick(*pixel_of(5, 0, -1)) is not None


def test_pixels_are_the_outputs_with_upscaling_and_without_rays_in_the_frame(device):
    values = pica.Settings.preset("raster").with_values({"antialiasing.upscale": 2.0, "transparency.mode": "off"})
    renderer = pica.Renderer(scene(), size=SIZE, settings=values, device=device)
    renderer.render(frames=2, camera=CAMERA, aovs=())
    for point, name in [((2, 1, 0.5), "front pane"), ((-4, 1, 0.5), "mirrored"), ((0, 1.1, 0.45), "balls")]:
        assert renderer.pick(*pixel_of(*point)).node.name == name
    assert renderer.pick(*pixel_of(2, 1, 0.5), through_glass=True).node.name == "wall"
    camera = replace(orthographic((0, 0, 10), (0, 0, 0), 6.0), principal_point=(0.25, 0.5))
    renderer.render(frames=1, camera=camera, aovs=())
    found = renderer.pick(30, 30)
    np.testing.assert_allclose(found.position, (0.05, -0.05, -1), atol=1e-4)
    np.testing.assert_allclose(found.distance, 11, atol=1e-4)

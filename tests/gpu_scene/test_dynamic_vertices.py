"""Cloth that is moved from Python, and deformers that nobody knows."""

from types import SimpleNamespace

import numpy as np
import pytest

import pica
from pica.errors import SceneError
from pica.gpu_scene.deformation.deformation import deform_all
from pica.scene.deformer import Deformer
from pica.scene.light import DirectionalLight
from pica.scene.model import Mesh, Node, Section
from pica.scene.tangents import generate_tangents
from pica.scenes.basic_meshes import plane
from pica.scenes.placing import aim, move, rotate
from tests.building import bumps, lambert, placed, scene_of, settings, shining, uniform

SIZE = (96, 64)
CAMERA = pica.Camera.look_at((0.5, 2.0, 4.5), (0, 0.3, 0), vertical_fov=np.radians(40))


def sheet() -> Section:
    return plane(3, 2, lambert(0.7, 0.5, 0.3, double_sided=True, normal_texture=bumps()), 20)


def waved(section: Section, time: float) -> np.ndarray:
    x, _, z = section.positions.T
    return np.stack([x, 0.25 * np.sin(3 * x + time) * np.cos(2 * z), z + 0.1 * np.sin(time + x)], 1)


def around(node: Node):
    sun = shining(DirectionalLight(illuminance=3.0, angular_diameter=0.0), aim((1, 2, 1), (0, 0, 0)))
    floor = placed(plane(5, 5, lambert(0.5)), move(y=-0.5))
    return scene_of(floor, node, sun, environment=uniform(0.5, 0.6, 0.7))


@pytest.mark.parametrize("own_normals", [False, True])
def test_cloth_looks_like_a_mesh_with_these_vertices(device, own_normals):
    node = placed(sheet(), rotate("y", 20))
    cloth = pica.DynamicVertices(node)
    renderer = pica.Renderer(around(node), size=SIZE, settings=settings(), device=device)
    renderer.render(1, camera=CAMERA)
    places = waved(cloth._rest, 0.8)
    normals = np.tile([0.2, 1.0, 0.1], (len(places), 1)) if own_normals else None
    cloth.set(places, normals)
    renderer.render(1, camera=CAMERA)  # what moved in the frame before starts anew
    renderer.reset()
    shown = renderer.render(4, camera=CAMERA)
    _, expected_normals, expected_tangents = cloth.deform(node.mesh.sections[0])
    still = sheet()
    still.positions, still.normals = places.astype(np.float32), expected_normals.astype(np.float32)
    still.tangents = expected_tangents.astype(np.float32)
    expected = pica.Renderer(
        around(placed(still, rotate("y", 20))), size=SIZE, settings=settings(), device=device
    ).render(4, camera=CAMERA)
    assert (shown.aov("instance") == expected.aov("instance")).mean() > 0.999
    difference = np.abs(shown.color - expected.color)
    assert np.percentile(difference, 99) < 0.01 and difference.mean() < 2e-3
    flat = pica.Renderer(
        around(placed(sheet(), rotate("y", 20))), size=SIZE, settings=settings(), device=device
    ).render(4, camera=CAMERA)
    assert np.abs(flat.color - expected.color).mean() > 0.02, "the picture tells them apart"


def test_tangents_are_about_those_of_the_texture_coordinates():
    """A sheet that is sheared and turned: as tangents made anew from its texture coordinates."""
    section = sheet()
    node = placed(section)
    cloth = pica.DynamicVertices(node)
    places = waved(section, 0.3) @ rotate("z", 80)[:3, :3].T
    cloth.set(places)
    _, normals, tangents = cloth.deform(node.mesh.sections[0])
    anew, old, _ = generate_tangents(
        places.astype(np.float32), normals.astype(np.float32), section.uv0, section.indices
    )
    assert np.percentile(np.sum(tangents[old, :3] * anew[:, :3], axis=1), 2) > 0.98


def test_a_node_on_screen_can_become_cloth_and_move_without_new_memory(device):
    node = placed(sheet())
    renderer = pica.Renderer(around(node), size=SIZE, settings=settings(), device=device)
    renderer.render(1, camera=CAMERA)
    cloth = pica.DynamicVertices(node)
    for frame in range(5):
        cloth.set(waved(cloth._rest, 0.1 * frame))
        renderer.render(1, camera=CAMERA)
    memory = device.memory
    motions = []
    for frame in range(5, 8):
        cloth.set(waved(cloth._rest, 0.1 * frame))
        picture = renderer.render(1, camera=CAMERA)
        motions.append(np.abs(picture.aov("motion")[picture.aov("instance") == 2]).max())
    assert device.memory == memory
    assert min(motions) > 0.3
    renderer.render(1, camera=CAMERA)
    assert np.abs(renderer.render(1, camera=CAMERA).aov("motion")).max() < 0.01, "stands still"


def test_an_unknown_deformer_is_an_error(device):
    class Wobble(Deformer):
        def deform(self, section):
            return section.positions, section.normals, section.tangents

    node = Node("jelly", mesh=Mesh([sheet()]))
    node.deformer = Wobble()
    with pytest.raises(SceneError, match=r"'jelly'.*Wobble.*DynamicVertices"):
        pica.Renderer(scene_of(node), size=SIZE, settings=settings(), device=device)


def test_all_vertices_are_written_before_the_first_structure():
    """One wait between the two, and not one a mesh."""
    log = []

    class Logged:
        def __init__(self, name):
            self.name = name

        def __call__(self, recording):
            log.append(("write", self.name))

        def update_structures(self, recording):
            log.append(("refit", self.name))

    recording = SimpleNamespace(encoder=None, profiler=SimpleNamespace(begin=lambda *_: None, end=lambda *_: None))
    deform_all(recording, [Logged("a"), Logged("b")])
    assert log == [("write", "a"), ("write", "b"), ("refit", "a"), ("refit", "b")]

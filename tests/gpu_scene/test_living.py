"""Scenes that deform, and whose nodes come and go."""

import numpy as np
import pytest

import pica
from pica.gpu_scene.deformation.refit_quality import RefitQuality
from pica.scene.light import PointLight
from pica.scene.material import Image, Material, Texture
from pica.scene.model import Mesh, Node
from pica.scene.skin import Skin, deform
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import move
from tests.assets import ASSETS, needs_assets
from tests.building import held, lambert, placed, scene_of, shining, uniform

SIZE = (96, 72)
CAMERA = pica.Camera.look_at((0, 2.5, 6), (0, 0.5, 0), vertical_fov=np.radians(40))
ANIMATED = {
    "Fox": "Fox/Fox.glb",
    "SimpleSkin": "SimpleSkin/SimpleSkin.gltf",
    "morphs": "playcanvas/morph-stress-test/morph-stress-test.glb",
    "cube": "assimp_glTF2/glTF-Sample-Models/AnimatedMorphCube-glTF/AnimatedMorphCube.gltf",
}


def renderer_of(scene, device, **values):
    return pica.Renderer(scene, size=SIZE, settings=pica.Settings().with_values(values), device=device)


def gpu_positions(renderer):
    return renderer.view.geometry.positions.to_numpy().view(np.float32).reshape(-1, 3)


def bending_bar():
    """A bar of two joints, and the joint that bends it."""
    section = box((0.4, 2, 0.4), lambert(0.7))
    upper = np.clip((section.positions[:, 1] + 1) / 2, 0, 1).astype(np.float32)
    section.joints = np.broadcast_to(np.uint16([0, 1]), (len(upper), 2)).copy()
    section.weights = np.stack([1 - upper, upper], 1)
    root = Node("root")
    low, high = root.add(Node("low")), Node("high")
    low.add(high)
    bar = root.add(Node("bar", mesh=Mesh([section])))
    bar.skin = Skin([low, high], np.stack([np.eye(4)] * 2))
    return root, high, bar


@needs_assets
@pytest.mark.parametrize("file", ANIMATED.values(), ids=ANIMATED)
def test_vertices_are_where_the_reference_has_them(device, file):
    scene = pica.load(ASSETS / file, environment=uniform(1, 1, 1))
    renderer = renderer_of(scene, device)
    for time in (0.0, 0.4):
        scene.animate(time, 0)
        renderer.render(1)
        for node, deformation in renderer.view.scene.deformations.items():
            for part in deformation.mesh.sections:
                expected, _, _ = deform(part.section, node)
                found = gpu_positions(renderer)[part.first_vertex :][: len(expected)]
                np.testing.assert_allclose(found, expected, atol=1e-5 * np.abs(expected).max())


def test_raster_and_rays_see_the_same_deformed_mesh(device):
    pictures = []
    for primary in ("raster", "rays"):
        root, high, _ = bending_bar()
        scene = scene_of(root, environment=uniform(1, 1, 1))
        renderer = renderer_of(scene, device, **{"visibility.primary": primary})
        renderer.render(1, camera=CAMERA)
        high.transform = move(x=1.0)
        pictures.append(renderer.render(1, camera=CAMERA))
    same = pictures[0].aov("instance") == pictures[1].aov("instance")
    assert same.mean() > 0.99 and (pictures[0].aov("instance") > 0).mean() > 0.02
    depths = [picture.aov("depth")[same & (pictures[0].aov("instance") > 0)] for picture in pictures]
    np.testing.assert_allclose(*depths, rtol=1e-3)


@needs_assets
def test_motion_vectors_of_a_skinned_mesh_are_those_of_its_vertices(device):
    """Where each pixel's surface point was one frame before, against the reference deformation at both times."""
    scene = pica.load(ASSETS / "Fox" / "Fox.glb", environment=uniform(1, 1, 1))
    size = (160, 120)
    renderer = pica.Renderer(scene, size=size, device=device)
    camera = scene.default_camera(4 / 3)
    scene.animate(0.1, "Run")
    renderer.render(1, camera=camera)
    ((node, deformation),) = renderer.view.scene.deformations.items()
    (placed_section,) = deformation.mesh.sections
    section = placed_section.section

    def pixels():
        """(vertices, 2) where the vertices are in the picture, by the reference."""
        world = node.instance_transforms()[0]
        points = deform(section, node)[0] @ world[:3, :3].T + world[:3, 3]
        view = (points - camera.transform[:3, 3]) @ camera.transform[:3, :3]
        slope = np.tan(camera.vertical_fov / 2)
        across = view[:, :2] / -view[:, 2:] / (slope * np.array([size[0] / size[1], 1]))
        return (across * (0.5, -0.5) + 0.5) * size, -view[:, 2]

    before, depth_before = pixels()
    scene.animate(0.15, "Run")
    frame = renderer.render(1, camera=camera)
    after, depth_after = pixels()
    motion = frame.aov("motion")
    seen = gpu_visibility(renderer)
    rows, columns = np.nonzero(seen[..., 0])
    jitter = frame_jitter(1)
    errors = []
    for row, column in zip(rows, columns, strict=True):
        corners = section.indices[seen[row, column, 1]]
        place = np.array([column, row]) + 0.5 + jitter
        weights = perspective_weights(after[corners], depth_after[corners], place)
        errors.append(np.abs(motion[row, column] - (project_mix(before, depth_before, corners, weights) - place)).max())
    assert len(errors) > 100 and np.percentile(errors, 99) < 0.05
    assert np.abs(motion).max() > 1


def gpu_visibility(renderer):
    return held(renderer, "gbuffer", "shapes visibility").to_numpy()


def frame_jitter(index):
    from pica.frame.context import radical_inverse

    return np.array([radical_inverse(2, index), radical_inverse(3, index)])


def perspective_weights(corners, depths, place):
    """Weights of a triangle's corners, in space, of the point that shows at `place`."""
    system = np.vstack([corners.T, np.ones(3)])
    screen = np.linalg.solve(system, np.append(place, 1))
    weights = screen / depths
    return weights / weights.sum()


def project_mix(pixels, depths, corners, weights):
    """Where in the picture the mix of three points in space lies: pixels times depth add up linearly."""
    return (weights * depths[corners]) @ pixels[corners] / (weights @ depths[corners])


def test_what_stops_deforming_stands_still_in_the_motion_vectors(device):
    root, high, _ = bending_bar()
    renderer = renderer_of(scene_of(root, environment=uniform(1, 1, 1)), device)
    renderer.render(1, camera=CAMERA)
    high.transform = move(x=0.5)
    assert np.abs(renderer.render(1, camera=CAMERA).aov("motion")).max() > 1
    assert np.abs(renderer.render(1, camera=CAMERA).aov("motion")).max() < 1e-3


def test_what_was_moved_stands_still_in_the_motion_vectors_after(device):
    ball = placed(sphere(0.5, lambert()))
    renderer = renderer_of(scene_of(ball, environment=uniform(1, 1, 1)), device)
    renderer.render(1, camera=CAMERA)
    ball.transform = move(x=0.3)
    assert np.abs(renderer.render(3, camera=CAMERA).aov("motion")).max() > 1
    assert np.abs(renderer.render(1, camera=CAMERA).aov("motion")).max() < 1e-3


def test_loose_trees_are_noticed():
    root, _, bar = bending_bar()
    scene_of(root)
    watched = RefitQuality(bar.mesh.sections, bar)
    watched.reset()
    assert watched.now() == pytest.approx(1)
    # The same mesh torn into a cloud: neighbours end up far apart.
    section = sphere(1, lambert(), 24)
    section.morph_positions = np.random.default_rng(0).normal(0, 2, (1, len(section.positions), 3)).astype(np.float32)
    cloud = Node(mesh=Mesh([section]))
    cloud.weights = [0.0]
    watched = RefitQuality([section], cloud)
    watched.reset()
    cloud.weights = [1.0]
    assert watched.now() > 2
    watched.reset()
    assert watched.now() == pytest.approx(1)


def test_refitted_and_rebuilt_structures_give_the_same_picture(device, monkeypatch):
    pictures = []
    for rebuild_at in (100.0, 1.0):
        monkeypatch.setattr("pica.gpu_scene.deformation.deformation._REBUILD_AT", rebuild_at)
        root, high, _ = bending_bar()
        scene = scene_of(root, placed(plane(6, 6, lambert()), move(y=-1)), environment=uniform(1, 1, 1))
        renderer = renderer_of(scene, device, **{"visibility.primary": "rays"})
        for step in range(18):
            high.transform = move(x=0.1 * step)
            renderer.advance(CAMERA)
        pictures.append(renderer.render(4, camera=CAMERA).color)
    np.testing.assert_allclose(*pictures, atol=1e-4)


def visitor(seed):
    """A node with a mesh, a material and a texture of its own."""
    pixels = np.random.default_rng(seed).integers(0, 255, (16, 16, 4)).astype(np.uint8)
    material = Material(metallic=0.0, base_color_texture=Texture(Image(pixels)))
    return placed(sphere(0.5, material, 8 + seed % 5), move(x=seed % 3 - 1.0, y=0.5))


def test_a_scene_with_comings_and_goings_looks_like_one_made_so(device):
    floor = placed(plane(6, 6, lambert()))
    scene = scene_of(floor, visitor(1), environment=uniform(0.5, 0.6, 0.7))
    renderer = renderer_of(scene, device)
    renderer.render(1, camera=CAMERA)
    leaving = scene.roots[1]
    scene.add(visitor(2))
    renderer.render(1, camera=CAMERA)
    scene.remove(leaving)
    lamp = scene.add(shining(PointLight(intensity=20.0, radius=0.1), move(y=3)))
    glow = scene.add(placed(box((0.2, 0.2, 0.2), lambert(0.1, emission=(5.0, 4.0, 3.0))), move(x=1.5, y=1)))
    renderer.render(1, camera=CAMERA)
    renderer.reset()
    found = renderer.render(4, camera=CAMERA)
    fresh_scene = scene_of(
        placed(plane(6, 6, lambert())),
        visitor(2),
        shining(lamp.light, lamp.transform),
        placed(glow.mesh.sections[0], glow.transform),
        environment=uniform(0.5, 0.6, 0.7),
    )
    fresh = renderer_of(fresh_scene, device).render(4, camera=CAMERA)
    np.testing.assert_allclose(found.color, fresh.color, atol=2e-3)
    np.testing.assert_array_equal(found.aov("albedo"), fresh.aov("albedo"))


def test_nodes_that_come_and_go_leave_nothing_behind(device):
    scene = scene_of(placed(plane(6, 6, lambert())), environment=uniform(1, 1, 1))
    renderer = renderer_of(scene, device)
    memory = []
    for turn in range(60):
        guest = scene.add(visitor(turn))
        bender, high, _ = bending_bar()
        scene.add(bender)
        renderer.advance(CAMERA)
        high.transform = move(x=0.3)
        renderer.advance(CAMERA)
        scene.remove(guest)
        scene.remove(bender)
        renderer.advance(CAMERA)
        memory.append(device.memory)
    assert memory[-1] <= memory[15]
    gpu = renderer.view.scene
    assert len(gpu.placements) == 1 and not gpu.deformations and gpu.records.count == 1


def test_an_empty_scene_fills(device):
    scene = scene_of(environment=uniform(1, 1, 1))
    renderer = renderer_of(scene, device)
    assert (renderer.render(1, camera=CAMERA).aov("instance") == 0).all()
    scene.add(visitor(0))
    assert (renderer.render(1, camera=CAMERA).aov("instance") > 0).any()

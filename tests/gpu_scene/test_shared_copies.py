"""Copies of a scene share vertices, structures, textures and environments on the device, until one is edited."""

import gc
from copy import deepcopy

import numpy as np
import pytest

import pica
from pica.gpu_scene.gpu_scene import GpuScene
from pica.scene.material import Image, Texture
from pica.scenes.basic_meshes import plane, sphere
from pica.scenes.placing import move
from tests.building import lambert, placed, scene_of, settings

SIZE = (32, 24)
SETTINGS = settings({"rays.scheduler": "buffers"})
CAMERA = pica.Camera.look_at((0, 1.2, 3), (0, 0.5, 0))


def image(red):
    return Image(np.broadcast_to(np.uint8([red, 120, 200, 255]), (256, 256, 4)).copy())


@pytest.fixture
def scene():
    paint = lambert(1, name="paint", base_color_texture=Texture(image(200)))
    sky = pica.Environment(np.random.default_rng(0).random((64, 128, 3), np.float32))
    return scene_of(
        placed(sphere(0.5, paint, 48), move(0, 0.5, 0), "ball"), placed(plane(4, 4, lambert()), name="floor"),
        environment=sky,
    )  # fmt: skip


def taken(device, scene):
    """The copy of a scene on the device, and the memory that it takes."""
    gc.collect()
    before = device.memory
    gpu_scene = GpuScene.of(device, scene)
    return gpu_scene, device.memory - before


def pictures(renderer):
    return renderer.render(1, camera=[CAMERA] * renderer.views, cut=True, aovs=()).color


def ball(scene):
    return next(node for node in scene.nodes() if node.name == "ball")


def test_copies_take_little_memory(device, scene):
    views = pica.SceneViews(scene, 3)
    taken(device, deepcopy(scene))  # the device's own scratch memory
    gc.collect()
    before = device.memory
    first, alone = taken(device, views[0])
    others = [taken(device, view) for view in list(views)[1:]]
    another, own = taken(device, deepcopy(scene))
    assert all(memory < 0.03 * alone for _, memory in others) and own > 0.9 * alone
    assert others[0][0].geometry.positions is first.geometry.positions is not another.geometry.positions
    del first
    gc.collect()
    assert device.memory - before > 1.5 * own  # the other copies still have it
    del others, another
    gc.collect()
    assert device.memory == before


def test_an_edited_copy_has_arrays_of_its_own(device, scene):
    """New vertices, writes into an array that is assigned again, a material of another kind, and new nodes."""
    views = pica.SceneViews(scene, 4)
    shared = ball(views[1]).mesh.sections[0]
    written = shared.positions.copy()
    for view in list(views)[1:3]:
        ball(view).mesh.sections[0].positions = written
    with pica.Renderer(views, size=SIZE, settings=SETTINGS, device=device) as renderer:
        before = pictures(renderer)
        ball(views[0]).mesh.sections[0].positions = 0.5 * shared.positions
        written *= 2
        ball(views[1]).mesh.sections[0].positions = written
        ball(views[3]).mesh.sections[0].material.double_sided = True
        views[3].add(pica.Node("again", mesh=ball(views[3]).mesh)).transform = move(-1, 0.5, 0)
        after = pictures(renderer)
        for number, view in enumerate(views):
            with pica.Renderer(deepcopy(view), size=SIZE, settings=settings_of(number), device=device) as fresh:
                expected = fresh.render(1, camera=CAMERA, aovs=()).color
            same = number != 2  # whose array was written to as well, but not assigned
            assert np.array_equal(after[number], expected) == same
        np.testing.assert_array_equal(after[2], before[2])
        assert not any(np.array_equal(after[number], before[number]) for number in (0, 1, 3))


def settings_of(number):
    return SETTINGS.with_values({"seed": number})


def test_a_shared_image_that_is_edited_is_uploaded_once_for_all(device, scene):
    views = pica.SceneViews(scene, 3)
    shared = ball(scene).mesh.sections[0].material.base_color_texture.image
    with pica.Renderer(views, size=SIZE, settings=SETTINGS, device=device) as renderer:
        pictures(renderer)
        gc.collect()
        before = device.memory
        shared.pixels = image(20).pixels
        changed = pictures(renderer)
        assert device.memory == before
        shared.pixels = np.require(shared.pixels)  # the same array
        np.testing.assert_array_equal(pictures(renderer), changed)
        views.set_material("paint", base_color_texture=[Texture(image(20)), Texture(image(20)), Texture(image(220))])
        own = pictures(renderer)
        np.testing.assert_array_equal(own[:2], changed[:2])
        assert own[2].mean(axis=(0, 1))[0] > 1.05 * changed[2].mean(axis=(0, 1))[0]


def test_strength_and_rotation_upload_nothing(device, scene):
    views = pica.SceneViews(scene, 2)
    copies = [GpuScene.of(device, view) for view in views]
    before = device.memory
    views.set_environment(strength=[0.5, 2.0], rotation=[1.0, 2.0])
    with device.record() as recording:
        for copy in copies:
            copy.update(recording)
    assert copies[0].environment.fields["radiance"] is copies[1].environment.fields["radiance"]
    assert [copy.environment.fields["strength"] for copy in copies] == [0.5, 2.0]
    assert device.memory == before

"""Several views of one scene: each shows what it would alone, and what they have in common is there once."""

import gc

import numpy as np
import pytest

import pica
from pica.errors import PicaError
from pica.rhi.device import open_device
from pica.scene.landscape import Landscape
from pica.scene.material import Image, Material, Texture
from pica.scene.model import Mesh, Node
from pica.scene.particles import Particles, Ribbons, Sprites
from pica.scene.skin import Skin
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import move, rotate
from pica.scenes.terrain import fractal_heights
from tests.building import RASTER, RAYS, lambert, placed, scene_of, settings, uniform

FROM_LEFT = pica.Camera.look_at((-3, 2, 4), (0, 0.4, 0), vertical_fov=np.radians(45))
FROM_RIGHT = pica.Camera.look_at((3.5, 1.5, 2), (0, 0.4, 0), vertical_fov=np.radians(50))
LARGE, SMALL = (64, 40), (40, 32)


class Stage:
    """Something of every kind that moves: rigid, skinned, sprites, a ribbon, over a landscape."""

    def __init__(self) -> None:
        self.box = placed(box(0.5, lambert(0.8, 0.3, 0.2)))
        section = box((0.3, 1.4, 0.3), lambert(0.3, 0.6, 0.9))
        upper = np.clip((section.positions[:, 1] + 0.7) / 1.4, 0, 1).astype(np.float32)
        section.joints = np.broadcast_to(np.uint16([0, 1]), (len(upper), 2)).copy()
        section.weights = np.stack([1 - upper, upper], 1)
        root, low, self.joint = Node("root"), Node("low"), Node("high")
        root.add(low)
        low.add(self.joint)
        bar = root.add(Node("bar", mesh=Mesh([section])))
        bar.skin = Skin([low, self.joint], np.stack([np.eye(4)] * 2))
        self.sprites = Sprites(8, lambert(0.9, 0.8, 0.3, double_sided=True))
        self.ribbon = Ribbons(1, 6, lambert(0.4, 0.9, 0.4, double_sided=True))
        hills = Landscape(fractal_heights(17, 6, 0.4, seed=2) - 1.0, 0.5, lambert(0.5), 4, 3, 2.0)
        moving = self.sprites.node, self.ribbon.node
        self.scene = scene_of(self.box, root, *moving, hills.node, environment=uniform(1, 0.9, 0.8))
        self.at(0.0)

    def at(self, time: float) -> None:
        self.box.transform = move(0.9 + 0.3 * np.sin(3 * time), 0.3, 0.4) @ rotate("y", 60 * time)
        self.joint.transform = move(x=0.4 * np.sin(2 * time))
        places = np.random.default_rng(1).uniform((-1.4, 0.2, -1), (1.2, 1.4, 1), (8, 3))
        places += 0.2 * np.sin(time + np.arange(8))[:, None] * (1, 0.5, 0.2)
        self.sprites.particles = Particles(places, np.full(8, 0.3), rotations=time * np.arange(8))
        along = np.linspace(-1.2, 1.2, 6)
        self.ribbon.set([np.stack([along, 1.2 + 0.2 * np.sin(2 * along + time), 0 * along], -1)], 0.2)


def renderer_of(stage, size, device, values=None):
    return pica.Renderer(stage.scene, size=size, settings=settings(values), device=device)


def seen(frame):
    """What must not differ between a view and a lone renderer."""
    return {"color": frame.color, **{name: frame.aov(name) for name in ("depth", "motion", "normal", "instance")}}


def assert_same(found, expected):
    for name, values in seen(expected).items():
        np.testing.assert_array_equal(seen(found)[name], values, err_msg=name)


@pytest.mark.parametrize("values", [RASTER, RAYS], ids=["raster", "rays"])
def test_two_views_show_what_each_shows_alone(device, values):
    """While everything moves and after it has stopped, and each at its own rate."""
    together, looks = Stage(), {LARGE: FROM_LEFT, SMALL: FROM_RIGHT}
    views = {size: renderer_of(together, size, device, values) for size in looks}
    stages = {size: Stage() for size in looks}
    alone = {size: renderer_of(stages[size], size, device, values) for size in looks}
    assert len({id(view.view.scene) for view in views.values()}) == 1
    for step in range(7):
        for stage in (together, *stages.values()):
            stage.at(0.15 * min(step, 4))
        for size, camera in looks.items():
            if size == LARGE or step in (0, 3, 4, 6):
                assert_same(views[size].render(1, camera=camera), alone[size].render(1, camera=camera))
    for size, camera in looks.items():
        assert_same(views[size].render(4, camera=camera), alone[size].render(4, camera=camera))


def test_motion_is_since_the_views_own_frame_before(device):
    """Across several updates that another view has shown; a view that shows nothing new has no motion."""
    stage = Stage()
    often, seldom = (renderer_of(stage, LARGE, device) for _ in range(2))
    for renderer in (often, seldom):
        renderer.render(1, camera=FROM_LEFT)
    for step in range(1, 4):
        stage.at(0.1 * step)
        steps = often.render(1, camera=FROM_LEFT).aov("motion")
    whole = seldom.render(1, camera=FROM_LEFT).aov("motion")
    assert np.abs(whole).max() > 1.5 * np.abs(steps).max() > 1
    assert np.abs(seldom.render(1, camera=FROM_LEFT).aov("motion")).max() < 1e-3
    assert np.abs(often.render(1, camera=FROM_LEFT).aov("motion")).max() < 1e-3


def contents(value, found, depth=0):
    """All arrays below a value, copied, and all other values as they are."""
    if isinstance(value, np.ndarray):
        found.append(value.copy())
    elif isinstance(value, (list, tuple)):
        for item in value:
            contents(item, found, depth + 1)
    elif hasattr(value, "__dict__") and depth < 8 and type(value).__module__.startswith("pica.scene"):
        found.append(id(value))
        for name, item in vars(value).items():
            if name not in ("_listeners", "_followers", "_parent", "_world", "_meshes", "node", "detail"):
                contents(item, found, depth + 1)
    return found


def test_nothing_is_written_into_the_users_scene(device):
    stage = Stage()
    before, changes = contents(stage.scene, []), stage.scene.subscribe()
    left, right = renderer_of(stage, LARGE, device), renderer_of(stage, SMALL, device)
    for _ in range(2):
        left.render(1, camera=FROM_LEFT)
        right.render(1, camera=FROM_RIGHT)
    assert not changes.take().any()
    after = contents(stage.scene, [])
    assert len(before) == len(after) > 100
    assert all(np.array_equal(a, b) for a, b in zip(before, after, strict=True))


def heavy_scene():
    """Much geometry and a texture: 4 MB or more on the device."""
    pixels = np.random.default_rng(0).integers(0, 255, (512, 512, 4)).astype(np.uint8)
    material = Material(metallic=0.0, base_color_texture=Texture(Image(pixels)))
    smoke = Sprites(4, lambert(double_sided=True))
    smoke.particles = Particles(np.zeros((1, 3)))
    return scene_of(placed(sphere(0.5, material, 160)), smoke.node, environment=uniform(1, 1, 1))


def test_a_scene_is_on_the_device_once_and_goes_with_its_last_view(device):
    gc.collect()
    gc.disable()  # what is dropped goes at once, not when somebody looks for cycles
    try:
        start, scene = device.memory, heavy_scene()
        first = pica.Renderer(scene, size=SMALL, settings=settings(), device=device)
        first.render(1, camera=FROM_LEFT)
        with_one = device.memory
        second = pica.Renderer(scene, size=SMALL, settings=settings(), device=device)
        second.render(1, camera=FROM_RIGHT)
        tracer = pica.PathTracer(scene, size=SMALL, max_depth=2, settings=settings(), device=device)
        tracer.render(1, camera=FROM_RIGHT)
        assert second.view.scene is first.view.scene is tracer.view.scene
        with_three = device.memory
        assert with_one - start > 4e6 and with_three - with_one < 0.5 * (with_one - start)
        del first
        assert start + 3e6 < device.memory < with_three
        second.render(1, camera=FROM_RIGHT)
        second.close()
        tracer.close()
        assert device.memory == start
        with pytest.raises(PicaError, match="closed"):
            second.render(1)
        with pytest.raises(PicaError, match="closed"):
            tracer.render(1)
    finally:
        gc.enable()


def test_whether_shadow_rays_go_through_glass_is_for_each_view_to_say(device):
    pane = placed(plane(3, 3, Material(transmission=1.0, roughness=0.0, base_color=(0.5, 0.9, 0.5, 1))), move(y=1))
    floor = placed(plane(4, 4, lambert()))
    scene = scene_of(floor, pane, environment=uniform(1, 1, 1))
    sizes = {
        value: pica.PathTracer(
            scene, size=SMALL, max_depth=3, settings=settings({"shadows.transparent": value}), device=device
        )
        for value in ("true", "false")
    }
    assert sizes["true"].view.transparent and not sizes["false"].view.transparent
    assert sizes["true"].view.scene is sizes["false"].view.scene


def test_resizing_keeps_the_scene(device):
    stage = Stage()
    renderer = renderer_of(stage, LARGE, device)
    renderer.render(2, camera=FROM_RIGHT)
    scene, uploads = renderer.view.scene, renderer.view.geometry.positions
    renderer.resize(SMALL)
    found = renderer.render(3, camera=FROM_RIGHT)
    assert renderer.view.scene is scene and renderer.view.geometry.positions is uploads
    assert_same(found, renderer_of(stage, SMALL, device).render(3, camera=FROM_RIGHT))


def test_other_settings_leave_what_they_do_not_concern(device):
    stage = Stage()
    values = {"ambient_occlusion.mode": "ground_truth"}
    renderer = renderer_of(stage, LARGE, device, values)
    renderer.render(2, camera=FROM_LEFT)
    stages = renderer._stages
    kept = renderer.view.scene, stages.shadows, stages.gbuffer, stages.antialiasing
    memory = device.memory
    renderer.configure(settings({**values, "post.exposure": "1.5"}))
    assert kept == (renderer.view.scene, stages.shadows, stages.gbuffer, stages.antialiasing)
    renderer.configure(settings({"post.exposure": "1.5"}))
    assert stages.ambient_occlusion is None
    renderer.reset()
    found = renderer.render(3, camera=FROM_LEFT)
    assert device.memory < memory, "what an effect had is given back"
    assert_same(found, renderer_of(stage, LARGE, device).render(3, camera=FROM_LEFT))


def test_a_process_has_one_device_for_an_adapter(device):
    scene = scene_of(placed(box(1, lambert())))
    assert open_device() is open_device(device.name) is open_device(device)
    assert pica.Renderer(scene, size=SMALL).device is pica.PathTracer(scene, size=SMALL).device is open_device()

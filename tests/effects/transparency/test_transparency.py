"""What is seen through transmissive surfaces and in them, by the transparency pass and by the path tracer."""

import math

import numpy as np
import pytest

import pica
from pica.quality.picture_errors import compare
from pica.quality.playback import last_frame
from pica.quality.sequences import sequence
from pica.scene.camera import Camera
from pica.scene.environment import Environment
from pica.scene.light import DirectionalLight, SphereLight
from pica.scene.material import AlphaMode, Material
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import aim, move, rotate
from tests.building import lambert, orthographic, placed, render, scene_of, settings, shining, sky, trace, uniform
from tests.effects.transparency.at_rest_and_in_motion import errors
from tests.effects.transparency.trails import ghost_behind, trail_of

BOTH = pytest.mark.parametrize("tracer", [render, trace], ids=["hybrid", "path tracer"])
VIEW = Camera.look_at((0.5, 1.0, 2.6), (0, 0.35, 0), vertical_fov=math.radians(35))

SMALL_MAPS = {"transparency.map_size": "64"}
"""For pictures of few pixels: paths from texels take most of their time."""


def glass(color=(1.0, 1.0, 1.0), **more) -> Material:
    values = {"metallic": 0.0, "roughness": 0.0, "transmission": 1.0, "thin_walled": False}
    return Material(base_color=(*color, 1.0), **{**values, **more})


@BOTH
@pytest.mark.parametrize("roughness", [0.0, 0.5])
def test_a_ball_of_glass_disappears_in_even_light(device, tracer, roughness):
    scene = scene_of(placed(sphere(0.5, glass(roughness=roughness), 64)), environment=uniform(1, 1, 1))
    camera = Camera.look_at((0, 0, 3), (0, 0, 0), vertical_fov=math.radians(24))
    picture = tracer(device, scene, 64, camera, (24, 24)).color
    inside = picture[8:16, 8:16]
    assert inside.mean() == pytest.approx(1, rel=0.01)
    assert picture.mean() == pytest.approx(1, rel=0.01)


@BOTH
def test_a_slab_absorbs_by_its_thickness(device, tracer):
    """With all inner reflections: Stokes' sum of the series of a pile of plates (1862)."""
    absorption, thickness, reflected = np.array((0.5, 2.0, 6.0)), 0.4, 0.04
    slab = placed(box((4, thickness, 4), glass(absorption=tuple(absorption))), move(0, 1, 0))
    camera = orthographic((0, 3, 0), (0, 0, 0), 0.5)
    picture = tracer(device, scene_of(slab, environment=uniform(1, 1, 1)), 96, camera, (16, 16)).color
    left = np.exp(-absorption * thickness)
    series = (1 - reflected) ** 2 / (1 - (reflected * left) ** 2)
    expected = reflected + series * left * (1 + reflected * left)
    np.testing.assert_allclose(picture.mean((0, 1)), expected, rtol=0.01)


@pytest.mark.parametrize("is_pane", [True, False])
@pytest.mark.parametrize("heights", [(0,), (0, 0.05)])
def test_near_parallel_faces_have_no_noise(device, is_pane, heights):
    """What further ones mirror is what the first one does, and no choice: slabs, and boxes of clear panes, seen at 60
    degrees. Each box has a material of its own."""
    boxes = []
    for height in heights:
        material = glass((0.9, 0.8, 0.6), thin_walled=is_pane, ior=1.9, absorption=(0, 2, 6))
        boxes.append(placed(box((4, 0.03, 4), material), move(0, height, 0)))
    scene = scene_of(*boxes, environment=directions())
    camera = orthographic((3 * math.sqrt(3), 3, 0), (0, 0, 0), 0.2)
    picture = render(device, scene, 1, camera, (16, 16)).color
    truth = trace(device, scene, 512, camera, (16, 16)).color.mean((0, 1))
    np.testing.assert_allclose(picture.mean((0, 1)), truth, rtol=0.005)
    assert (np.abs(picture / truth - 1) > 0.02).mean() < 0.02  # a few rays draw the tail of the polished lobe


def test_clear_panes_far_apart_have_little_noise(device):
    """A show case: what lies behind is no choice, so that no pixel of a bright thing is black."""
    wall = placed(plane(8, 8, lambert(0, emission=(2, 2, 2))), move(0, 0, -2) @ rotate("x", 90))
    panes = [placed(plane(4, 4, glass(thin_walled=True)), move(0, 0, z) @ rotate("x", 90)) for z in (0, 0.8)]
    camera = Camera.look_at((0, 0, 3), (0, 0, 0), vertical_fov=math.radians(20))
    with pica.Renderer(scene_of(wall, *panes), size=(64, 36), device=device) as renderer:
        first = renderer.render(1, camera=camera).color
        many = renderer.render(64, camera=camera).color
    assert first.min() > 0.9 * many.mean()
    assert first.mean() == pytest.approx(many.mean(), rel=0.01)
    assert many.mean() == pytest.approx(2 * 0.9216**2, rel=0.02)  # Schlick at normal incidence, four interfaces


@BOTH
@pytest.mark.parametrize("has_top", [True, False])
def test_meshes_that_are_not_closed_absorb_up_to_the_next_surface(device, tracer, has_top):
    """Fronts and backs are met: water without a bottom absorbs down to the floor, and a solid without a top, below a
    clear pane, from that pane on."""
    absorption, depth = np.array((0.5, 2.0, 6.0)), 0.4
    water = glass(absorption=tuple(absorption), specular=0.0, ior=1.0)
    floor = placed(plane(4, 4, lambert(0, emission=(1, 1, 1))))
    if has_top:
        nodes = [placed(plane(4, 4, water), move(0, depth, 0))]
    else:
        bottom = placed(plane(4, 4, water), move(0, 0.2, 0) @ rotate("x", 180))
        nodes = [placed(plane(4, 4, glass(thin_walled=True, specular=0.0)), move(0, 0.2 + depth, 0)), bottom]
    scene = scene_of(floor, *nodes)
    picture = tracer(device, scene, 32, orthographic((0, 3, 0), (0, 0, 0), 0.5), (8, 8)).color
    np.testing.assert_allclose(picture.mean((0, 1)), np.exp(-absorption * depth), rtol=0.01)


def directions() -> Environment:
    """Whose colour is one more than the direction that it is seen in."""
    v, u = np.meshgrid((np.arange(256) + 0.5) / 256, (np.arange(512) + 0.5) / 512, indexing="ij")
    angle, sine = 2 * np.pi * (u - 0.5), np.sin(np.pi * v)
    return Environment(np.stack([sine * np.cos(angle), np.cos(np.pi * v), sine * np.sin(angle)], -1) + 1)


def through_a_prism(index: float) -> np.ndarray:
    """Direction in which a ray that goes down leaves the corner of a block, entered at 60 degrees (Snell)."""
    entered = math.radians(60)
    inside = math.asin(math.sin(entered) / index)
    left = math.asin(index * math.sin(math.pi / 2 - inside))
    turned = entered + left - math.pi / 2
    return np.array((math.sin(turned), -math.cos(turned), 0))


def prism(**values) -> tuple:
    """A block on its edge, and a camera above one of its sides, which its rays enter at 60 degrees."""
    block = placed(box((4, 4, 4), glass(specular=0.0, **values)), rotate("z", 60))
    return block, orthographic((-1.9, 8, 0), (-1.9, 0, 0), 0.2)


@BOTH
def test_a_prism_refracts_as_snell_says(device, tracer):
    block, camera = prism(ior=1.2)
    picture = tracer(device, scene_of(block, environment=directions()), 8, camera, (8, 8)).color
    expected = through_a_prism(1.2)
    np.testing.assert_allclose(picture - 1, np.broadcast_to(expected, picture.shape), atol=1e-3)


@BOTH
def test_a_prism_disperses(device, tracer):
    """The indices of blue and red are apart by (ior - 1) times dispersion / 20 (KHR_materials_dispersion)."""
    block, camera = prism(ior=1.2, dispersion=6.0)
    sideways = directions().radiance[..., :1]
    scene = scene_of(block, environment=Environment(np.repeat(sideways, 3, -1)))
    found = tracer(device, scene, 128, camera, (48, 48)).color.mean((0, 1)) - 1
    spread = 0.2 * 6.0 / 40
    expected = [through_a_prism(index)[0] for index in (1.2 - spread, 1.2, 1.2 + spread)]
    np.testing.assert_allclose(found, expected, atol=0.01)
    assert found[2] - found[0] > 0.1


@BOTH
@pytest.mark.parametrize("metallic", [0.0, 1.0])
def test_alpha_of_glass_passes_light_without_noise(device, tracer, metallic):
    color = (0.2, 0.5, 0.8, 0.25)
    material = Material(
        base_color=color, metallic=metallic, transmission=1.0, specular=0.0, alpha_mode=AlphaMode.BLEND, roughness=0.0
    )
    pane = placed(plane(4, 4, material))
    camera = orthographic((0, 3, 0), (0, 0, 0), 0.5)
    picture = tracer(device, scene_of(pane, environment=uniform(1, 1, 1)), 1, camera, (16, 16)).color
    expected = 0.75 + 0.25 * np.array(color[:3])  # glass passes it, metal reflects it
    if metallic == 0:
        np.testing.assert_allclose(picture, np.broadcast_to(expected, picture.shape), rtol=0.01)
    assert picture.mean() == pytest.approx(expected.mean(), rel=0.02)


def panes(order):
    """Three panes of different colours, roughnesses and tilts, one behind the other."""
    colors = (0.9, 0.5, 0.3), (0.4, 0.9, 0.8), (0.7, 0.7, 0.95)
    nodes = [
        placed(
            plane(1.2, 0.9, glass(color, thin_walled=True, roughness=0.1 * number)),
            move(0.1 * number, 0.5, 0.3 * number) @ rotate("x", 80 + 10 * number),
        )
        for number, color in enumerate(colors)
    ]
    return [nodes[number] for number in order]


def test_overlapping_panes_may_come_in_any_order(device):
    pictures = []
    for order in ((0, 1, 2), (2, 0, 1), (1, 2, 0)):
        floor = placed(plane(4, 4, lambert(0.5, 0.4, 0.3)))
        scene = scene_of(floor, *panes(order), environment=sky())
        pictures.append(render(device, scene, 96, VIEW, (32, 20), SMALL_MAPS).color)
    assert max(compare(pictures[0], other).flip for other in pictures[1:]) < 0.03  # noise
    for other in pictures[1:]:
        assert other.mean() == pytest.approx(pictures[0].mean(), rel=0.005)


def still_life() -> tuple:
    """Clear, rough and absorbing glass, and a pane, before a matte wall."""
    return (
        placed(plane(5, 5, lambert(0.6, 0.55, 0.5))),
        placed(plane(5, 3, lambert(0.3, 0.45, 0.7)), move(0, 1.5, -1.2) @ rotate("x", 90)),
        placed(box((0.3, 0.5, 0.3), lambert(0.8, 0.3, 0.2)), move(0.1, 0.25, -0.6)),
        placed(sphere(0.35, glass(), 48), move(-0.5, 0.36, 0)),
        placed(sphere(0.25, glass(roughness=0.35), 48), move(0.15, 0.26, 0.4)),
        placed(box((0.35, 0.5, 0.35), glass(absorption=(1.0, 3.0, 6.0))), move(0.7, 0.26, 0.1) @ rotate("y", 25)),
        placed(plane(0.7, 0.7, glass((0.5, 0.9, 0.6), thin_walled=True)), move(-0.2, 0.5, 0.6) @ rotate("x", 75)),
        shining(SphereLight(radiance=20.0, radius=0.2), move(1.2, 2.2, 1.4)),
        shining(DirectionalLight(illuminance=1.5, angular_diameter=0.05), aim((-1, 2, 1.5), (0, 0, 0))),
    )


def test_default_frames_come_near_the_path_tracer_at_rest_and_in_motion(device):
    scene = scene_of(*still_life(), environment=uniform(0.25, 0.3, 0.4))
    at_rest, in_motion = errors(device, scene, VIEW, samples=384)
    assert at_rest < 0.08
    assert in_motion < at_rest + 0.05


def test_glass_that_moves_leaves_no_trail(device):
    """Over a wall at rest, which is all that the G-buffer sees."""
    assert trail_of(device, glass((0.9, 0.4, 0.3)), pica.Settings()) < 0.002


def test_what_moves_behind_glass_leaves_no_trail(device):
    """The glass is at rest, and the picture in it is not."""
    assert abs(ghost_behind(device, pica.Settings(), glass())) < 0.02


def test_the_gbuffer_has_what_lies_behind(device):
    wall = placed(plane(4, 4, lambert(0.5)), move(0, 0, -2) @ rotate("x", 90), "wall")
    window = placed(plane(1, 1, glass(thin_walled=True)), rotate("x", 90), "window")
    camera = Camera.look_at((0, 0, 3), (0, 0, 0), vertical_fov=math.radians(20))
    aovs = ["depth", "normal", "albedo", "instance", "motion"]
    for values in ({"visibility.primary": "raster"}, {"visibility.primary": "rays"}):
        with_it, without = (
            pica.Renderer(scene_of(*nodes), size=(16, 16), settings=settings(values), device=device).labels(
                camera=camera, aovs=aovs
            )
            for nodes in ([wall, window], [wall])
        )
        for name in aovs:
            np.testing.assert_allclose(with_it.aov(name), without.aov(name), atol=1e-5, err_msg=name)


def test_without_the_pass_glass_is_opaque_to_the_camera(device):
    window = placed(plane(1, 1, glass(thin_walled=True)), rotate("x", 90), "window")
    camera = Camera.look_at((0, 0, 3), (0, 0, 0), vertical_fov=math.radians(10))
    scene = scene_of(window, environment=uniform(1, 1, 1))
    depth = [
        pica.Renderer(scene, size=(8, 8), settings=settings({"transparency.mode": mode}), device=device)
        .labels(camera=camera, aovs=["depth"])
        .aov("depth")
        for mode in ("off", "ray_traced")
    ]
    assert np.all(np.isfinite(depth[0])) and np.all(np.isinf(depth[1]))


def test_frames_are_the_same_bits_each_time(device):
    scene = scene_of(*still_life(), environment=sky())
    pictures = []
    for _ in range(2):
        with pica.Renderer(scene, size=(48, 30), device=device) as renderer:
            pictures.append(renderer.render(4, camera=VIEW).color)
    np.testing.assert_array_equal(*pictures)


def test_a_clear_pane_mirrors_a_lamp_without_dots(device):
    """In one frame, without help of earlier ones. The long tail of a lobe would leave some pixels black."""
    pane = placed(plane(8, 8, glass()), rotate("x", 90))
    lamp = placed(box((1.2, 1.2, 0.1), lambert(0, emission=(10, 10, 10))), move(0, 0, 6))
    camera = Camera.look_at((0, 0, 5), (0, 0, 0), vertical_fov=math.radians(3))
    found = render(device, scene_of(pane, lamp), 1, camera, (64, 36), SMALL_MAPS)
    assert found.aov("transmission").min() > 0.3


@pytest.mark.parametrize(("is_pane", "most"), [(False, 0.005), (True, 0.015)], ids=["block", "clear pane"])
def test_edges_of_glass_leave_no_copies_when_the_camera_orbits(device, is_pane, most):
    """They move with the glass, not with what lies behind it; what a clear pane shows does not."""
    wall = placed(plane(9, 6, lambert(0.7, 0.7, 0.7)), move(0, 1.5, -3) @ rotate("x", 90))
    block = placed(box((0.5, 0.8, 0.5), glass(absorption=(9.0, 9.0, 9.0))), move(0, 0.6, 0) @ rotate("y", 30))
    tinted = glass((0.1, 0.3, 0.5), thin_walled=True)
    pane = placed(plane(0.6, 0.9, tinted), move(0.25, 0.6, 0.8) @ rotate("x", 90))
    scene = scene_of(wall, pane if is_pane else block, environment=uniform(0.8, 0.8, 0.8))
    camera = Camera.look_at((0, 0.7, 3), (0, 0.6, 0), vertical_fov=math.radians(30))
    with pica.Renderer(scene, size=(96, 60), device=device) as renderer:
        moving = last_frame(renderer, sequence("orbit", scene, camera, speed=2.0), range(-15, 1)).color
        renderer.reset()
        expected = renderer.render(32, camera=camera).color
    outside = expected.min(-1) > 0.9 * np.median(expected)
    off = np.abs(moving - expected).max(-1) > 0.1 * expected.mean()
    assert off[outside].mean() < most
    assert np.abs(moving - expected)[~outside].mean() < 0.05 * expected.mean()


def test_a_moving_window_leaves_the_picture_behind_it_at_its_place(device):
    """A thick one too: light leaves it as it came."""
    bar = box((0.15, 2, 0.1), lambert(0, emission=(1, 1, 1)))
    bars = [placed(bar, move(x, 0.5, -1)) for x in np.arange(-2, 2, 0.4)]
    panel = placed(box((1.6, 1, 0.03), glass()), move(0, 0.5, 0), "window")
    scene = scene_of(*bars, panel, environment=uniform(0.1, 0.1, 0.1))
    camera = Camera.look_at((1.0, 0.7, 2), (0, 0.5, 0), vertical_fov=math.radians(20))
    (window,) = (node for node in scene.nodes() if node.name == "window")
    with pica.Renderer(scene, size=(96, 60), device=device) as renderer:
        expected = renderer.render(32, camera=camera).color
        for step in range(-8, 1):
            window.transform = move(0.02 * step, 0.5, 0)
            moving = renderer.render(1, camera=camera).color
    assert np.abs(moving - expected).mean() < 0.05 * expected.mean()

"""Shadow maps against shadow rays and against what is known; when maps are drawn."""

from dataclasses import replace

import numpy as np
import pytest

import pica
from pica.scene.light import DirectionalLight, PointLight, RectangleLight, SphereLight, SpotLight
from pica.scene.material import AlphaMode
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import aim, move, rotate
from tests.building import lambert, leaves, orthographic, placed, render, scene_of, settings, shining, trace

SIZE = (96, 64)
ABOVE = orthographic((0, 6, 0.001), (0, 0, 0), 4.0)
MAPS = {"visibility.primary": "raster", "shadows.method": "maps", "shadow_maps.cascade_size": "1024"}
HARD = {**MAPS, "shadows.mode": "hard"}
DARK = {**MAPS, "shadows.mode": "off"}


def sun(towards=(1, 2, 1.5), diameter=0.0):
    return shining(DirectionalLight(illuminance=3.0, angular_diameter=diameter), aim(towards, (0, 0, 0)))


def floor(size=6.0):
    return placed(plane(size, size, lambert(0.6)), name="floor")


def share(lit, free):
    """Share of the light that arrives, (height, width), from pictures with and without shadows; 1 where none comes."""
    lit, free = lit.color[..., 1], free.color[..., 1]
    return np.where(free > 0.1 * free.max(), np.clip(lit / np.maximum(free, 1e-9), 0, 1), 1)


def visibility(device, scene, camera=ABOVE, frames=1, values=HARD, size=SIZE):
    free = render(device, scene, frames, camera, size, DARK)
    return share(render(device, scene, frames, camera, size, values), free)


def traced_visibility(device, scene, camera=ABOVE, samples=16, size=SIZE):
    free = render(device, scene, samples, camera, size, DARK)
    return share(trace(device, scene, samples, camera, size, max_depth=2), free)


def psnr(a, b):
    return -10 * np.log10(np.mean((a - b) ** 2))


def things():
    return [
        floor(),
        placed(box(0.7, lambert(0.5)), move(0.4, 0.5, -0.6) @ rotate("y", 30) @ rotate("x", 20)),
        placed(sphere(0.4, lambert(0.5)), move(-0.9, 0.6, 0.2)),
        placed(plane(0.8, 0.8, leaves()), move(0.9, 0.5, 0.7) @ rotate("x", 20)),
    ]


def test_sharp_sun_is_the_path_tracers(device):
    # 16 samples of the reference soften its edges over a pixel, as the filter softens ours over three texels.
    scene = scene_of(*things(), sun())
    ours, reference = visibility(device, scene, frames=16), traced_visibility(device, scene)
    assert 0.05 < (reference < 0.5).mean() < 0.5
    assert psnr(ours, reference) > 25


def wall_scene(diameter):
    """A wall 0.8 m high; the sun stands at 45 degrees, so the edge's shadow falls 1.13 m behind the edge."""
    wall = placed(box((0.02, 0.8, 8.0), lambert(0.5)), move(-0.6, 0.4, 0))
    return scene_of(floor(20), wall, sun((-1, 1, 0), np.radians(diameter)))


def profile(picture):
    """Mean of the rows, along the floor behind the wall."""
    return picture[8:-8].mean(0)


def width(values, metres):
    """Metres in which a rising edge goes from 10 to 90 %."""
    rising = np.maximum.accumulate(values[np.argmin(values) :])
    places = np.interp([0.1, 0.9], rising, np.arange(len(rising)))
    return (places[1] - places[0]) * metres


def test_penumbra_is_as_wide_as_the_sun_makes_it(device):
    size, camera = (192, 48), orthographic((0.3, 6, 0.001), (0.3, 0, 0), 0.5)
    scene = wall_scene(5.0)
    values = {**MAPS, "shadow_maps.taps": "32"}
    ours = width(profile(visibility(device, scene, camera, 16, values, size)), 0.5 / 48)
    reference = width(profile(traced_visibility(device, scene, camera, 64, size)), 0.5 / 48)
    # 1.13 m of rays, on a floor that they meet at 45 degrees; a disk's edge rises from 10 to 90 % over 0.69 of it.
    assert reference == pytest.approx(0.8 / np.sin(np.pi / 4) * np.radians(5) / np.sin(np.pi / 4) * 0.69, rel=0.15)
    assert ours == pytest.approx(reference, rel=0.3)
    hard = width(profile(visibility(device, scene, camera, 1, HARD, size)), 0.5 / 48)
    assert hard < 0.3 * ours


LAMPS = {
    "point": shining(PointLight(intensity=3.0), move(-0.3, 1.6, 0.6)),
    "bulb": shining(PointLight(intensity=3.0, radius=0.1), move(-0.3, 1.6, 0.6)),
    "ball": shining(SphereLight(radiance=60.0, radius=0.1), move(0.2, 1.7, 0.9)),
    "spot": shining(SpotLight(intensity=9.0, outer_cone_angle=0.5), aim((1.2, 2.4, 1.2), (0, 0, 0))),
    "wide spot": shining(SpotLight(intensity=9.0, outer_cone_angle=1.4), aim((0.4, 1.6, 0.4), (0, 0, 0))),
    "rectangle": shining(RectangleLight(radiance=9.0, width=0.5, height=0.4), aim((-1, 1.8, -1), (0, 0, 0))),
}


@pytest.mark.parametrize("name", LAMPS)
def test_lamps_are_the_path_tracers(device, name):
    scene = scene_of(*things(), replace_node(LAMPS[name]))
    ours = render(device, scene, 16, ABOVE, SIZE, MAPS).color
    reference = trace(device, scene, 64, ABOVE, SIZE, max_depth=2).color
    unshadowed = render(device, scene, 16, ABOVE, SIZE, DARK).color
    error = np.abs(ours - reference).mean() / reference.mean()
    assert error < 0.04
    assert error < 0.25 * np.abs(unshadowed - reference).mean() / reference.mean()


def test_a_screen_close_to_a_bulb_keeps_the_far_floor_dark(device):
    # From far away the floor is so flat that disks about its pixels reach beyond its horizon.
    screen = placed(box((0.04, 1.2, 0.24), lambert(0.5)), move(0.3, 0.6, 0))
    bulb = shining(PointLight(intensity=3.0, radius=0.1), move(0, 1.0, 0))
    behind = orthographic((4, 6, 0.001), (4, 0, 0), 0.25)
    scene = scene_of(floor(16), screen, bulb)
    assert traced_visibility(device, scene, behind).max() < 0.02
    assert visibility(device, scene, behind, 4, MAPS).max() < 0.02


def replace_node(node):
    """A node that no scene has yet."""
    return shining(node.light, node.transform)


@pytest.mark.parametrize("height", [2.0, 0.3, 0.1])
@pytest.mark.parametrize("mode", ["hard", "soft"])
def test_nothing_shadows_itself(device, height, mode):
    tilted = placed(plane(1.5, 1.5, lambert(0.5)), move(1.0, 0.8, 0) @ rotate("z", -20) @ rotate("x", 10))
    diameter = 0.05 if mode == "soft" else 0.0
    values = {**MAPS, "shadows.mode": mode, "shadow_maps.cascade_size": "256"}
    assert arriving(device, scene_of(floor(10), sun((1, height, 0.4), diameter)), values).min() == 1
    only_tilted = arriving(device, scene_of(tilted, sun((1, height + 0.5, 0.4), diameter)), values)
    assert (only_tilted > 0).mean() > 0.05
    assert only_tilted[only_tilted > 0].min() == 1


def arriving(device, scene, values):
    """What the maps of the only light say, (height, width); 0 where there is nothing."""
    renderer = pica.Renderer(scene, size=SIZE, settings=settings(values), device=device)
    renderer.advance(ABOVE, capture=("debug.shadows.filtered",))
    lights = renderer.captured["debug.shadows.filtered"]()
    assert lights.shape == (SIZE[1], SIZE[0], 1)
    return lights[..., 0].astype(np.float32)


def test_a_ball_has_no_acne(device):
    scene = scene_of(placed(sphere(1.0, lambert(0.5)), move(0, 0, 0)), sun((1, 1, 0.5)))
    ours = render(device, scene, 1, ABOVE, SIZE, {**HARD, "shadow_maps.cascade_size": "512"}).color[..., 1]
    free = render(device, scene, 1, ABOVE, SIZE, DARK).color[..., 1]
    lit = free > 0.15 * free.max()
    assert (ours[lit] / free[lit]).min() > 0.98


def test_a_wall_throws_its_shadow_from_behind(device):
    for side in (1, -1):
        wall = placed(plane(1, 1, lambert(0.5)), move(0, 0.5, 0) @ rotate("x", 90 * side))
        assert (visibility(device, scene_of(floor(), wall, sun((0, 1, 1)))) < 0.1).mean() > 0.02


def test_half_transparent_things_let_half_through(device):
    sheet = placed(plane(2, 2, leaves(AlphaMode.BLEND)), move(0, 1.5, 0))
    scene = scene_of(floor(), sheet, sun((0.8, 1, 0)))
    ours, reference = visibility(device, scene), traced_visibility(device, scene, samples=64)
    assert ours.mean() == pytest.approx(reference.mean(), abs=0.02)


def test_lights_without_maps_throw_no_shadow(device):
    scene = scene_of(*things(), sun())
    assert visibility(device, scene, values={**HARD, "shadow_maps.max_lights": "0"}).min() > 0.99


def advanced(renderer, camera):
    """What the maps took the GPU in one frame; 0 where none was drawn."""
    renderer.advance(camera)
    return renderer.device.profiler.flush().get("shadow maps", 0)


def test_maps_are_drawn_only_when_something_has_changed(device):
    scene = scene_of(*things(), sun(), replace_node(LAMPS["spot"]))
    renderer = pica.Renderer(scene, size=SIZE, settings=settings(HARD), device=device)
    camera = pica.Camera.look_at((0, 2, 4), (0, 0, 0))
    assert advanced(renderer, camera) > 0
    assert advanced(renderer, camera) == 0
    nudged = replace(camera, transform=move(0.001, 0, 0) @ camera.transform)
    assert advanced(renderer, nudged) == 0
    memory = device.memory
    ball, lamp = scene.roots[2], scene.roots[-1]
    for node in (ball, lamp):
        node.transform = move(0.2, 0, 0) @ node.transform
        assert advanced(renderer, nudged) > 0
        assert advanced(renderer, nudged) == 0
    assert advanced(renderer, pica.Camera.look_at((5, 2, -4), (0, 0, 0))) > 0
    assert device.memory == memory


def test_shadows_follow_what_moves(device):
    ball = placed(sphere(0.4, lambert(0.5)), move(-1, 0.6, 0))
    scene = scene_of(floor(), ball, sun())
    renderer = pica.Renderer(scene, size=SIZE, settings=settings(HARD), device=device)
    renderer.render(1, camera=ABOVE)
    ball.transform = move(1, 0.6, 0.3)
    renderer.reset()
    moved = renderer.render(1, camera=ABOVE).color
    same = placed(sphere(0.4, lambert(0.5)), ball.transform)
    fresh = render(device, scene_of(floor(), same, sun()), 1, ABOVE, SIZE, HARD).color
    assert np.abs(moved - fresh).mean() < 2e-3 * fresh.mean()


def test_what_moves_beyond_the_scene_still_throws_its_shadow(device):
    ball = placed(sphere(0.4, lambert(0.5)), move(0, 0.6, 0))
    scene = scene_of(floor(), ball, sun((1, 3, 0)))
    renderer = pica.Renderer(scene, size=SIZE, settings=settings(HARD), device=device)
    renderer.render(1, camera=ABOVE)
    ball.transform = move(10, 31, 0)
    renderer.reset()
    shaded = renderer.render(1, camera=orthographic((0, 20, 0.001), (0, 0, 0), 4.0, far=50.0)).color[..., 1]
    assert (shaded < 0.5 * np.median(shaded)).mean() > 0.01


def test_edges_do_not_shimmer(device, monkeypatch):
    """A camera that moves by whole pixels sees the same picture, moved, although every frame draws the maps anew."""
    scene = scene_of(*things(), sun())
    monkeypatch.setattr("pica.effects.shadow_maps.cascades._MARGIN", 0.0)
    values = {**HARD, "shadow_maps.cascade_size": "256"}
    renderer = pica.Renderer(scene, size=SIZE, settings=settings(values), device=device)
    pixel = 4.0 / SIZE[1]
    pictures = []
    for step in range(4):
        camera = replace(ABOVE, transform=move(step * pixel, 0, 0) @ ABOVE.transform)
        renderer.reset()
        pictures.append(renderer.render(1, camera=camera).color[..., 1])
    for step, picture in enumerate(pictures[1:], 1):
        same, first = picture[:, : -step - 1], pictures[0][:, step:-1]
        changed = np.abs(same - first) > 0.02 * first.max()
        assert changed.mean() < 2e-3


def test_views_list_only_what_they_may_see(device):
    crowd = [placed(sphere(0.2, lambert(0.5)), move(x, 0.2, z)) for x in range(-20, 21, 4) for z in range(-20, 21, 4)]
    scene = scene_of(floor(60), *crowd, sun())
    camera = pica.Camera.look_at((0.5, 1.5, 2), (0.5, 0.2, 0), vertical_fov=np.radians(40))
    renderer = pica.Renderer(scene, size=SIZE, settings=settings(HARD), device=device)
    renderer.render(1, camera=camera)
    listed = renderer._stages.shadows.maps.draw_counts.to_numpy().view(np.uint32)[::2].astype(int)
    assert listed[0] < len(crowd) / 4
    assert listed.max() <= len(crowd) + 1
    assert (np.diff(listed) >= 0).all()
    assert psnr(visibility(device, scene, camera, 16), traced_visibility(device, scene, camera)) > 22


def test_the_raster_preset_has_shadows_without_rays(device):
    scene = scene_of(*things(), sun())
    renderer = pica.Renderer(scene, size=SIZE, settings=pica.Settings.preset("raster"), device=device)
    picture = renderer.render(1, camera=ABOVE)
    assert "shadow map lookup" in picture.timings and "shadow_rays" not in picture.timings
    assert 0.05 < (picture.aov("shadows")[..., 0] < 0.5).mean() < 0.5

"""Ambient occlusion against closed forms, against many rays, and what it does to the light."""

import numpy as np
import pytest

import pica
from pica.errors import SettingsError
from pica.quality.effects import compare_effect
from pica.quality.sequences import sequence
from pica.scene.camera import Camera
from pica.scene.material import Material
from pica.scenes.basic_meshes import box, plane
from pica.scenes.placing import move, rotate
from pica.tracing import embree
from tests.building import CAMERA, lambert, orthographic, placed, scene_of, settings, still_life, uniform

SIZE = (64, 48)
MODES = ("ray_traced", "ground_truth")


ALONE = {"reflections.mode": "off", "global_illumination.mode": "off"}
"""Their light would take most of the time and change none of these pictures."""


def renderer_of(device, scene, preset=None, values=None, filters=True, **occlusion):
    """By a preset, or with no other effect of the surroundings."""
    chosen = pica.Settings.preset(preset) if preset else pica.Settings().with_values(ALONE)
    chosen = chosen.with_values({"debug.filters": filters, **(values or {})})
    occlusion = {f"ambient_occlusion.{name}": str(value) for name, value in occlusion.items()}
    return pica.Renderer(scene, size=SIZE, settings=chosen.with_values(occlusion), device=device)


def unoccluded(device, scene, camera, frames=1, **occlusion):
    return renderer_of(device, scene, **occlusion).render(frames, camera=camera).aov("ambient_occlusion")


def under_a_ceiling():
    """A floor seen from below a ceiling 1 m above it."""
    scene = scene_of(
        placed(plane(60, 60, lambert())), placed(plane(60, 60, lambert(0.5, double_sided=True)), move(0, 1, 0))
    )
    return scene, Camera.look_at((0, 0.9, 0.001), (0, 0, 0), vertical_fov=np.radians(60))


@pytest.mark.parametrize(("nearest", "furthest", "expected"), [(0, 2, 0.25), (0, 0.9, 1), (1.25, 2, 0.61)])
def test_under_a_ceiling_a_cone_is_closed(device, nearest, furthest, expected):
    """Rays meet it at 1 / cos: the cosine-weighted share of directions with cos > c is 1 - c^2."""
    scene, camera = under_a_ceiling()
    lengths = {"min_distance": nearest, "max_distance": furthest}
    found = unoccluded(device, scene, camera, filters=False, mode="ray_traced", rays=16, **lengths)
    assert found.shape == SIZE[::-1] and found.dtype == np.float32
    assert found.mean() == pytest.approx(expected, abs=0.01)


def beside_a_wall():
    """A floor and a wall along x = 0, seen from above and aside."""
    scene = scene_of(
        placed(plane(40, 40, lambert())),
        placed(plane(40, 40, lambert(0.5, double_sided=True)), move(0, 20, 0) @ rotate("z", 90)),
    )
    return scene, orthographic((3, 3, 0), (0, 0, 0), HEIGHT)


HEIGHT = 4.0
"""Metres from edge to edge of the picture."""


@pytest.mark.parametrize("mode", MODES)
def test_beside_a_wall_a_segment_of_the_disk_is_closed(device, mode):
    """Directions with x > d / R meet it: a segment of the unit disk that the hemisphere projects to (Nusselt)."""
    scene, camera = beside_a_wall()
    # One slice tells little, and slices weigh differently in the filter's mean.
    renderer = renderer_of(device, scene, mode=mode, rays=16, filters=mode == "ground_truth")
    mean = np.mean([renderer.render(1, camera=camera).aov("ambient_occlusion") for _ in range(16)], axis=0)
    normal = renderer.render(1, camera=camera).aov("normal")
    # Rows go up the picture, which is tilted by 45 degrees to the floor; its middle is the corner.
    row = np.arange(SIZE[1]) + 0.5
    distance = np.sqrt(2) * HEIGHT * (row / SIZE[1] - 0.5)
    rows = (distance > 0.25) & (normal[..., 1] > 0.9).all(1)
    share = np.clip(distance / 2, 0, 1)[rows]
    expected = 1 - (np.arccos(share) - share * np.sqrt(1 - share**2)) / np.pi
    assert rows.sum() > 15 and np.ptp(expected) > 0.4
    # In screen space a sample more than 2 m away counts for nothing, and those nearer by for all that is below them.
    np.testing.assert_allclose(mean[rows].mean(1), expected, atol=0.02 if mode == "ray_traced" else 0.06)


@pytest.mark.parametrize("mode", MODES)
def test_an_open_floor_and_the_surroundings_are_open(device, mode):
    camera = Camera.look_at((0, 1, 3), (0, 0.6, 0), vertical_fov=np.radians(60))
    found = unoccluded(device, scene_of(placed(plane(9, 9, lambert()))), camera, 3, mode=mode)
    np.testing.assert_allclose(found, 1, atol=2e-3)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(("motion", "speed"), [("still", None), ("orbit", 0.25), ("objects", 1 / 60)])
def test_the_filter_brings_a_frame_closer_to_many_rays(device, mode, motion, speed):
    errors = {}
    for filtered in (True, False):
        scene = still_life()
        renderer = renderer_of(device, scene, mode=mode, max_distance=0.6, filters=filtered)
        play = sequence(motion, scene, CAMERA, speed=speed)
        errors[filtered] = compare_effect(renderer, "ambient_occlusion", play, 8, 64)
    gain = errors[True].psnr[-1] - errors[False].psnr[-1]
    assert gain > (8 if mode == "ray_traced" else 1)
    assert errors[True].change[-1] < 0.7 * errors[False].change[-1]


def test_the_first_frame_is_filtered_too(device):
    errors = [
        compare_effect(
            renderer_of(device, still_life(), mode="ray_traced", max_distance=0.6, filters=filtered),
            *("ambient_occlusion", "still", 1, 64, CAMERA),
        ).psnr[0]
        for filtered in (True, False)
    ]
    assert errors[0] > errors[1] + 6


def test_what_goes_leaves_no_shadow_behind(device):
    lid = placed(box((0.8, 0.4, 0.8), lambert()), move(0, 0.5, 0), "lid")
    scene = scene_of(placed(plane(6, 6, lambert())), lid)
    camera = Camera.look_at((0, 0.8, 3), (0, 0.1, 0), vertical_fov=np.radians(30))
    renderer = renderer_of(device, scene, mode="ray_traced", max_distance=1.0)
    before = renderer.render(20, camera=camera).aov("ambient_occlusion")
    lid.transform = move(50, 0.5, 0)
    after = [renderer.render(1, camera=camera).aov("ambient_occlusion") for _ in range(6)]
    dark = before < 0.5
    assert dark.sum() > 50
    assert after[0][dark].mean() > 0.8 and after[-1][dark].mean() > 0.95


def test_reset_drops_the_history(device):
    renderer = renderer_of(device, still_life(), mode="ray_traced")
    first = renderer.render(1, camera=CAMERA).aov("ambient_occlusion")
    renderer.render(3, camera=CAMERA)
    renderer.reset()
    np.testing.assert_array_equal(renderer.render(1, camera=CAMERA).aov("ambient_occlusion"), first)


def test_both_schedulers_give_the_same_bits(device):
    schedulers = ({"rays.scheduler": "pipeline"}, {"rays.scheduler": "buffers", "rays.tracer": "device"})
    pair = []
    for more in schedulers:
        values = {"visibility.primary": "raster", **more}
        renderer = renderer_of(device, still_life(), values=values, mode="ray_traced", rays=2)
        pair.append(renderer.render(3, camera=CAMERA).aov("ambient_occlusion"))
    assert 0.3 < pair[0].mean() < 0.95
    np.testing.assert_array_equal(*pair)


@pytest.mark.skipif(embree.missing() is not None, reason="Embree cannot trace")
def test_embree_meets_the_same(device):
    pair = []
    for more in ({"rays.scheduler": "pipeline"}, {"rays.scheduler": "buffers", "rays.tracer": "embree"}):
        values = {"visibility.primary": "raster", **more}
        renderer = renderer_of(device, still_life(), values=values, filters=False, mode="ray_traced", rays=2)
        pair.append(renderer.render(1, camera=CAMERA).aov("ambient_occlusion"))
    assert (pair[0] == pair[1]).mean() > 0.995


def test_a_prefiltered_environment_is_dimmed_in_the_surroundings_colour(device):
    scene, camera = under_a_ceiling()
    scene = scene_of(
        placed(plane(60, 60, lambert(0.8, 0.4, 0.1))),
        placed(plane(60, 60, lambert(0.5, double_sided=True)), move(0, 1, 0)),
        environment=uniform(1, 1, 1),
    )
    values = {"max_distance": 2, "rays": 16}
    frame = renderer_of(device, scene, preset="raster", mode="ray_traced", **values).render(8, camera=camera)
    plain = renderer_of(device, scene, preset="raster", mode="off").render(8, camera=camera)
    share = (frame.color / plain.color).mean((0, 1))
    # Jimenez et al. 2016, equation 10, at an open share of 1/4.
    albedo, open_ = np.array((0.8, 0.4, 0.1)), 0.25
    a, b, c = 2.0404 * albedo - 0.3324, -4.7951 * albedo + 0.6417, 2.7552 * albedo + 0.6903
    np.testing.assert_allclose(share, np.maximum(open_, ((open_ * a + b) * open_ + c) * open_), atol=0.015)


def test_a_mirror_loses_what_is_not_open(device):
    mirror = Material(base_color=(1, 1, 1, 1), metallic=1.0, roughness=0.1)
    scene = scene_of(
        placed(plane(60, 60, mirror)),
        placed(plane(60, 60, lambert(double_sided=True)), move(0, 1, 0)),
        environment=uniform(1, 1, 1),
    )
    camera = Camera.look_at((0, 0.9, 0.001), (0, 0, 0), vertical_fov=np.radians(60))
    # Reflections over the picture would find themselves what hides the sky, and not what is beyond its edge.
    values = {"preset": "raster", "values": {"reflections.mode": "off"}, "mode": "ray_traced", "rays": 16}
    closed, opened = (
        renderer_of(device, scene, max_distance=far, **values).render(8, camera=camera).color.mean()
        for far in (20, 0.5)
    )
    assert opened == pytest.approx(1, abs=0.02) and closed < 0.1


def test_light_that_has_shadows_is_not_dimmed_twice(device):
    pictures = [
        renderer_of(device, still_life(), preset="quality", mode=mode).render(2, camera=CAMERA).color
        for mode in ("off", "ray_traced")
    ]
    np.testing.assert_array_equal(*pictures)


def test_the_raster_preset_needs_no_rays(device):
    frame = renderer_of(device, still_life(), preset="raster").render(2, camera=CAMERA)
    assert {"horizons", "occlusion_history"} <= set(frame.timings) and "occlusion_rays" not in frame.timings
    assert frame.aov("ambient_occlusion").min() < 0.7


def test_views_show_the_filters_work(device):
    renderer = renderer_of(device, still_life(), mode="ray_traced")
    renderer.debug = True
    frame = renderer.render(4, camera=CAMERA)
    raw, filtered, history, variance = (
        frame.aov(f"debug.ambient_occlusion.{name}") for name in ("raw", "filtered", "history", "variance")
    )
    assert set(np.unique(raw)) == {0, 1}
    np.testing.assert_array_equal(filtered, frame.aov("ambient_occlusion"))
    assert np.median(history[frame.aov("instance") > 0]) == pytest.approx(4, abs=0.01)
    assert variance.min() >= 0 and 0 < np.median(variance[filtered < 0.9]) < 0.05


def test_distances_in_the_wrong_order_are_an_error():
    with pytest.raises(SettingsError, match=r"ambient_occlusion\.min_distance: 3\.0 is not below max_distance 2\.0"):
        settings({"ambient_occlusion.min_distance": "3"})
    with pytest.raises(SettingsError, match=r"ambient_occlusion\.rays: 17 is outside 1 to 16"):
        settings({"ambient_occlusion.rays": "17"})

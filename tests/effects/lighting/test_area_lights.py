"""Whole lights by linearly transformed cosines, against the same lights sampled."""

import numpy as np
import pytest

import pica
from pica.effects.lighting.ltc_tables import TABLE
from pica.quality.effects import compare_effect
from pica.scene.camera import Camera
from pica.scene.light import DirectionalLight, PointLight, RectangleLight
from pica.scene.material import Material
from pica.scenes.basic_meshes import plane, sphere
from pica.scenes.placing import aim, move
from tests.assets import ASSETS, needs_assets
from tests.building import converged, lambert, placed, render, scene_of, settings, shining
from tests.effects.lighting.area_light_table import LIGHTS, Comparison, apart, floor_points

SIZE = (64, 48)

WHOLE, SAMPLED = 0, 1


@pytest.fixture(scope="module")
def compare(device):
    return Comparison(device)


@pytest.mark.parametrize("roughness", [0.1, 0.3, 0.6, 1.0])
def test_diffuse_light_of_every_shape(compare, roughness):
    """Of a dielectric, whose reflection leaves the less the lower the light stands."""
    found = compare(list(LIGHTS.values()), floor_points(256, roughness, 0.0), 1024)
    means = found[..., 0].mean(1)
    for name, mean in zip(LIGHTS, means, strict=True):
        assert mean[WHOLE] == pytest.approx(mean[SAMPLED], rel=0.012), name


@pytest.mark.parametrize("metallic", [0.0, 1.0])
@pytest.mark.parametrize("roughness", [0.3, 0.6, 1.0])
def test_specular_light_of_every_shape(compare, roughness, metallic):
    found = compare(list(LIGHTS.values()), floor_points(256, roughness, metallic), 1024)
    for name, points in zip(LIGHTS, found[..., 1], strict=True):
        mean = points.mean(0)
        # Half of this one is below the horizon, where the fitted lobe is at its worst.
        sunk = name == "standing disk"
        tolerance, alike = (0.3, 0.93) if sunk else (0.1, 0.97)
        assert mean[WHOLE] == pytest.approx(mean[SAMPLED], rel=tolerance), name
        assert np.corrcoef(points.T)[0, 1] > alike, name


@pytest.mark.parametrize("roughness", [0.3, 0.45, 0.66, 0.85])
def test_rough_metal_is_as_bright_beside_highlights_as_in_them(compare, roughness):
    """At each point by itself: most of a metal's surface lies where GGX's long tail is all of its light."""
    for name, points in zip(
        LIGHTS, compare(list(LIGHTS.values()), floor_points(256, roughness, 1.0), 1024), strict=True
    ):
        assert np.median(apart(points)) < 0.1, name
        assert np.percentile(apart(points), 90) < 0.22, name


@pytest.mark.parametrize("metallic", [0.0, 1.0])
def test_lights_far_smaller_than_a_lobe_are_exact(compare, metallic):
    small = {
        "sun": (DirectionalLight(angular_diameter=0.01), aim((1, 3, 1), (0, 0, 0))),
        "bulb": (PointLight(radius=0.01), move(0, 2, 0)),
    }
    for diffuse, specular in (
        compare(list(small.values()), floor_points(256, 0.5, metallic), 256).mean(1).swapaxes(1, 2)
    ):
        assert specular[WHOLE] == pytest.approx(specular[SAMPLED], rel=2e-3)
        assert diffuse[WHOLE] == pytest.approx(diffuse[SAMPLED], rel=2e-3)


def test_highlights_of_smooth_metal(compare):
    """A sun of five degrees in a mirror is as bright as the sun, where it is seen, and the BRDF's lobe round about."""
    light = LIGHTS["sun of 5 degrees"]
    points = floor_points(4096, 0.05, 1.0)
    direction = light[1][:3, 2]
    mirrored = points["view"] * [-1, 1, -1]
    angle = np.degrees(np.arccos(np.clip(mirrored @ direction, -1, 1)))
    whole = compare([light], points, 1)[0, :, WHOLE, 1]
    radiance = 1 / (np.pi * np.sin(np.radians(2.5)) ** 2)
    assert (angle < 1.5).any()
    np.testing.assert_allclose(whole[angle < 1.5], radiance, rtol=0.05)
    assert whole[angle > 6].max() < 0.02 * radiance


def test_a_light_all_around_gives_the_albedo(compare):
    """A white metal within a wide, near ceiling reflects all of it, to what the energy's fits leave over."""

    ceiling = (RectangleLight(radiance=2, width=2000, height=2000), aim((0.001, 1, 0.001), (0, 0, 0)))
    for metallic in (0.0, 1.0):
        for roughness in (0.1, 0.5, 1.0):
            points = floor_points(64, roughness, metallic)
            points = points[points["view"][:, 1] > 0.2]
            whole = compare([ceiling], points, 1)[0, :, WHOLE].sum(-1)
            np.testing.assert_allclose(whole, 2, rtol=0.05)


@needs_assets
def test_the_fit_agrees_with_the_published_one():
    """The lobes of Heitz et al. 2016, by roughness and view; theirs start from another frame and another error."""
    ours = np.load(TABLE).astype(np.float64)
    theirs = np.fromfile(ASSETS / "ltc" / "ltc_1_64x64x4.f32", np.float32).reshape(64, 64, 4).astype(np.float64)
    z = (np.arange(60) + 0.5) / 60
    phi = 2 * np.pi * (np.arange(120) + 0.5) / 120
    sine = np.sqrt(1 - z**2)
    directions = np.stack(
        [np.outer(sine, np.cos(phi)).ravel(), np.outer(sine, np.sin(phi)).ravel(), np.repeat(z, len(phi))]
    )
    for row in (20, 32, 48, 63):
        for column in (0, 20, 40, 55):
            cosine = 1 - (column / 63) ** 2
            slope = np.sqrt(1 - cosine**2)
            a, b, c, d = ours[row, column, :4]
            frame = np.array([[cosine, 0, slope], [0, 1, 0], [-slope, 0, cosine]])
            mine = np.array([[a, 0, b], [0, 1, 0], [c, 0, d]]) @ frame
            t = theirs[column, row]
            published = np.array([[t[0], 0, t[2]], [0, 1, 0], [t[1], 0, t[3]]])
            lobes = [density(inverse, directions) for inverse in (mine, published)]
            difference = np.abs(lobes[0] - lobes[1]).sum() / lobes[1].sum()
            assert difference < 0.15, (row, column, difference)


def density(inverse, directions):
    original = inverse @ directions
    lobe = np.maximum(original[2], 0) / (original**2).sum(0) ** 2 * abs(np.linalg.det(inverse))
    return lobe / lobe.sum()


@pytest.mark.parametrize("metallic", [0.0, 1.0])
def test_ratio_takes_what_is_hidden_out_of_the_highlight(device, metallic):
    """A ball before a lamp that a glossy floor mirrors is seen in the highlight, as by the path tracer."""
    camera = Camera.look_at((0, 1.1, 3.4), (0, 0.35, 0), vertical_fov=np.radians(38))
    lamp = shining(RectangleLight(radiance=6, width=1.6, height=0.8), aim((0, 1.4, -2.2), (0, 0, 0.2)))

    def scene():
        floor = Material(base_color=(0.5, 0.5, 0.5, 1), metallic=metallic, roughness=0.2)
        ball = placed(sphere(0.3, lambert(0.6)), move(0, 0.55, -0.6))
        return scene_of(placed(plane(8, 8, floor)), ball, lamp)

    expected = converged(device, scene(), 512, camera, SIZE, max_depth=2)
    errors = {}
    for shadows in ("split_sum", "ratio_estimator"):
        found = render(device, scene(), 64, camera, SIZE, {"lighting.area_shadows": shadows}).color
        errors[shadows] = np.square(found - expected).mean() / expected.mean() ** 2
        if shadows == "ratio":  # whose bias goes as samples come
            assert found.mean() == pytest.approx(expected.mean(), rel=0.02)
    assert errors["ratio_estimator"] < 0.25 * errors["split_sum"], errors


def test_ratio_and_split_sum_are_the_same_on_matte_surfaces(device):
    def picture(shadows):
        lamp = shining(RectangleLight(radiance=6, width=1.6, height=0.8), aim((0.5, 1.4, -1.2), (0, 0, 0)))
        scene = scene_of(placed(plane(8, 8, lambert(0.5))), placed(sphere(0.3, lambert(0.6)), move(0, 0.4, 0)), lamp)
        return render(device, scene, 8, size=SIZE, values={"lighting.area_shadows": shadows}).color

    np.testing.assert_allclose(picture("ratio_estimator"), picture("split_sum"), rtol=0.005)


def test_the_reference_of_shadows_follows_the_ratio(device):
    """The filtered shadow comes near what `pica compare --effect shadows` calls right, with either weight."""
    lamp = shining(RectangleLight(radiance=6, width=1.6, height=0.8), aim((0, 1.4, -2.2), (0, 0, 0.2)))
    floor = Material(base_color=(0.5, 0.5, 0.5, 1), metallic=1.0, roughness=0.3)
    scene = scene_of(placed(plane(8, 8, floor)), placed(sphere(0.3, lambert(0.6)), move(0, 0.55, -0.6)), lamp)
    camera = Camera.look_at((0, 1.1, 3.4), (0, 0.35, 0), vertical_fov=np.radians(38))
    renderer = pica.Renderer(
        scene, size=SIZE, settings=settings({"lighting.area_shadows": "ratio_estimator"}), device=device
    )
    errors = compare_effect(renderer, "shadows", "still", 16, 128, camera)
    assert errors.psnr[-1] > 25, errors.psnr

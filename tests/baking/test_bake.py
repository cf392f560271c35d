"""Light maps against closed forms and the path tracer."""

import numpy as np
import pytest

import pica
from pica.light_map.light_map import HARMONICS, LightMap
from pica.quality.effects import MeasuredEffect
from pica.scene.camera import Camera
from pica.scenes.basic_meshes import box
from tests.building import lambert, placed, scene_of, settings
from tests.tracing.kernels import read

SIZE = (96, 64)
FROM_MAP = {"global_illumination.mode": "light_map"}
AXES = np.concatenate([np.eye(3), -np.eye(3)])


def basis(directions):
    """(n, 9) real spherical harmonics of (n, 3) directions."""
    x, y, z = np.asarray(directions).T
    one = np.ones_like(x)
    second = [x * y, y * z, (3 * z * z - 1) / np.sqrt(12), x * z, (x * x - y * y) / 2]
    parts = [one, *(np.sqrt(3) * each for each in (y, z, x)), *(np.sqrt(15) * each for each in second)]
    return np.stack(parts, -1) / np.sqrt(4 * np.pi)


def irradiance(light_map, probe, normals):
    """(n, 3) over pi."""
    return light_map.scale * np.einsum("nk,kc->nc", basis(normals), light_map.harmonics[probe].astype(float))


@pytest.fixture(scope="module")
def cornell(device):
    return pica.bake(pica.scenes.cornell(), spacing=0.25, samples=256, device=device)


def test_light_is_projected_to_its_irradiance(device):
    """Of light that is linear in the direction, for which that is 1 + 2/3 of the linear part."""
    across, probes = 4096, 3
    turns = (np.arange(across) + 0.5) / across
    z, angle = 1 - 2 * turns, np.pi * (1 + 5**0.5) * np.arange(across)
    around = np.sqrt(1 - z * z)
    directions = np.stack([around * np.cos(angle), around * np.sin(angle), z], -1)
    samples = np.zeros((probes, across, 8), np.float32)
    samples[..., 4:7] = directions
    slopes = np.array([[0.5, 0, 0], [0, -0.3, 0.2], [0, 0, 0]])
    samples[..., :3] = (1 + directions @ slopes.T).T[..., None] * (1, 2, 3)
    samples[1, : across // 4, 3] = 1  # of back faces
    found = device.structured("harmonics", np.zeros((probes * HARMONICS, 4), np.float32))
    inside = device.structured("inside", np.zeros(probes, np.float32))
    inputs = {"samples": device.structured("samples", samples.reshape(-1, 8)), "across": across, "probeCount": probes}
    with device.record() as recording:
        passes = device.compute("baking/probe_harmonics.slang")
        passes(recording, (16, probes, 1), harmonics=found, inside=inside, **inputs)
    device.handle.wait_for_idle()
    coefficients = read(found, np.float32).reshape(probes, HARMONICS, 4)
    shining = np.einsum("nk,pkc->pnc", basis(AXES), coefficients[..., :3].astype(float))
    expected = (1 + 2 / 3 * AXES @ slopes.T).T[..., None] * (1, 2, 3)
    np.testing.assert_allclose(shining, expected, atol=3e-3)
    np.testing.assert_allclose(read(inside, np.float32), [0, 0.25, 0])
    # A constant has its mean alone: 4 pi Y00 (1, 2, 3), which varies as the samples do, by nothing.
    assert coefficients[2, 0, 3] < 1e-6 < coefficients[1, 0, 3]


def test_a_furnace_is_as_bright_everywhere(device):
    """Walls that shine with 1 nit and reflect half of what arrives: they send on 1 nit besides their own."""
    walls = lambert(0.5, emission=(1.0, 1.0, 1.0), double_sided=True)
    light_map = pica.bake(scene_of(placed(box(2, walls))), spacing=0.5, samples=1024, device=device)
    within = (np.abs(light_map.bricks.positions) < 0.95).all(-1)
    assert within.sum() >= 27 and light_map.in_the_open[within].all()
    found = np.stack([irradiance(light_map, probe, AXES) for probe in np.flatnonzero(within)])
    assert found.mean() == pytest.approx(1, rel=0.005)
    np.testing.assert_allclose(found, 1, atol=0.05)


def test_a_probe_finds_what_the_path_tracer_does(device):
    """The indirect light about it, as six pictures of the path tracer have it."""
    scene = pica.scenes.cornell()
    light_map = pica.bake(scene, spacing=0.5, samples=4096, device=device)
    where = np.abs(light_map.bricks.positions - (0.0, 1.2, 0.3)).sum(-1)
    probe = int(np.argmin(np.where(light_map.in_the_open, where, np.inf)))
    place = light_map.bricks.positions[probe].astype(float)
    steps = (np.arange(24) + 0.5) / 12 - 1
    tracers = [
        pica.PathTracer(scene, size=(24, 24), max_depth=depth, settings=settings(), device=device)
        for depth in (None, 1)
    ]
    coefficients = np.zeros((HARMONICS, 3))
    for forward in AXES:
        up = (0, 0, 1) if forward[1] else (0, 1, 0)
        camera = Camera.look_at(place, place + forward, up=up, vertical_fov=np.radians(90))
        # The same samples, so that what shines by itself is gone without a trace.
        whole, seen = (tracer.render(48, camera=camera).color.astype(float) for tracer in tracers)
        right, above = camera.transform[:3, 0], camera.transform[:3, 1]
        rays = forward + steps[None, :, None] * right - steps[:, None, None] * above
        lengths = np.linalg.norm(rays, axis=-1)
        values = basis((rays / lengths[..., None]).reshape(-1, 3)).reshape(24, 24, HARMONICS)
        coefficients += np.einsum("yxk,yx,yxc->kc", values, lengths**-3 / 144, whole - seen)
    # Irradiance by Ramamoorthi and Hanrahan 2001: pi, 2 pi / 3 and pi / 4 for the bands.
    coefficients *= np.repeat([1, 2 / 3, 1 / 4], [1, 3, 5])[:, None]
    expected = basis(AXES) @ coefficients
    np.testing.assert_allclose(irradiance(light_map, probe, AXES), expected, atol=0.03 * expected.max())


def test_it_is_the_indirect_light_of_many_paths(device, cornell):
    renderer = pica.Renderer(
        pica.scenes.cornell(), size=SIZE, settings=settings(FROM_MAP), device=device, light_map=cornell
    )
    camera = renderer.scene.default_camera(1.5)
    measured = MeasuredEffect(renderer, "global_illumination")
    renderer.advance(camera, jittered=False, capture=measured.offers)
    found, expected = measured.result()["indirect"], measured.reference(128)["indirect"]
    there = np.isfinite(expected)
    assert found[there].mean() == pytest.approx(expected[there].mean(), rel=0.08)
    white = np.percentile(expected[there], 95)
    error = np.clip(found[there] / white, 0, 1) - np.clip(expected[there] / white, 0, 1)
    assert -10 * np.log10(np.mean(error**2)) > 20  # dB
    assert not renderer.count_rays(camera).keys() & {"indirect_rays", "surfel_rays"}


def test_the_raster_preset_takes_a_map_and_goes_without(device, cornell):
    scene, raster = pica.scenes.cornell(), pica.Settings.preset("raster")
    without = pica.Renderer(scene, size=SIZE, settings=raster, device=device)
    assert without._stages.global_illumination is None
    dark = without.render(2).color
    lit = pica.Renderer(scene, size=SIZE, settings=raster, device=device, light_map=cornell).render(2)
    # Ambient occlusion dims it: of the surfaces, in their colour.
    np.testing.assert_allclose(lit.color - dark, lit.aov("indirect"), atol=0.05 * lit.color.max())
    assert lit.aov("indirect").mean() > 0.2 * dark.mean()
    unoccluded = raster.with_values({"ambient_occlusion.mode": "off"})
    brighter = (
        pica.Renderer(scene, size=SIZE, settings=unoccluded, device=device, light_map=cornell).render(2).aov("indirect")
    )
    assert 0.5 * brighter.mean() < lit.aov("indirect").mean() < 0.99 * brighter.mean()


def test_a_closed_door_keeps_the_light_out(device):
    scene = pica.scenes.rooms(door=0.0)
    light_map = pica.bake(scene, spacing=0.25, samples=64, device=device)
    with pica.Renderer(scene, size=SIZE, settings=settings(FROM_MAP), device=device, light_map=light_map) as renderer:
        dark = renderer.render(4)
        lit = renderer.render(
            4, camera=Camera.look_at((-1.2, 1.5, 1.8), (-2.4, 1.0, -1.2), vertical_fov=np.radians(75))
        )
    assert lit.aov("indirect").mean() > 0.1
    assert dark.color.mean() < 0.01 * lit.color.mean()


def test_a_bake_that_was_cut_short_goes_on(device, cornell, tmp_path):
    """And ends with the same bits; another bake does not go on from there."""
    partial = tmp_path / "cornell.partial"
    heard = []

    def stop(done, total):
        heard.append(done)
        if len(heard) == 2:
            raise KeyboardInterrupt

    scene = pica.scenes.cornell()
    with pytest.raises(KeyboardInterrupt):
        pica.bake(scene, spacing=0.25, samples=256, device=device, progress=stop, partial=partial)
    assert partial.stat().st_size > 0 and 0 < heard[0] < heard[1]
    kept = partial.read_bytes()
    later = []
    again = pica.bake(
        scene, spacing=0.25, samples=256, device=device, progress=lambda done, _: later.append(done), partial=partial
    )
    assert later[0] > heard[1] and not partial.exists()
    for name in ("harmonics", "in_the_open", "seen"):
        np.testing.assert_array_equal(getattr(again, name), getattr(cornell, name))
    partial.write_bytes(kept)
    anew = []
    pica.bake(
        scene, spacing=0.25, samples=128, device=device, progress=lambda done, _: anew.append(done), partial=partial
    )
    assert anew[0] > heard[0], "runs of 128 samples have more probes: it began at the first one"
    partial.write_bytes(kept[:1000])
    pica.bake(scene, spacing=0.5, samples=16, device=device, partial=partial)


def test_maps_of_other_scenes_and_other_values_are_refused(device, cornell):
    with pytest.raises(pica.SceneError, match="another scene"):
        pica.Renderer(pica.scenes.court(), size=SIZE, settings=settings(FROM_MAP), device=device, light_map=cornell)
    with pytest.raises(pica.PicaError, match="light_map"):
        pica.Renderer(
            pica.scenes.court(), size=SIZE, settings=settings(FROM_MAP), device=device, light_map="cornell.lightmap"
        )
    for values in ({"spacing": 0}, {"spacing": float("nan")}, {"samples": 0}, {"samples": 1.5}, {"progress": 3}):
        with pytest.raises(pica.PicaError, match="bake"):
            pica.bake(pica.scenes.cornell(), device=device, **values)
    with pytest.raises(pica.SceneError, match="probes"):
        pica.bake(pica.scenes.cornell(), spacing=1e-4, device=device)
    assert isinstance(cornell, LightMap)

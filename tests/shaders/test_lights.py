"""lights.slang and gpu_scene/lights/light_rows.py: what lights send to a point, sampled and hit."""

import math

import numpy as np
import pytest
import slangpy as spy
from scipy.stats import qmc

from pica.gpu_scene.lights.light_rows import LIGHT_DTYPE, light_power, pack_light, pack_lights, selection_probabilities
from pica.scene.light import (
    DirectionalLight,
    DiskLight,
    PointLight,
    RectangleLight,
    SphereLight,
    SpotLight,
    TubeLight,
)
from pica.scene.model import Node, Scene
from tests.shaders.chi_squared import assert_fits

FIELDS = {
    "position": "float3",
    "type": "uint",
    "emission": "float3",
    "selectionProbability": "float",
    "direction": "float3",
    "radius": "float",
    "halfX": "float3",
    "range": "float",
    "halfY": "float3",
    "angleScale": "float",
    "angleOffset": "float",
    "area": "float",
    "channels": "uint",
}
SOURCE = """
__exported import gpu_scene.lights.lights;
export static const bool LIGHTS_IN_USE = true;
export static const bool FLAT_LIGHTS_IN_USE = true;
export static const bool TUBES_IN_USE = true;

float4 sampled(StructuredBuffer<Light> lights, float3 position, float2 u)
{
    let s = sampleLight(lights[0], position, u);
    return float4(s.direction, s.pdf);
}
float4 sampledRadiance(StructuredBuffer<Light> lights, float3 position, float2 u)
{
    let s = sampleLight(lights[0], position, u);
    return float4(s.radiance, s.isDelta ? -s.distance : s.distance);
}
float4 hit(StructuredBuffer<Light> lights, float3 origin, float3 direction)
{
    let h = intersectLight(lights[0], origin, direction);
    return float4(h.radiance, h.distance);
}
float density(StructuredBuffer<Light> lights, float3 position, float3 direction)
{
    return lightPdf(lights[0], position, direction);
}
""" + "\n".join(
    f"{kind} {name}Of(StructuredBuffer<Light> lights, uint i) {{ return {kind}(lights[i].{name}); }}"
    for name, kind in FIELDS.items()
)
COUNT = 60_000


@pytest.fixture(scope="module")
def shader(load):
    return load(SOURCE)


@pytest.fixture(scope="module")
def table(device):
    def upload(*rows):
        data = np.stack(rows)
        return device.create_buffer(
            data=data.view(np.uint8), struct_size=LIGHT_DTYPE.itemsize, usage=spy.BufferUsage.shader_resource
        )

    return upload


def placed(position=(0, 0, 0), toward=(0, 0, -1), scale=(1, 1, 1)):
    """(4, 4) a node at `position` whose -Z points `toward`."""
    z = -np.asarray(toward, np.float64) / np.linalg.norm(toward)
    x = np.cross([0, 1, 0] if abs(z[1]) < 0.9 else [1, 0, 0], z)
    x /= np.linalg.norm(x)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([x, np.cross(z, x), z], 1) * scale
    matrix[:3, 3] = position
    return matrix


def uniform(count=COUNT, seed=1):
    return np.random.default_rng(seed).random((count, 2), np.float32)


def even(power=14):
    return qmc.Sobol(2, seed=1).random(2**power).astype(np.float32)


def irradiance(shader, lights, position, normal):
    """(3,) lux on a surface, by sampling."""
    u = even()
    position = np.float32(position)
    drawn = shader.sampled(lights, position, u, _result="numpy").astype(np.float64)
    radiance = shader.sampledRadiance(lights, position, u, _result="numpy").astype(np.float64)[:, :3]
    cosine = np.maximum(drawn[:, :3] @ normal, 0)
    share = np.divide(cosine, drawn[:, 3], out=np.zeros_like(cosine), where=drawn[:, 3] > 0)
    return (radiance * share[:, None]).mean(0)


def test_the_table_has_the_shaders_layout(shader, table):
    bits = np.random.default_rng(0).integers(0x3F000000, 0x3F800000, (3, LIGHT_DTYPE.itemsize // 4), np.uint32)
    rows = bits.view(LIGHT_DTYPE)[:, 0]
    index = np.arange(3, dtype=np.uint32)
    for name in FIELDS:
        got = getattr(shader, f"{name}Of")(table(*rows), index, _result="numpy")
        np.testing.assert_array_equal(got, rows[name], err_msg=name)
    assert LIGHT_DTYPE.itemsize == 96 and set(LIGHT_DTYPE.names) == {*FIELDS, "unused"}


# Sampling against densities ------------------------------------------------------------------------------------------

BALLS = {
    "sphere": (SphereLight(radius=0.5), placed((0.3, 2, -1))),
    "near sphere": (SphereLight(radius=0.5), placed((0, 0.51, 0))),
    "far sphere": (SphereLight(radius=0.01), placed((0, 20, 0))),
    "point": (PointLight(radius=0.2), placed((1, 1, 1))),
    "spot": (SpotLight(radius=0.2), placed((0, 2, 0), (0, -1, 0))),
    "sun": (DirectionalLight(angular_diameter=0.0093), placed((0, 0, 0), (0.4, -1, 0.1))),
    "wide sun": (DirectionalLight(angular_diameter=0.8), placed((0, 0, 0), (0.4, -1, 0.1))),
}


@pytest.mark.parametrize("name", BALLS)
def test_cones_are_filled_evenly(shader, table, name):
    light, world = BALLS[name]
    lights, row = table(pack_light(light, world)), pack_light(light, world)
    drawn = shader.sampled(lights, np.float32([0, 0, 0]), uniform(), _result="numpy").astype(np.float64)
    axis = -row["direction"].astype(np.float64) if isinstance(light, DirectionalLight) else world[:3, 3]
    distance = 1 if isinstance(light, DirectionalLight) else np.linalg.norm(axis)
    axis /= np.linalg.norm(axis)
    width = 1 - math.sqrt(1 - (float(row["radius"]) / distance) ** 2)
    frame = placed((0, 0, 0), -axis)[:3, :3]
    local = drawn[:, :3] @ frame
    drop = (local[:, :2] ** 2).sum(1) / (1 + local[:, 2])
    assert drop.max() < width * 1.001
    azimuth = np.arctan2(local[:, 1], local[:, 0]) / (2 * np.pi) % 1

    def density(points):
        d = (points[:, 0] * 0.999 + 0.0005) * width  # the very edge is rounding's
        sine, phi = np.sqrt(d * (2 - d)), 2 * np.pi * points[:, 1]
        v = np.stack([sine * np.cos(phi), sine * np.sin(phi), 1 - d], 1) @ frame.T
        return shader.density(lights, np.float32([0, 0, 0]), v.astype(np.float32), _result="numpy") * width * 2 * np.pi

    # A light as narrow as the far one is a few units of single precision across: coarser bins
    bins = (4, 8) if name in ("far sphere",) else (12, 16)
    assert_fits(np.stack([(drop / width).clip(0, 1), azimuth], 1), COUNT, density, tests=len(BALLS), bins=bins)
    np.testing.assert_allclose(drawn[:, 3], 1 / (2 * np.pi * width), rtol=2e-3)


FLATS = {
    "rectangle": (RectangleLight(width=2, height=1), placed((0, 2, 0.5), (0, -1, 0.3))),
    "grazing rectangle": (RectangleLight(width=2, height=1), placed((0.5, 0.1, 3), (0, -1, -0.02))),
    "far rectangle": (RectangleLight(width=0.1, height=0.1), placed((10, 20, 3), (-0.3, -1, 0))),
    "disk": (DiskLight(radius=0.7), placed((0, 1, 0.5), (0, -1, 0.3))),
    "ellipse": (DiskLight(radius=0.7), placed((0, 1, 0.5), (0, -1, 0.3), (2, 0.5, 1))),
}


@pytest.mark.parametrize("name", FLATS)
def test_flat_lights_fit_their_density(shader, table, name):
    light, world = FLATS[name]
    row = pack_light(light, world)
    lights, origin = table(row), np.float32([0, 0, 0])
    half_x, half_y, center = (row[key].astype(np.float64) for key in ("halfX", "halfY", "position"))
    normal = row["direction"].astype(np.float64)
    drawn = shader.sampled(lights, origin, uniform(), _result="numpy").astype(np.float64)
    distance = np.abs(shader.sampledRadiance(lights, origin, uniform(), _result="numpy")[:, 3:]).astype(np.float64)
    points = drawn[:, :3] * distance - center
    np.testing.assert_allclose(points @ normal, 0, atol=1e-5 * distance.max())
    plane = np.stack([points @ half_x / (half_x @ half_x), points @ half_y / (half_y @ half_y)], 1)
    is_disk = isinstance(light, DiskLight)
    if is_disk:
        square = np.stack([(plane**2).sum(1), np.arctan2(plane[:, 1], plane[:, 0]) / (2 * np.pi) % 1], 1)
    else:
        square = (plane + 1) / 2

    def density(s):
        s = s * 0.9998 + 0.0001  # the very edge is rounding's
        r, phi = np.sqrt(s[:, 0]), 2 * np.pi * s[:, 1]
        p = np.stack([r * np.cos(phi), r * np.sin(phi)], 1) if is_disk else 2 * s - 1
        v = center + p[:, :1] * half_x + p[:, 1:] * half_y
        d = np.linalg.norm(v, axis=1)
        directions = (v / d[:, None]).astype(np.float32)
        pdf = shader.density(lights, origin, directions, _result="numpy")
        return pdf * np.abs(v @ normal) / d**3 * float(row["area"])

    assert_fits(square.clip(0, 1), COUNT, density, tests=len(FLATS), bins=(16, 16), order=8)


def test_only_large_rectangles_are_sampled_by_solid_angle(shader, table):
    light = RectangleLight(width=2, height=1)
    for distance, steady in ((0.3, True), (60, False)):
        lights = table(pack_light(light, placed((1, distance, 0.4), (0, -1, 0.5))))
        pdf = shader.sampled(lights, np.float32([0, 0, 0]), uniform(500), _result="numpy")[:, 3]
        assert (np.ptp(pdf) < 1e-6 * pdf.mean()) == steady


@pytest.mark.parametrize("name", BALLS | FLATS)
def test_hits_agree_with_samples(shader, table, name):
    light, world = (BALLS | FLATS)[name]
    lights, origin, u = table(pack_light(light, world)), np.float32([0, 0, 0]), uniform(5000)
    drawn = shader.sampled(lights, origin, u, _result="numpy")
    sampled = shader.sampledRadiance(lights, origin, u, _result="numpy")
    directions = np.ascontiguousarray(drawn[:, :3])
    hit = shader.hit(lights, origin, directions, _result="numpy")
    met = hit[:, 3] > 0
    assert met.mean() > 0.99  # directions along the very edge may round past it
    np.testing.assert_allclose(hit[met, :3], sampled[met, :3], rtol=1e-4)
    np.testing.assert_allclose(hit[met, 3], sampled[met, 3], rtol=5e-3)
    pdf = shader.density(lights, origin, directions, _result="numpy")
    np.testing.assert_allclose(pdf[met], drawn[met, 3], rtol=5e-3)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, atol=1e-5)
    away = shader.hit(lights, origin, -directions, _result="numpy")
    assert (away[:, 3] < 0).all() and (away[:, :3] == 0).all()


# Closed forms --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("radius", [0.0, 1e-3, 0.5])
def test_point_light_gives_its_intensity_over_distance_squared(shader, table, radius):
    lights = table(pack_light(PointLight((1, 0.5, 0.25), 100, radius), placed((0, 2, 0))))
    np.testing.assert_allclose(irradiance(shader, lights, (0, 0, 0), (0, 1, 0)), [25, 12.5, 6.25], rtol=2e-3)


def test_sphere_light_facing(shader, table):
    # Radiance L, radius r, distance d: pi L (r / d)^2, from near by as well
    for distance in (0.6, 1.5, 40):
        lights = table(pack_light(SphereLight(radiance=10, radius=0.5), placed((0, distance, 0))))
        expected = np.pi * 10 * (0.5 / distance) ** 2
        np.testing.assert_allclose(irradiance(shader, lights, (0, 0, 0), (0, 1, 0)), expected, rtol=2e-3)


@pytest.mark.parametrize("distance", [0.05, 1.0, 30.0])
def test_disk_light_on_its_axis(shader, table, distance):
    # pi L r^2 / (r^2 + d^2) (view factor of a coaxial disk)
    lights = table(pack_light(DiskLight(radiance=3, radius=0.5), placed((0, distance, 0), (0, -1, 0))))
    expected = np.pi * 3 * 0.25 / (0.25 + distance**2)
    np.testing.assert_allclose(irradiance(shader, lights, (0, 0, 0), (0, 1, 0)), expected, rtol=0.02)


@pytest.mark.parametrize("distance", [0.1, 1.0, 30.0, 300.0])
def test_rectangle_light_above_its_corner(shader, table, distance):
    # Form factor of a parallel rectangle a x b over a point below its corner (Howell's catalogue, B-3)
    a, b = 1.0 / distance, 2.0 / distance
    factor = sum(p / math.hypot(1, p) * math.atan(q / math.hypot(1, p)) for p, q in ((a, b), (b, a)))
    row = pack_light(RectangleLight(radiance=5, width=2, height=1), placed((0.5, distance, 1.0), (0, -1, 0)))
    assert abs(row["halfX"][2]) == pytest.approx(1) and abs(row["halfY"][0]) == pytest.approx(0.5)
    lights = table(row)
    got = irradiance(shader, lights, (0, 0, 0), (0, 1, 0))
    np.testing.assert_allclose(got, 5 * factor / 2, rtol=3e-3)


@pytest.mark.parametrize("distance", [0.06, 0.5, 3.0])
def test_endless_tube(shader, table, distance):
    # Radiance L, radius r, distance d of the axis: pi L r / d facing it
    lights = table(pack_light(TubeLight(radiance=4, length=400 * distance, radius=0.05), placed((0, distance, 0))))
    expected = np.pi * 4 * 0.05 / distance
    np.testing.assert_allclose(irradiance(shader, lights, (0, 0, 0), (0, 1, 0)), expected, rtol=0.02)


@pytest.mark.parametrize("length", [0.0, 1.5])
def test_tube_from_its_end_is_a_sphere(shader, table, length):
    # Only the near round end is seen: pi L (r / d)^2
    light = pack_light(TubeLight(radiance=4, length=length, radius=0.2), placed((length / 2 + 0.5, 0, 0)))
    expected = np.pi * 4 * (0.2 / 0.5) ** 2
    np.testing.assert_allclose(irradiance(shader, table(light), (0, 0, 0), (1, 0, 0)), expected, rtol=2e-3)


def test_all_of_a_tube_is_met_and_found(shader, table):
    """Rays from all round meet a capsule where its distance to the axis is its radius; samples reach it, and the
    densities of both ways agree."""
    light = TubeLight(length=1.0, radius=0.3)
    random = np.random.default_rng(4)
    for position in ((0.2, -1, 0.3), (1.5, 0.2, 0.1), (0, 0.31, 0), (3, 0, 0)):
        origin, lights = np.float32(position), table(pack_light(light, placed()))
        aims = np.array([random.uniform(-0.9, 0.9), 0, 0]) + random.normal(size=(4000, 3)) * 0.3 - origin
        aims = (aims / np.linalg.norm(aims, axis=1, keepdims=True)).astype(np.float32)
        distance = shader.hit(lights, origin, aims, _result="numpy")[:, 3].astype(np.float64)

        def from_axis(points):
            return np.linalg.norm(
                points - np.stack([points[:, 0].clip(-0.5, 0.5), *np.zeros((2, len(points)))], 1), axis=1
            )

        steps = np.linspace(0, 5, 2000)
        nearest = np.min([from_axis(origin + aims * step) for step in steps], 0)
        clear = np.abs(nearest - 0.3) > 0.01
        np.testing.assert_array_equal(distance[clear] >= 0, nearest[clear] < 0.3)
        met = distance >= 0
        assert 0 < met.sum() < len(met)
        np.testing.assert_allclose(from_axis(origin + aims[met] * distance[met, None]), 0.3, atol=1e-3)

        drawn = shader.sampled(lights, origin, uniform(4000), _result="numpy").astype(np.float64)
        radiance = shader.sampledRadiance(lights, origin, uniform(4000), _result="numpy").astype(np.float64)
        found = from_axis(origin + drawn[:, :3] * radiance[:, 3:])
        assert np.mean(np.abs(found - 0.3) < 1e-3) > 0.999
        densities = shader.density(lights, origin, drawn[:, :3].astype(np.float32), _result="numpy")
        assert np.mean(np.isclose(densities, drawn[:, 3], rtol=1e-3)) > 0.995
        assert (shader.density(lights, origin, aims[met], _result="numpy") > 0).mean() > 0.999


def test_tube_density_integrates_to_one(shader, table):
    lights, origin = (
        table(pack_light(TubeLight(length=1.0, radius=0.3), placed((0.3, 0.9, 0.2)))),
        np.float32([0, 0, 0]),
    )
    u = even(18).astype(np.float64)
    sine = np.sqrt(u[:, 0] * (2 - u[:, 0]))
    phi = 2 * np.pi * u[:, 1]
    directions = np.stack([sine * np.cos(phi), 1 - u[:, 0], sine * np.sin(phi)], 1).astype(np.float32)
    density = shader.density(lights, origin, directions, _result="numpy").astype(np.float64)
    assert 2 * np.pi * density.mean() == pytest.approx(1, rel=5e-3)


@pytest.mark.parametrize("diameter", [0.0, 0.0093, 1.0])
def test_directional_light_gives_its_illuminance(shader, table, diameter):
    lights = table(pack_light(DirectionalLight((1, 1, 0.5), 1000, diameter), placed((5, 5, 5), (0.3, -1, 0))))
    facing = np.array([-0.3, 1, 0]) / math.hypot(0.3, 1)
    np.testing.assert_allclose(irradiance(shader, lights, (0, 0, 0), facing), [1000, 1000, 500], rtol=2e-3)
    tilted = irradiance(shader, lights, (0, 0, 0), (0, 1, 0))  # cosine law, while the disk is above the horizon
    np.testing.assert_allclose(tilted, np.multiply([1000, 1000, 500], facing[1]), rtol=2e-3)


@pytest.mark.parametrize("radius", [0.0, 0.05])
def test_spot_cone_and_range(shader, table, radius):
    light = SpotLight(intensity=16, inner_cone_angle=0.3, outer_cone_angle=0.6, radius=radius, range=8)
    lights = table(pack_light(light, placed((0, 4, 0), (0, -1, 0))))
    for angle in (0.0, 0.25, 0.45, 0.61):
        position = np.array([4 * math.tan(angle), 0, 0])
        distance = math.hypot(4, position[0])
        cone = (math.cos(angle) - math.cos(0.6)) / (math.cos(0.3) - math.cos(0.6))
        expected = 16 * min(max(cone, 0), 1) ** 2 * (1 - (distance / 8) ** 4) / distance**2
        facing = (np.array([0, 4, 0]) - position) / distance
        np.testing.assert_allclose(irradiance(shader, lights, position, facing), expected, rtol=3e-3, atol=1e-5)
    assert irradiance(shader, lights, (0, -4.1, 0), (0, 1, 0)).max() == 0


def test_sharp_lights_are_deltas_and_never_hit(shader, table):
    for light in (PointLight(), SpotLight(), DirectionalLight()):
        lights, origin = table(pack_light(light, placed((0, 2, 0), (0, -1, 0)))), np.float32([0, 0, 0])
        assert (shader.sampledRadiance(lights, origin, uniform(8), _result="numpy")[:, 3] < 0).all()
        up = np.float32([[0, 1, 0]])
        assert (shader.sampled(lights, origin, uniform(8), _result="numpy") == [0, 1, 0, 1]).all()
        assert shader.hit(lights, origin, up, _result="numpy")[0, 3] < 0
        assert shader.density(lights, origin, up, _result="numpy")[0] == 0


def test_no_light_from_inside_behind_or_rows_without_shape(shader, table):
    inside = pack_light(SphereLight(radius=3), placed((0, 1, 0)))
    behind = pack_light(RectangleLight(), placed((0, 1, 0), (0, 1, 0)))
    back_of_disk = pack_light(DiskLight(), placed((0, 1, 0), (0, 1, 0)))
    triangles = np.zeros((), LIGHT_DTYPE)
    triangles["type"] = 7
    environment = np.zeros((), LIGHT_DTYPE)
    environment["type"] = 8
    for row in (inside, behind, back_of_disk, triangles, environment):
        lights, origin = table(row), np.float32([0, 0, 0])
        assert (shader.sampled(lights, origin, uniform(64), _result="numpy")[:, 3] == 0).all()
        assert shader.hit(lights, origin, np.float32([[0, 1, 0]]), _result="numpy")[0, 3] < 0


# The table -----------------------------------------------------------------------------------------------------------


def test_scale_counts_for_area_lights_only():
    world = placed((1, 2, 3), (0, -1, 0), (2, 3, 4))
    rectangle = pack_light(RectangleLight(width=1, height=1), world)
    np.testing.assert_allclose([np.linalg.norm(rectangle[key]) for key in ("halfX", "halfY")], [1, 1.5], rtol=1e-6)
    assert rectangle["area"] == pytest.approx(6)
    assert pack_light(SphereLight(radius=1), world)["radius"] == pytest.approx(24 ** (1 / 3))
    assert pack_light(PointLight(radius=1), world)["radius"] == 1
    assert pack_light(DirectionalLight(angular_diameter=0.5), world)["radius"] == pytest.approx(math.sin(0.25))
    np.testing.assert_allclose(rectangle["direction"], [0, -1, 0], atol=1e-7)
    tube = pack_light(TubeLight(length=1, radius=1), world)
    assert np.linalg.norm(tube["halfX"]) == pytest.approx(1) and tube["radius"] == pytest.approx(math.sqrt(12))


def test_mirrored_and_sheared_nodes_still_shine_from_their_back():
    world = placed((0, 0, 0), (0, -1, 0), (-1, 1, 1))
    np.testing.assert_allclose(pack_light(RectangleLight(), world)["direction"], [0, -1, 0], atol=1e-7)
    sheared = np.eye(4)
    sheared[0, 1] = 0.5
    for light in (RectangleLight(), DiskLight()):
        row = pack_light(light, sheared)
        assert row["halfX"] @ row["halfY"] == pytest.approx(0, abs=1e-6)
        area = np.linalg.norm(np.cross(row["halfX"], row["halfY"])) * (math.pi if isinstance(light, DiskLight) else 4)
        assert row["area"] == pytest.approx(area, rel=1e-5)


def test_powers_and_selection():
    world = np.eye(4)
    assert light_power(PointLight(intensity=2), world, 1) == pytest.approx(8 * np.pi)
    assert light_power(DirectionalLight(illuminance=2), world, 3) == pytest.approx(18 * np.pi)
    assert light_power(RectangleLight(radiance=2, width=3), world, 1) == pytest.approx(6 * np.pi)
    assert light_power(SphereLight(radiance=1, radius=1), world, 1) == pytest.approx(4 * np.pi**2)
    assert light_power(TubeLight(radiance=1, length=0, radius=1), world, 1) == pytest.approx(4 * np.pi**2)
    assert light_power(TubeLight(radiance=1, length=3, radius=1), world, 1) == pytest.approx(10 * np.pi**2)
    # to all of one side and hard-edged, a spot is half a point light
    half = np.pi / 2
    spot = SpotLight(inner_cone_angle=half - 1e-6, outer_cone_angle=half)
    assert light_power(spot, world, 1) == pytest.approx(2 * np.pi, rel=1e-4)
    np.testing.assert_allclose(selection_probabilities([1, 3]), [0.25, 0.75])
    np.testing.assert_allclose(selection_probabilities([0, 0]), [0.5, 0.5])
    assert len(selection_probabilities([])) == 0


def test_scenes_lights_are_packed_in_node_order():
    scene = Scene()
    parent = scene.add(Node(light=PointLight(intensity=1)))
    child = parent.add(Node(light=DiskLight(radiance=1)))
    child.transform = placed((0, 5, 0))
    scene.add(Node())
    table = pack_lights(scene)
    assert table["type"].tolist() == [1, 4]
    np.testing.assert_allclose(table["position"], [[0, 0, 0], [0, 5, 0]])
    assert table["selectionProbability"].sum() == pytest.approx(1)
    assert len(pack_lights(Scene())) == 0

"""coats.slang and what brdf.slang makes of it: energy, reciprocity and sampling of a whole stack."""

import itertools

import numpy as np
import pytest
from scipy.stats import qmc

from tests.shaders.brdf_calls import brdf_calls
from tests.shaders.chi_squared import assert_fits, integrate
from tests.shaders.test_brdf import Around, hemisphere, view_at

SOURCE = """
import shaders.brdf;
export static const bool COATS_IN_USE = true;

struct Layers
{
    float4 base;        // colour (grey), metallic, roughness, F0
    float4 coats[3];    // strength, roughness, index of refraction, 1 where air is below
    float3 clear;       // transmittance of each coat
    float3 normal;      // of the coats
    uint count;
}

BrdfParameters surface(Layers layers)
{
    BrdfParameters p;
    p.baseColor = layers.base.x;
    p.metallic = layers.base.y;
    p.roughness = layers.base.z;
    p.dielectricF0 = layers.base.w;
    p.dielectricF90 = layers.base.w > 0 ? 1 : 0;
    p.coats = Coats.none();
    p.coats.count = layers.count;
    p.coats.normal = layers.normal;
    float above = 1;
    for (uint i = 0; i < layers.count; ++i)
    {
        float4 given = layers.coats[i];
        Coat coat;
        coat.strength = given.x;
        coat.roughness = given.y;
        coat.ior = given.z;
        coat.f0 = reflectanceBetween(above, given.z);
        coat.f90 = grazingReflectanceBetween(above, given.z);
        coat.transmittance = float3(1, layers.clear[i], 1);
        p.coats.coats[i] = coat;
        above = given.w != 0 ? 1 : given.z;
    }
    return p;
}

float4 weight(Layers layers, float3 view, float3 u)
{
    let s = BrdfTowards.create(surface(layers), view).sample(u);
    return float4(s.weight, s.pdf);
}
float3 albedo(Layers layers, float viewCosine)
{
    let a = environmentBrdf(surface(layers), viewCosine);
    return a.diffuse + a.specular;
}
float3 diffuseAlbedo(Layers layers, float viewCosine) { return environmentBrdf(surface(layers), viewCosine).diffuse; }
float3 entering(Layers layers, float viewCosine) { return environmentBrdf(surface(layers), viewCosine).entering; }
float3 specularAlbedo(Layers layers, float viewCosine) { return environmentBrdf(surface(layers), viewCosine).specular; }
float2 between(float above, float below)
{
    return float2(reflectanceBetween(above, below), grazingReflectanceBetween(above, below));
}
""" + brdf_calls("Layers")
COSINES = [0.05, 0.3, 0.7, 0.999]
ROUGHNESSES = [0.0, 0.3, 0.6, 1.0]
CLEAR = (1.0, 0.0, 1.5, 1.0)


@pytest.fixture(scope="module")
def shader(load):
    return load(SOURCE)


def stack(base=(1.0, 0.0, 1.0, 0.04), coats=(CLEAR,), clear=(1.0, 1.0, 1.0), normal=(0.0, 0.0, 1.0)):
    """Metallic or diffuse base, coats from the top."""
    padded = [list(map(float, coat)) for coat in coats] + [[0.0, 0.0, 1.5, 0.0]] * (3 - len(coats))
    return {
        "_type": "Layers",
        "base": list(map(float, base)),
        "coats": padded,
        "clear": list(clear),
        "normal": list(map(float, normal)),
        "count": len(coats),
    }


LACQUERS = (CLEAR, (1.0, 0.4, 1.5, 0.0), (0.5, 0.2, 1.8, 0.0))
STACKS = {
    "varnish on matter": stack(),
    "lacquer on metal": stack((1.0, 1.0, 0.4, 0.04), (LACQUERS[1],)),
    "three": stack((0.8, 0.5, 0.6, 0.04), (LACQUERS[1], LACQUERS[2], (1.0, 0.3, 1.3, 0.0)), (0.6, 0.9, 0.5)),
    "turned": stack((0.8, 0.0, 0.6, 0.04), (LACQUERS[1],), normal=(0.28, 0.0, 0.96)),
}


def furnace(shader, layers, cosine, weight="weight"):
    """(3,) share of even light from everywhere that is reflected."""
    u = qmc.Sobol(3, seed=1).random(2**13).astype(np.float32)
    weights = getattr(shader, weight)(layers, view_at(cosine), u, _result="numpy")
    return weights[:, :3].astype(np.float64).mean(0)


@pytest.mark.parametrize("roughness", ROUGHNESSES)
def test_white_furnace_of_one_coat(shader, roughness):
    """White matter gives back all light; a metal loses what docs/measurements/materials.md gives; nothing is gained."""
    for coat, cosine, ior in itertools.product(ROUGHNESSES, COSINES, (1.3, 1.5, 2.0)):
        layer = (1.0, coat, ior, 1.0)
        what = f"coat {coat} cosine {cosine} ior {ior}"
        matter = furnace(shader, stack((1.0, 0.0, roughness, 0.0), (layer,)), cosine)
        np.testing.assert_allclose(matter, 1, atol=0.01, err_msg=what)
        for metallic in (0.0, 1.0):
            reflected = furnace(shader, stack((1.0, metallic, roughness, 0.04), (layer,)), cosine)
            assert 0.93 < reflected.min() <= reflected.max() < 1.005, f"{what} metallic {metallic}: {reflected}"


@pytest.mark.parametrize("name", STACKS)
def test_matter_scatters_what_enters_through_the_coats(shader, name):
    color, metallic, _, _ = STACKS[name]["base"]
    for cosine in COSINES:
        scattered = shader.diffuseAlbedo(STACKS[name], cosine)
        np.testing.assert_allclose(scattered, color * (1 - metallic) * shader.entering(STACKS[name], cosine), atol=1e-6)


def test_a_smooth_coat_on_a_mirror_loses_nothing(shader):
    for cosine in COSINES:
        reflected = furnace(shader, stack((1.0, 1.0, 0.0, 0.04)), cosine)
        np.testing.assert_allclose(reflected, 1, atol=0.01)


def test_no_stack_gains_energy(shader):
    random = np.random.default_rng(0)
    for _ in range(120):
        roughnesses = random.choice([0.0, 0.3, 0.5, 0.6, 0.7, 1.0], 4)
        coats = [
            (random.choice([1.0, 1.0, 0.5]), rough, random.choice([1.3, 1.5, 2.0]), random.integers(2))
            for rough in roughnesses[: random.integers(1, 4)]
        ]
        base = (1.0, random.choice([0.0, 0.5, 1.0]), roughnesses[3], random.choice([0.0, 0.04, 0.1]))
        cosine = random.choice([0.1, 0.3, 0.5, 0.6, 0.7, 0.9])
        reflected = furnace(shader, stack(base, coats), cosine)
        assert 0.92 < reflected.min() <= reflected.max() < 1.005, f"{base} {coats} {cosine}: {reflected}"


@pytest.mark.parametrize("name", ["varnish on matter", "lacquer on metal", "three"])
def test_reciprocal(shader, name):
    view, light = hemisphere(5000, 1), hemisphere(5000, 2)
    there = shader.value(STACKS[name], view, light, _result="numpy") / light[:, 2:]
    back = shader.value(STACKS[name], light, view, _result="numpy") / view[:, 2:]
    np.testing.assert_allclose(there, back, rtol=2e-3, atol=1e-6)


@pytest.mark.parametrize("name", ["varnish on matter", "lacquer on metal", "three"])
def test_albedos_fit_what_is_sampled(shader, name):
    layers = STACKS[name]
    for cosine in COSINES:
        for closed, weight in ((shader.albedo, "weight"), (shader.specularAlbedo, "mirroredWeight")):
            sampled = furnace(shader, layers, cosine, weight)
            got = closed(layers, np.float32([cosine]), _result="numpy")[0]
            # what scatters below a mirror is brighter at the closed form, which knows nothing of widths
            np.testing.assert_allclose(got, sampled, atol=0.025, err_msg=f"{weight} cosine {cosine}")


@pytest.mark.parametrize("way", ["all", "specular"])
@pytest.mark.parametrize("name", ["lacquer on metal", "three", "turned"])
def test_samples_fit_their_density(shader, name, way):
    layers, count = STACKS[name], 60_000
    drawing, density_of = (
        (shader.direction, shader.density) if way == "all" else (shader.mirrored, shader.mirroredDensity)
    )
    u = np.random.default_rng(3).random((count, 3), np.float32)
    for cosine in (0.1, 0.6, 1.0):
        view = view_at(cosine)
        drawn = drawing(layers, view, u, _result="numpy")
        drawn = drawn[drawn[:, 3] > 0, :3].astype(np.float64)
        square = Around(view * np.float32([-1, -1, 1]), power=4)

        def density(points, square=square, view=view):
            light, measure = square.direction(points)
            return density_of(layers, view, light, _result="numpy") * measure

        assert_fits(square.position(drawn), count, density, tests=18, bins=(20, 24), order=16)


def test_no_specular_sample_is_lost(shader):
    layers = stack((1, 1, 0.6, 0.04), ((1, 0.3, 1.5, 1),))
    for cosine in (0.05, 0.4, 1.0):
        view = view_at(cosine)
        square = Around(view * np.float32([-1, -1, 1]), power=4)

        def density(points, square=square, view=view):
            light, measure = square.direction(points)
            return shader.mirroredDensity(layers, view, light, _result="numpy") * measure

        assert integrate(density, (48, 48), order=12).sum() == pytest.approx(1, abs=0.003)


@pytest.mark.parametrize("name", STACKS)
def test_weight_is_value_over_density(shader, name):
    u = np.random.default_rng(4).random((4000, 3), np.float32)
    view = hemisphere(4000, 5)
    for drawing, weighing, valuing, density_of in (
        (shader.direction, shader.weight, shader.value, shader.density),
        (shader.mirrored, shader.mirroredWeight, shader.specular, shader.mirroredDensity),
    ):
        drawn = drawing(STACKS[name], view, u, _result="numpy")
        weight = weighing(STACKS[name], view, u, _result="numpy")[:, :3]
        ok = (drawn[:, 3] > 0) & (drawn[:, 3] < 1e4)  # a mirror's own peak is too narrow to meet again
        light = np.ascontiguousarray(drawn[:, :3])
        np.testing.assert_allclose(density_of(STACKS[name], view, light, _result="numpy")[ok], drawn[ok, 3], rtol=0.02)
        value = valuing(STACKS[name], view, light, _result="numpy")
        np.testing.assert_allclose((weight * drawn[:, 3:])[ok], value[ok], rtol=0.02, atol=1e-6)


def test_a_coat_without_strength_changes_nothing(shader):
    view, light = hemisphere(1000, 6), hemisphere(1000, 7)
    base = (0.8, 0.3, 0.5, 0.04)
    bare = shader.value(stack(base, ()), view, light, _result="numpy")
    for strength, tolerance in ((0.0, 1e-6), (0.01, 0.02)):
        coated = shader.value(stack(base, ((strength, 0.6, 1.5, 1.0),)), view, light, _result="numpy")
        np.testing.assert_allclose(coated, bare, rtol=tolerance, atol=1e-3 * (strength > 0))


def test_absorption_follows_the_refracted_path(shader):
    """Beer and Lambert's law along the way of a ray that Snell's law bends, in and out."""
    clear, tinted = (stack((1.0, 1.0, 0.0, 0.0), (CLEAR,), (left, 1.0, 1.0)) for left in (1.0, 0.5))
    for cosine in (1.0, 0.6, 0.2):
        path = 1 / np.sqrt(1 - (1 - cosine**2) / 1.5**2)
        reflected = furnace(shader, tinted, cosine)
        surface = furnace(shader, stack((0.0, 0.0, 0.0, 0.0)), cosine)[0]  # nothing reflects below
        whole = furnace(shader, clear, cosine)[0]
        assert reflected[0] == pytest.approx(whole, abs=0.01)
        assert reflected[1] == pytest.approx(surface + (whole - surface) * 0.5 ** (2 * path), abs=0.01)


def test_reflectance_between_layers(shader):
    """Fresnel's equations, in double precision, at the angle to which light from the horizon is bent."""
    for above, below in ((1.0, 1.5), (1.5, 1.5), (1.5, 1.3), (1.3, 2.4), (1.5, 1.0)):
        facing, grazing = shader.between(above, below, _result="numpy").ravel().astype(float)
        assert facing == pytest.approx(((above - below) / (above + below)) ** 2, abs=1e-6)
        angle = np.arcsin(1 / above)
        bent = np.arcsin(1 / below)
        if above == below:
            expected = 0.0
        elif above == 1 or below == 1:
            expected = 1.0
        else:
            expected = 0.5 * (np.sin(angle - bent) / np.sin(angle + bent)) ** 2
            expected += 0.5 * (np.tan(angle - bent) / np.tan(angle + bent)) ** 2
        assert grazing == pytest.approx(expected, abs=1e-3), f"{above} {below}"


def test_always_finite(shader):
    edge = np.float32([[0, 0, 1], [1, 0, 0], [1, 0, 1e-7], [-1, 0, 1e-4], [0, 0.6, -0.8], [0.6, 0, 0.8], [0, 0, -1]])
    view, light = (a.reshape(-1, 3).copy() for a in np.broadcast_arrays(edge[:, None], edge[None]))
    corners = [0.0, 1e-4, 0.5, 0.999999]
    u = np.float32(list(itertools.product(corners, corners, corners)))
    for base, coat, clear, normal in itertools.product(
        ((1, 0, 1, 0), (0, 1, 0, 1)),
        ((1, 0, 1.0, 0), (1, 1, 3.0, 1), (0, 0, 1.5, 0)),
        (0.0, 1.0),
        ((0, 0, 1), (0.8, 0, 0.6)),
    ):
        layers = stack(base, (coat, coat), (clear, clear, clear), normal)
        for function in (shader.value, shader.specular, shader.density, shader.mirroredDensity):
            values = function(layers, view, light, _result="numpy")
            assert np.isfinite(values).all() and (values >= 0).all()
        for v in edge:
            for function in (shader.direction, shader.weight, shader.mirrored, shader.mirroredWeight):
                assert np.isfinite(function(layers, v, u, _result="numpy")).all()

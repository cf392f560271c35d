"""Thin films, anisotropy and sheen: against exact sums and textbooks, and brdf.slang with them: energy, sampling."""

import itertools

import numpy as np
import pytest
from scipy.stats import qmc

from tests.shaders import airy
from tests.shaders.brdf_calls import brdf_calls
from tests.shaders.chi_squared import assert_fits
from tests.shaders.test_brdf import Around, hemisphere, view_at
from tools import fit_sheen_energy

SOURCE = """
import shaders.brdf;
import shaders.base_layer;
import shaders.surface;
export static const bool LOBES_IN_USE = true;
export static const bool FILMS_IN_USE = true;
export static const bool ANISOTROPY_IN_USE = true;
export static const bool SHEEN_IN_USE = true;

struct Given
{
    float3 color;
    float4 base; // metallic, roughness, F0, F90
    float3 film; // strength, index of refraction, nanometres
    float2 grain; // strength, radians
    float4 fibres; // colour and roughness of the sheen
}

BrdfParameters surface(Given given)
{
    BrdfParameters p;
    p.baseColor = given.color;
    p.metallic = given.base.x;
    p.roughness = given.base.y;
    p.dielectricF0 = given.base.z;
    p.dielectricF90 = given.base.w;
    p.film.strength = given.film.x;
    p.film.ior = given.film.y;
    p.film.thickness = given.film.z;
    p.anisotropy.strength = given.grain.x;
    p.anisotropy.tangent = float3(cos(given.grain.y), sin(given.grain.y), .3);
    p.sheen = { given.fibres.xyz, given.fibres.w };
    return p;
}

float3 weight(Given given, float3 view, float3 u) { return BrdfTowards.create(surface(given), view).sample(u).weight; }
float3 albedo(Given given, float3 view)
{
    BrdfParameters p = surface(given);
    let a = environmentBrdf(p, view.z, p.anisotropy.along(view, float3(0, 0, 1)));
    return a.diffuse + a.specular;
}
float3 specularAlbedo(Given given, float3 view)
{
    BrdfParameters p = surface(given);
    return environmentBrdf(p, view.z, p.anisotropy.along(view, float3(0, 0, 1))).specular;
}
// What is left of a film and a tangent after the way through a payload or the G-buffer.
Surface carried(Given given, float3 normal, float3 tangent)
{
    Surface made = {};
    made.normal = normal;
    made.geometricNormal = normal;
    made.brdf = surface(given);
    made.brdf.coats = Coats.none();
    made.brdf.anisotropy.tangent = tangent;
    return unpackSurface(packSurface(made, 1));
}
float3 carriedTangent(Given given, float3 normal, float3 tangent)
{
    return carried(given, normal, tangent).brdf.anisotropy.tangent;
}
float4 carriedNumbers(Given given, float3 normal, float3 tangent)
{
    BrdfParameters p = carried(given, normal, tangent).brdf;
    return float4(p.film.strength, p.film.ior, p.film.thickness, p.anisotropy.strength);
}
float4 carriedSheen(Given given, float3 normal, float3 tangent)
{
    Sheen sheen = carried(given, normal, tangent).brdf.sheen;
    return float4(sheen.color, sheen.roughness);
}
// White: directional albedo, and value by the cosines of view, light and half way.
float sheenAlbedo(float roughness, float cosine) { return SheenLobe.create(roughness).albedo(cosine); }
float sheen(float roughness, float3 cosines)
{
    return SheenLobe.create(roughness).value(cosines.x, cosines.y, cosines.z, 0, 0);
}
// One bounce off the white mirror alone: density of its samples, and value times cosine.
float2 mirror(Given given, float3 view, float3 light)
{
    BaseLayer base = BaseLayer.create(surface(given));
    return float2(base.mirroredPdf(view, light), base.mirrored(view, light, normalize(view + light)));
}
// Of one microfacet.
float3 fresnel(Given given, float cosine)
{
    BrdfParameters p = surface(given);
    FilmReflectance film = FilmReflectance.create(p.film, p.dielectricF0, p.dielectricF90, p.baseColor, p.metallic, 1);
    FilmTerm term = film.at(cosine);
    float grazing = pow(1 - cosine, 5);
    float3 dielectric = lerp(film.dielectricF0, p.dielectricF90, grazing) + term.dielectric;
    float3 metal = lerp(film.metalF0, 1, grazing) + term.metal;
    return lerp(dielectric, metal, p.metallic);
}
""" + brdf_calls("Given")
COSINES = [0.05, 0.3, 0.7, 0.999]
ROUGHNESSES = [0.0, 0.3, 0.6, 1.0]
FILMS = [(1.3, 100.0), (1.3, 400.0), (1.33, 900.0), (1.8, 250.0), (2.2, 600.0)]
BUBBLE = (1.0, 1.4, 380.0)


@pytest.fixture(scope="module")
def shader(load):
    return load(SOURCE)


def given(
    color=(1.0, 1.0, 1.0),
    metallic=0.0,
    roughness=0.5,
    f0=0.04,
    f90=1.0,
    film=(0.0, 1.3, 400.0),
    grain=(0.0, 0.0),
    fibres=(0.0, 0.0, 0.0, 0.0),
):
    base = [float(metallic), float(roughness), float(f0), float(f90)]
    more = {"film": [*map(float, film)], "grain": [*map(float, grain)], "fibres": [*map(float, fibres)]}
    return {"_type": "Given", "color": [*map(float, color)], "base": base, **more}


SURFACES = {
    "film on matter": given((0.8, 0.5, 0.3), 0.0, 0.4, film=BUBBLE),
    "film on metal": given((0.9, 0.6, 0.3), 1.0, 0.3, film=BUBBLE),
    "film on both": given((0.9, 0.6, 0.3), 0.5, 0.7, film=(0.5, 1.8, 250.0)),
    "brushed metal": given((0.9, 0.6, 0.3), 1.0, 0.3, grain=(0.8, 0.4)),
    "film on brushed plastic": given((0.9, 0.6, 0.3), 0.3, 0.4, film=BUBBLE, grain=(0.6, 1.9)),
    "sheen on matter": given((0.5, 0.2, 0.1), 0.0, 0.8, fibres=(0.9, 0.7, 0.5, 0.4)),
    "sheen on all": given((0.9, 0.6, 0.3), 0.5, 0.4, film=BUBBLE, grain=(0.6, 1.9), fibres=(0.2, 0.5, 0.8, 0.7)),
}


def furnace(shader, surface, cosine, weight="weight"):
    """(3,) share of even light from everywhere that is reflected."""
    u = qmc.Sobol(3, seed=1).random(2**13).astype(np.float32)
    return getattr(shader, weight)(surface, view_at(cosine), u, _result="numpy").astype(np.float64).mean(0)


@pytest.mark.parametrize("film", FILMS)
def test_a_film_on_a_dielectric_reflects_what_airys_sum_says(shader, film):
    """Schlick's term from the reflectance facing the light, the cheaper way, is three times as far off or more."""
    cosines = np.linspace(0.05, 1, 39).astype(np.float32)
    for f0 in (0.04, 0.08):
        index = (1 + np.sqrt(f0)) / (1 - np.sqrt(f0))
        exact = airy.reflectance(cosines, film[0], index, film[1])
        got = shader.fresnel(given(f0=f0, film=(1.0, *film)), cosines, _result="numpy")
        np.testing.assert_allclose(got, exact, atol=0.02)
        schlick = got[-1] + (1 - got[-1]) * (1 - cosines[:, None]) ** 5
        errors = [np.sqrt(((way - exact) ** 2 * cosines[:, None]).mean()) for way in (got, schlick)]
        assert errors[0] < 0.0065 and errors[0] < errors[1] / 3, errors


# Red, green and blue: n + ik at 630, 532 and 465 nm (Rakić 1998; Johnson and Christy 1974, iron).
METALS = {"aluminium": [1.35 + 7.5j, 0.97 + 6.4j, 0.61 + 5.4j], "iron": [2.9 + 3.1j, 2.9 + 2.9j, 2.6 + 2.7j]}


@pytest.mark.parametrize(("metal", "most"), [("aluminium", 0.04), ("iron", 0.1)])
def test_a_film_on_a_metal_comes_as_near_as_a_base_colour_lets_it(shader, metal, most):
    """A metal shifts the phase of what it reflects by its complex index, of which glTF says nothing."""
    cosines, errors = np.linspace(0.1, 1, 37).astype(np.float32), []
    color = [abs((1 - index) / (1 + index)) ** 2 for index in METALS[metal]]
    for film in FILMS:
        exact = [airy.reflectance(cosines, film[0], index, film[1])[:, i] for i, index in enumerate(METALS[metal])]
        got = shader.fresnel(given(color, 1.0, film=(1.0, *film)), cosines, _result="numpy")
        errors.append(np.sqrt(((got - np.stack(exact, -1)) ** 2).mean()))
    assert np.mean(errors) < most, errors


def test_no_film_is_no_film(shader):
    """Over a dielectric there is Fresnel's term then, which differs a little from the Schlick's term of bare ones."""
    view, light = hemisphere(500, 1), hemisphere(500, 2)
    for metallic, tolerance in ((0.0, 0.04), (1.0, 0.002)):
        bare = shader.value(given((0.9, 0.5, 0.2), metallic), view, light, _result="numpy")
        for film in ((1.0, 1.3, 0.0), (1.0, 1.0001, 300.0), (0.001, 1.8, 300.0)):
            filmed = shader.value(given((0.9, 0.5, 0.2), metallic, film=film), view, light, _result="numpy")
            np.testing.assert_allclose(filmed, bare, atol=tolerance, rtol=0.01, err_msg=f"{film} {metallic}")


@pytest.mark.parametrize("roughness", ROUGHNESSES)
def test_white_furnace_under_a_film(shader, roughness):
    for film, cosine, f0 in itertools.product(FILMS, COSINES, (0.04, 0.1)):
        reflected = furnace(shader, given(roughness=roughness, f0=f0, film=(1.0, *film)), cosine)
        assert 0.97 < reflected.min() <= reflected.max() < 1.005, f"{film} cosine {cosine} f0 {f0}: {reflected}"
        mirrored = furnace(shader, given(metallic=1.0, roughness=roughness, film=(1.0, *film)), cosine)
        assert mirrored.max() < 1.005


@pytest.mark.parametrize("roughness", [0.1, 0.3, 0.6, 0.9])
def test_white_furnace_of_brushed_surfaces(shader, roughness):
    """Never more than comes in; the fits of what is lost lean the other way, most at grazing angles."""
    for strength, turn, cosine in itertools.product((0.2, 0.5, 0.8, 1.0), (0.0, 0.6, 0.927, 2.2), COSINES):
        for metallic in (0.0, 1.0):
            surface = given(metallic=metallic, roughness=roughness, grain=(strength, turn))
            reflected = furnace(shader, surface, cosine)
            what = f"strength {strength} turn {turn} cosine {cosine} metallic {metallic}: {reflected}"
            assert 0.9 < reflected.min() <= reflected.max() < 1.005, what


def test_one_bounce_is_textbook_anisotropic_ggx(shader):
    """Heitz 2014, equations 85, 86 and 99, in double precision, with the alphas of KHR_materials_anisotropy."""
    view, light = hemisphere(2000, 6).astype(np.float64), hemisphere(2000, 7).astype(np.float64)
    roughness, strength, turn = 0.3, 0.7, 0.8
    across = roughness**2
    widths = np.array([across + (1 - across) * strength**2, across])
    axes = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    h = view + light
    h /= np.linalg.norm(h, axis=1, keepdims=True)
    slopes = h[:, :2] @ axes.T / h[:, 2:]
    d = 1 / (np.pi * widths.prod() * h[:, 2] ** 4 * (1 + ((slopes / widths) ** 2).sum(1)) ** 2)
    smith = [0.5 * (np.sqrt(1 + ((v[:, :2] @ axes.T / v[:, 2:] * widths) ** 2).sum(1)) - 1) for v in (view, light)]
    expected = (d / (1 + smith[0] + smith[1]) / (4 * view[:, 2]))[:, None]
    surface = given((1, 1, 1), 1.0, roughness, grain=(strength, turn))
    got = shader.specular(surface, view.astype(np.float32), light.astype(np.float32), _result="numpy")
    # what several bounces add is positive and small
    assert (got - expected > -1e-4 * (1 + expected)).all() and (got - expected).max() < 0.2
    turned = given((1, 1, 1), 1.0, roughness, grain=(strength, turn + np.pi))
    again = shader.specular(turned, view.astype(np.float32), light.astype(np.float32), _result="numpy")
    np.testing.assert_allclose(again, got, rtol=1e-3, atol=1e-5)


def test_what_travels_is_enough(shader):
    """Normals on all sides: the frame in which the tangent's angle is packed jumps where z is 0."""
    normals = np.random.default_rng(1).normal(size=(400, 3))
    normals[:40, 2] = 0
    normals[40:80] = [1, 0, 1e-7]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    tangents = np.cross(normals, np.random.default_rng(2).normal(size=(400, 3)))
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    normals, tangents = normals.astype(np.float32), tangents.astype(np.float32)
    surface = given(film=(0.6, 1.7, 523.0), grain=(0.35, 0.0))
    got = shader.carriedTangent(surface, normals, tangents, _result="numpy")
    assert np.abs((got * tangents).sum(1)).min() > 1 - 1e-6
    felt = shader.carriedSheen(given(fibres=(0.9, 0.03, 0.2, 0.35)), normals, tangents, _result="numpy")
    np.testing.assert_allclose(felt, np.tile([0.9, 0.03, 0.2, 0.35], (400, 1)), atol=0.004)
    numbers = shader.carriedNumbers(surface, normals, tangents, _result="numpy")
    np.testing.assert_allclose(numbers, np.tile([0.6, 1.7, 523.0, 0.35], (400, 1)), rtol=0.006)
    assert (shader.carriedNumbers(given(), normals, tangents, _result="numpy")[:, [0, 3]] == 0).all()


@pytest.mark.parametrize("roughness", [0.07, 0.15, 0.3, 0.5, 0.75, 1.0])
def test_a_sheen_is_charlies(shader, roughness):
    """Estevez and Kulla 2017, equations 2 and 3 in double precision; the albedo is a fit of their integral."""
    view, light = (hemisphere(3000, seed).astype(np.float64) for seed in (6, 7))
    half = (view + light)[:, 2] / np.linalg.norm(view + light, axis=1)
    alpha = roughness**2
    density = (2 + 1 / alpha) * (1 - half**2) ** (0.5 / alpha) / (2 * np.pi)
    masked = 1 + fit_sheen_energy.shadowing(view[:, 2], alpha) + fit_sheen_energy.shadowing(light[:, 2], alpha)
    cosines = np.stack([view[:, 2], light[:, 2], half], 1).astype(np.float32)
    got = shader.sheen(roughness, cosines, _result="numpy")
    np.testing.assert_allclose(got, density / (4 * view[:, 2] * light[:, 2] * masked), rtol=5e-3, atol=1e-5)
    mus = np.linspace(0.01, 1, 15)
    fitted = shader.sheenAlbedo(roughness, mus.astype(np.float32), _result="numpy")
    exact = np.array([fit_sheen_energy.albedo(mu, roughness, 96) for mu in mus])
    assert np.abs((fitted - exact) / np.maximum(exact, 1)).max() < 0.017


def test_masking_is_continuous_and_published():
    """At both ends of roughness, with Estevez and Kulla's own constants."""
    cosines = np.array([0.1, 0.499999, 0.500001, 0.9])
    found = fit_sheen_energy.shadowing(cosines, 1.0)
    assert found[1] == pytest.approx(found[2], rel=1e-4)

    def exponent(x):
        return 21.5473 / (1 + 3.82987 * x**0.19823) - 1.97760 * x - 4.32054

    assert found[0] == pytest.approx(np.exp(exponent(0.1))) and found[3] == pytest.approx(
        np.exp(2 * exponent(0.5) - exponent(0.1))
    )


@pytest.mark.parametrize("roughness", [0.0, 0.15, 0.4, 0.7, 1.0])
def test_white_furnace_under_a_sheen(shader, roughness):
    """What lies below is dimmed by the darker of two ways, so white loses some; over black all is the sheen's."""
    for cosine, metallic, base in itertools.product(COSINES, (0.0, 1.0), (0.1, 0.7)):
        surface = given(metallic=metallic, roughness=base, fibres=(1.0, 1.0, 1.0, roughness))
        reflected = furnace(shader, surface, cosine)
        assert 0.85 < reflected.min() <= reflected.max() < 1.005, (
            f"cosine {cosine} metallic {metallic} base {base}: {reflected}"
        )
    for cosine in COSINES:
        black = given((0.0, 0.0, 0.0), 0.0, 0.5, 0.0, 0.0, fibres=(0.8, 0.4, 0.0, roughness))
        albedo = fit_sheen_energy.albedo(cosine, max(roughness, 0.07), 96)
        # held to 1 by the larger albedo of both directions, so it may be less where that is above 1
        expected = np.float64([0.8, 0.4, 0.0]) * min(albedo, 1)
        tolerance = 0.01 if roughness >= 0.4 else 0.15
        np.testing.assert_allclose(furnace(shader, black, cosine), expected, atol=tolerance, err_msg=f"cosine {cosine}")


@pytest.mark.parametrize("name", SURFACES)
def test_reciprocal(shader, name):
    view, light = hemisphere(5000, 1), hemisphere(5000, 2)
    there = shader.value(SURFACES[name], view, light, _result="numpy") / light[:, 2:]
    back = shader.value(SURFACES[name], light, view, _result="numpy") / view[:, 2:]
    np.testing.assert_allclose(there, back, rtol=2e-3, atol=1e-6)


@pytest.mark.parametrize("name", SURFACES)
def test_albedos_fit_what_is_sampled(shader, name):
    for cosine in COSINES:
        for closed, weight in ((shader.albedo, "weight"), (shader.specularAlbedo, "mirroredWeight")):
            sampled = furnace(shader, SURFACES[name], cosine, weight)
            got = closed(SURFACES[name], view_at(cosine).reshape(1, 3).copy(), _result="numpy")[0]
            tolerance = 0.03 if "brushed" in name or "sheen" in name else 0.015
            np.testing.assert_allclose(got, sampled, atol=tolerance, err_msg=f"{weight} cosine {cosine}")


@pytest.mark.parametrize("way", ["all", "specular"])
@pytest.mark.parametrize("name", ["film on both", "brushed metal", "sheen on matter"])
def test_samples_fit_their_density(shader, name, way):
    count = 60_000
    drawing, density_of = (
        (shader.direction, shader.density) if way == "all" else (shader.mirrored, shader.mirroredDensity)
    )
    u = np.random.default_rng(3).random((count, 3), np.float32)
    for cosine in (0.1, 0.6, 1.0):
        view = view_at(cosine)
        drawn = drawing(SURFACES[name], view, u, _result="numpy")
        drawn = drawn[drawn[:, 3] > 0, :3].astype(np.float64)
        square = Around(view * np.float32([-1, -1, 1]), power=3)

        def density(points, square=square, view=view):
            light, measure = square.direction(points)
            return density_of(SURFACES[name], view, light, _result="numpy") * measure

        assert_fits(square.position(drawn), count, density, tests=6, bins=(20, 24), order=14)


@pytest.mark.parametrize("name", SURFACES)
def test_weight_is_value_over_density(shader, name):
    u = np.random.default_rng(4).random((4000, 3), np.float32)
    view = hemisphere(4000, 5)
    for drawing, weighing, valuing in (
        (shader.direction, shader.weight, shader.value),
        (shader.mirrored, shader.mirroredWeight, shader.specular),
    ):
        drawn = drawing(SURFACES[name], view, u, _result="numpy")
        weight = weighing(SURFACES[name], view, u, _result="numpy")
        ok = drawn[:, 3] > 0
        value = valuing(SURFACES[name], view, np.ascontiguousarray(drawn[:, :3]), _result="numpy")
        np.testing.assert_allclose((weight * drawn[:, 3:])[ok], value[ok], rtol=0.02, atol=1e-6)


@pytest.mark.gpu_differs("a value rounds to slightly below 0 on an H200")
def test_always_finite(shader):
    edge = np.float32([[0, 0, 1], [1, 0, 0], [1, 0, 1e-7], [-1, 0, 1e-4], [0, 0.6, -0.8], [0.6, 0, 0.8], [0, 0, -1]])
    view, light = (a.reshape(-1, 3).copy() for a in np.broadcast_arrays(edge[:, None], edge[None]))
    corners = [0.0, 1e-4, 0.5, 0.999999]
    u = np.float32(list(itertools.product(corners, corners, corners)))
    for color, metallic, (f0, f90), film in itertools.product(
        (0.0, 1.0), (0.0, 1.0), ((0.0, 0.0), (1.0, 1.0)), ((1.0, 1.0, 0.0), (1.0, 1.0, 1e5), (1.0, 8.0, 0.02))
    ):
        surface = given([color] * 3, metallic, 0.0, f0, f90, film, (color, 1.0), (1.0, 1.0, 1.0, color))
        for function in (shader.value, shader.specular, shader.density, shader.mirroredDensity):
            values = function(surface, view, light, _result="numpy")
            assert np.isfinite(values).all() and (values >= 0).all()
        for v in edge:
            for function in (shader.direction, shader.weight, shader.mirrored, shader.mirroredWeight):
                assert np.isfinite(function(surface, v, u, _result="numpy")).all()

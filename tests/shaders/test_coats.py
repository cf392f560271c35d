"""coats.slang and what brdf.slang makes of it: energy, reciprocity and sampling of a whole stack."""

import itertools

import numpy as np
import pytest
from scipy.stats import qmc

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
    let s = sampleBrdf(surface(layers), view, u);
    return float4(s.weight, s.pdf);
}
float4 direction(Layers layers, float3 view, float3 u)
{
    let s = sampleBrdf(surface(layers), view, u);
    return float4(s.direction, s.pdf);
}
float4 mirrored(Layers layers, float3 view, float3 u)
{
    let s = BrdfTowards.create(surface(layers), view).sampleSpecular(u);
    return float4(s.direction, s.pdf);
}
float3 mirroredWeight(Layers layers, float3 view, float3 u)
{
    return BrdfTowards.create(surface(layers), view).sampleSpecular(u).weight;
}
float density(Layers layers, float3 view, float3 light) { return pdfBrdf(surface(layers), view, light); }
float mirroredDensity(Layers layers, float3 view, float3 light)
{
    return BrdfTowards.create(surface(layers), view).pdfSpecular(light);
}
float3 value(Layers layers, float3 view, float3 light) { return evaluateBrdf(surface(layers), view, light).total; }
float3 specular(Layers layers, float3 view, float3 light) { return evaluateBrdf(surface(layers), view, light).specular; }
float3 albedo(Layers layers, float viewCosine)
{
    let a = environmentBrdf(surface(layers), viewCosine);
    return a.diffuse + a.specular;
}
float3 specularAlbedo(Layers layers, float viewCosine) { return environmentBrdf(surface(layers), viewCosine).specular; }
float2 between(float above, float below) { return float2(reflectanceBetween(above, below), grazingReflectanceBetween(above, below)); }
"""
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
def test_white_furnace(shader, roughness):
    """Never more than goes in; white matter loses nothing under one coat, a metal what docs/materials.md tells."""
    for coat, cosine, ior in itertools.product(ROUGHNESSES, COSINES, (1.3, 1.5, 2.0)):
        layer = (1.0, coat, ior, 1.0)
        what = f"coat {coat} cosine {cosine} ior {ior}"
        matter = furnace(shader, stack((1.0, 0.0, roughness, 0.0), (layer,)), cosine)
        np.testing.assert_allclose(matter, 1, atol=0.012, err_msg=what)
        for metallic in (0.0, 1.0):
            reflected = furnace(shader, stack((1.0, metallic, roughness, 0.04), (layer,)), cosine)
            assert 0.87 < reflected.min() <= reflected.max() < 1.005, f"{what} {metallic} {reflected}"

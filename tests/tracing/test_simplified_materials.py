"""Simplified materials: what surface rays see of a material where an effect asks for its simplified twin."""

import numpy as np
import pytest
import slangpy as spy

import pica
from pica.scene import material_registry as material_types
from pica.scene.material import Image, Material, Sampler, Texture
from pica.scenes.basic_meshes import plane
from pica.tracing import embree
from pica.tracing.ray_effect import ray_effect
from pica.tracing.tracers import PipelineTracer
from tests.building import bumps, leaves, placed, scene_of
from tests.rays import FRONT, gpu_scene

PROBE = """
import tracing.ray_effect;
import shaders.surface;
RWTexture2D<float4> colors;  // base colour, roughness
RWTexture2D<float4> normals; // and distance
RWTexture2D<float4> emissions;
uint2 size;
uint type;

// One ray down onto each point of a square of one metre.
struct Probe : IRayEffect
{
    struct State { float4 color; float4 normal; float4 emission; };
    static bool start(uint2 pixel, out Ray ray, out State state)
    {
        state = {};
        float2 place = (float2(pixel) + .5) / float2(size) - .5;
        ray = Ray.create(RayType(type), float3(place.x, 1, place.y), float3(0, -1, 0), 10, 0);
        return true;
    }
    static bool advance(uint2 pixel, Hit hit, Surface surface, inout Ray ray, inout State state)
    {
        if (!hit.isMiss())
        {
            state.color = float4(surface.brdf.baseColor, surface.brdf.roughness);
            state.emission = float4(surface.emission, surface.brdf.metallic);
        }
        state.normal = hit.isMiss() ? float4(0, 0, 0, -1) : float4(surface.normal, hit.distance);
        return false;
    }
    static void finish(uint2 pixel, State state)
    {
        colors[pixel] = state.color;
        normals[pixel] = state.normal;
        emissions[pixel] = state.emission;
    }
}
"""
CAMERA, SURFACE = 0, 1
COUNT = 64
OWN = """
import materials.material_type;
struct Own : IMaterialType
{
    static void evaluate(MaterialInput input, inout Surface surface)
    {
        surface.normal = input.mappedNormal(surface, input.read(input.material.normalTexture, .5).xyz * 2 - 1);
        surface.brdf.baseColor = input.read(input.material.baseColorTexture, 1).rgb;
        surface.brdf.roughness = input.simplified ? .25 : .75;
    }
}
"""


@pytest.fixture(params=["pipeline", "buffers", "embree"])
def probe(request, device):
    """Colours and roughness, normals and distance, emission and metallic, (64, 64, 4) each."""
    if request.param == "embree" and embree.missing():
        pytest.skip("Embree is not installed")
    device.handle.load_module_from_source("probe", PROBE)

    def look(material: Material, simplified: bool, kind: int = SURFACE):
        scene = gpu_scene(device, scene_of(placed(plane(1, 1, material))))
        tracer = None
        if request.param == "buffers":
            tracer = PipelineTracer(device, scene)
        if request.param == "embree":
            from pica.tracing.embree_tracer import EmbreeTracer

            tracer = EmbreeTracer(device, scene.rt_scene)
        effect = ray_effect(device, "probe", "Probe", "surface", tracer, simplified)
        names = ("colors", "normals", "emissions")
        targets = {name: device.texture(name, spy.Format.rgba32_float, (COUNT, COUNT)) for name in names}
        with device.record() as recording:
            scene.update(recording, FRONT)
            effect(recording, (COUNT, COUNT), scene=scene, size=spy.uint2(COUNT, COUNT), type=kind, **targets)
        device.handle.wait_for_idle()
        return [targets[name].to_numpy() for name in names]

    return look


def noise(size: int, name: str) -> Texture:
    """Random texels, by the name: of a coarse level each is the mean of many."""
    pixels = np.random.default_rng(list(name.encode())).integers(0, 256, (size, size, 4)).astype(np.uint8)
    pixels[..., 3] = 255
    return Texture(Image(pixels, name), Sampler(linear=False))


def test_textures_are_coarse_and_normal_maps_are_left_out(probe):
    material = Material(
        base_color_texture=noise(512, "color"),
        metallic_roughness_texture=noise(512, "roughness"),
        emissive_texture=noise(512, "glow"),
        emission=(2, 2, 2),
        normal_texture=bumps(),
    )
    fine, coarse = probe(material, False), probe(material, True)
    for channel in (0, 2):  # colour and roughness; emission and metallic
        assert fine[channel].std((0, 1)).min() > 0.2
        # 16 by 16 texels are one of the coarse ones: their deviation is a sixteenth, their mean is kept
        assert coarse[channel].std((0, 1)).max() < 0.1 * fine[channel].std((0, 1)).max()
        np.testing.assert_allclose(coarse[channel].mean((0, 1)), fine[channel].mean((0, 1)), rtol=0.05)
    assert fine[1][..., 1].min() < 0.95
    np.testing.assert_allclose(coarse[1][..., :3].reshape(-1, 3), np.tile([0, 1, 0], (COUNT**2, 1)), atol=1e-4)


def test_small_textures_stay_as_they_are(probe):
    material = Material(base_color_texture=noise(32, "color"))
    np.testing.assert_array_equal(probe(material, False)[0], probe(material, True)[0])


def test_what_the_camera_sees_is_not_simplified(probe):
    material = Material(base_color_texture=noise(512, "color"), normal_texture=bumps())
    for plain, simplified in zip(probe(material, False, CAMERA), probe(material, True, CAMERA), strict=True):
        np.testing.assert_array_equal(plain, simplified)


def test_holes_stay(probe):
    """Coverage is that of the full material: reflections have the outlines of what they reflect."""
    met = [probe(leaves(), simplified)[1][..., 3] >= 0 for simplified in (False, True)]
    np.testing.assert_array_equal(*met)
    assert 0.3 < met[0].mean() < 0.7


def test_a_type_of_ones_own_reads_coarsely_and_may_ask(probe, monkeypatch, tmp_path):
    monkeypatch.setattr(material_types, "_registered", {})
    (tmp_path / "own.slang").write_text(OWN)
    pica.register_material("own", tmp_path / "own.slang")
    material = Material(type="own", base_color_texture=noise(512, "color"), normal_texture=bumps())
    fine, coarse = probe(material, False), probe(material, True)
    assert coarse[0][..., :3].std() < 0.2 * fine[0][..., :3].std()
    assert fine[1][..., 1].min() < 0.95 and coarse[1][..., 1].min() > 0.9999
    np.testing.assert_allclose([fine[0][..., 3].mean(), coarse[0][..., 3].mean()], [0.75, 0.25], atol=1e-4)

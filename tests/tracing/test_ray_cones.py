"""Ray cones: what rays meet shows its textures at the level of detail that their width asks for."""

import itertools

import numpy as np
import pytest
import slangpy as spy

from pica.effects.gbuffer.gbuffer import GBufferEffect
from pica.frame.context import FrameSequence
from pica.graph.graph import FrameGraph
from pica.graph.memory import Memory
from pica.graph.plan import Plan
from pica.graph.resources import write
from pica.rhi.device import Device
from pica.scene.camera import Camera
from pica.scene.material import Image, Material, Sampler, Texture
from pica.scene.model import Mesh, Node
from pica.scene.primitives import spheres
from pica.scenes.basic_meshes import plane, sphere
from pica.scenes.placing import move, rotate
from pica.tracing import embree
from pica.tracing.ray_effect import ray_effect
from pica.tracing.tracers import PipelineTracer
from tests.building import CAMERA, lambert, placed, scene_of
from tests.rays import gpu_scene

DOWN = """
import tracing.ray_effect;
RWTexture2D<float4> colors;
float width;
float spread;

// Rays down onto 64 places, from a metre above.
struct Down : IRayEffect
{
    struct State { float4 color; };
    static bool start(uint2 pixel, out Ray ray, out State state)
    {
        state = {};
        float2 place = (float2(pixel) + .5) / 16 - .5 + (float2(pixel) * float2(3, 5) + .5) / 256;
        ray = Ray.create(RayType.surface, float3(place.x, 1, place.y), float3(0, -1, 0), 10, 0);
        ray.cone = { width, spread };
        return true;
    }
    static bool advance(uint2 pixel, Hit hit, Surface surface, inout Ray ray, inout State state)
    {
        state.color = float4(surface.brdf.baseColor, hit.distance);
        return false;
    }
    static void finish(uint2 pixel, State state) { colors[pixel] = state.color; }
}
"""
MIRROR = """
import tracing.ray_effect;
import frame.constants;
import frame.gbuffer;
import frame.pixel_cone;
RWTexture2D<float4> colors;
uint cones;

// What a perfect mirror would show in each pixel.
struct Mirror : IRayEffect
{
    struct State { float4 color; };
    static bool start(uint2 pixel, out Ray ray, out State state)
    {
        ray = {};
        state = {};
        Surface surface;
        if (!gbuffer.load(pixel, surface))
            return false;
        float3 view = frame.camera.toViewer(surface.position);
        ray = Ray.leaving(RayType.surface, surface, 1, reflect(-view, surface.normal), 1e4, 0);
        if (cones != 0)
            ray.cone = reflectedCone(pixel, surface);
        return true;
    }
    static bool advance(uint2 pixel, Hit hit, Surface surface, inout Ray ray, inout State state)
    {
        state.color = hit.isMiss() ? 0 : float4(surface.brdf.baseColor, 1);
        return false;
    }
    static void finish(uint2 pixel, State state) { colors[pixel] = state.color; }
}
"""
SIZE = (48, 32)


def checkerboard(texels: int = 256, **more) -> Material:
    """Squares of one texel, black and white."""
    pixels = np.zeros((texels, texels, 4), np.uint8)
    pixels[..., :3] = 255 * (np.indices((texels, texels)).sum(0) % 2)[..., None]
    pixels[..., 3] = 255
    texture = Texture(Image(pixels, "checkerboard"), Sampler(linear=False))
    return Material(base_color_texture=texture, metallic=0.0, roughness=1.0, **more)


@pytest.fixture(params=["pipeline", "buffers", "embree"])
def tracer_of(request, device):
    if request.param == "embree" and embree.missing():
        pytest.skip("Embree is not installed")

    def make(scene):
        if request.param == "buffers":
            return PipelineTracer(device, scene)
        if request.param == "embree":
            from pica.tracing.embree_tracer import EmbreeTracer

            return EmbreeTracer(device, scene.rt_scene)
        return None

    return make


def shown(device: Device, scene, tracer, width: float, spread: float) -> np.ndarray:
    """(8, 8) what the rays meet, 0 to 1."""
    device.handle.load_module_from_source("down", DOWN)
    effect = ray_effect(device, "down", "Down", "surface", tracer)
    colors = device.texture("colors", spy.Format.rgba32_float, (8, 8))
    with device.record() as recording:
        scene.update(recording, CAMERA)
        effect(recording, (8, 8), scene=scene, colors=colors, width=width, spread=spread)
    device.handle.wait_for_idle()
    seen = colors.to_numpy()
    assert (seen[..., 3] > 0).all()
    return seen[..., 0]


def test_wide_rays_see_the_average_and_narrow_ones_each_texel(device, tracer_of):
    scene = gpu_scene(device, scene_of(placed(plane(1, 1, checkerboard()))))
    tracer = tracer_of(scene)
    for width, spread in ((0.0, 0.0), (0.002, 0.0), (0.0, 0.002), (0.4, -0.4)):
        assert set(shown(device, scene, tracer, width, spread).ravel()) == {0.0, 1.0}, (width, spread)
    for width, spread in ((0.1, 0.0), (0.0, 0.1), (0.04, 0.06)):
        np.testing.assert_allclose(shown(device, scene, tracer, width, spread), 0.5, atol=0.01)


def test_the_level_is_that_of_the_cone(device, tracer_of):
    """Each level has a quarter of the texels, each the mean of four: half of the deviation, where they are random."""
    pixels = np.full((256, 256, 4), 255, np.uint8)
    pixels[..., :3] = np.random.default_rng(0).integers(0, 256, (256, 256, 1))
    noise = Material(base_color_texture=Texture(Image(pixels, "noise"), Sampler(linear=False)))
    scene = gpu_scene(device, scene_of(placed(plane(1, 1, noise))))
    tracer = tracer_of(scene)
    deviations = [shown(device, scene, tracer, 2.0**level / 256, 0.0).std() for level in range(5)]
    for finer, coarser in itertools.pairwise(deviations):
        assert 0.3 < coarser / finer < 0.75, deviations


def test_shapes_read_textures_at_the_level_too(device):
    ball = spheres([(0, -0.3, 0)], 0.8, checkerboard())
    scene = gpu_scene(device, scene_of(Node("ball", mesh=Mesh(primitives=[ball]))))
    assert shown(device, scene, None, 0.0, 0.0).std() > 0.4
    np.testing.assert_allclose(shown(device, scene, None, 0.3, 0.0), 0.5, atol=0.05)


def reflections(device: Device, camera: Camera, frames: int, cones: bool, *nodes) -> np.ndarray:
    """(frames, height, width) what a mirror shows of a checkerboard behind the camera, in jittered frames."""
    device.handle.load_module_from_source("mirror", MIRROR)
    scene = gpu_scene(device, scene_of(*nodes))
    sequence = FrameSequence(device, SIZE, 0)
    graph = FrameGraph(Memory(device), SIZE, SIZE, sequence.block, sequence.half_block)
    gbuffer = GBufferEffect(device, "raster")(graph, scene)
    colors = graph.texture("colors", spy.Format.rgba32_float)
    effect = ray_effect(device, "mirror", "Mirror", "surface")
    inputs = {"scene": scene, "frame": graph.frame, "gbuffer": gbuffer, "cones": int(cones)}
    graph.add(effect, SIZE, colors=write(colors), **inputs)
    graph.offer("colors", (colors,), lambda values: values[..., 0])
    plan, pictures = Plan(graph), []
    for _ in range(frames):
        frame = sequence.begin(camera)
        scene.update(frame, frame.camera)
        frame.requested = frozenset({"colors"})
        found = plan.replay(frame)
        sequence.end(frame)
        pictures.append(found["colors"]())
    return np.array(pictures)


@pytest.mark.parametrize("curved", [False, True], ids=["flat", "ball"])
def test_a_mirror_shows_a_far_checkerboard_as_its_average(device, curved):
    """One sample a pixel with cones is nearer to the mean of many without than one without is, and does not flicker."""
    wall = placed(plane(40, 40, checkerboard(double_sided=True)), move(0, 0, 12) @ rotate("x", 90))
    mirror = placed(sphere(1, lambert(), 64)) if curved else placed(plane(9, 9, lambert()), rotate("x", 90))
    camera = Camera.look_at((0.3, 0.2, 2.5), (0, 0, 0), vertical_fov=np.radians(50))
    plain = reflections(device, camera, 48, False, wall, mirror)
    coned = reflections(device, camera, 4, True, wall, mirror)
    seen = plain.mean(0) > 0.1
    assert seen.mean() > 0.1
    mean = plain.mean(0)[seen]
    error = [np.sqrt(np.mean((pictures[3][seen] - mean) ** 2)) for pictures in (plain, coned)]
    assert error[1] < 0.35 * error[0], error
    assert coned[:, seen].std(0).mean() < 0.3 * plain[:4][:, seen].std(0).mean()
    assert coned[3][seen].mean() == pytest.approx(mean.mean(), rel=0.03)


def test_rough_surfaces_reflect_with_wider_cones(device):
    """By a sixteenth of the lobe's deviation, which grows with GGX's alpha; a mirror leaves the cone as it is."""
    from tests.tracing.kernels import read, run

    source = """
    import shaders.ray_cone;
    RWStructuredBuffer<float2> cones;
    [shader("compute")] [numthreads(8, 1, 1)]
    void main(uint3 thread : SV_DispatchThreadID)
    {
        RayCone seen = { .01, .002 };
        float roughness[8] = { 0, .1, .3, .5, .8, 1, 0, 0 };
        float turn[8] = { 0, 0, 0, 0, 0, 0, .1, -.1 };
        RayCone cone = unpackCone(packCone(seen.reflected(5, roughness[thread.x], turn[thread.x])));
        cones[thread.x] = float2(cone.at(0), cone.spread);
    }
    """
    cones = device.structured("cones", np.zeros((8, 2), np.float32))
    run(device, source, 8, cones=cones)
    width, spread = read(cones, np.float32).reshape(8, 2).T
    np.testing.assert_allclose(width, 0.02, rtol=1 / 128)
    alpha = np.array([0, 0.1, 0.3, 0.5]) ** 2
    np.testing.assert_allclose(spread[:4], 0.002 + np.sqrt(alpha**2 / (2 - 2 * alpha**2)) / 16, rtol=1 / 128)
    rough = 0.002 + 0.5 / 16
    np.testing.assert_allclose(spread[5:], [rough, 0.202, -0.198], rtol=1 / 128)

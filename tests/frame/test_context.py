"""Frames: their jitter, their camera constants, what outlives them."""

import math

import numpy as np
import pytest
import slangpy as spy

from pica.errors import PicaError
from pica.frame.context import FrameSequence, camera_constants, radical_inverse, same_view
from pica.graph.snapshot import Snapshot
from pica.rendering.arguments import checked_size
from pica.scene.camera import Camera
from tests.building import orthographic
from tests.tracing.kernels import read, run

SIZE = (64, 48)
PROJECT = """
import frame.constants;
StructuredBuffer<float3> points;
RWStructuredBuffer<float3> seen;
RWStructuredBuffer<float3> back;
RWStructuredBuffer<float> depths;
[shader("compute")] [numthreads(64, 1, 1)]
void main(uint3 thread : SV_DispatchThreadID)
{
    float3 pixel = frame.camera.project(points[thread.x], frame.size);
    seen[thread.x] = pixel;
    float depth = frame.camera.depthFromDistance(pixel.z);
    depths[thread.x] = depth;
    back[thread.x] = frame.camera.unproject(pixel.xy, frame.size, frame.camera.distanceFromDepth(depth));
}
"""


def test_jitter_starts_in_the_centre_and_fills_the_pixel_evenly():
    assert radical_inverse(2, 0) == radical_inverse(3, 0) == 0
    for base, count in ((2, 64), (3, 81)):
        values = np.sort([radical_inverse(base, index) for index in range(count)])
        assert values.min() >= -0.5 and values.max() < 0.5
        np.testing.assert_allclose(np.diff(values), 1 / count)
        assert abs(values.mean()) < 1 / count


@pytest.mark.parametrize(
    "camera",
    [
        Camera.look_at((1, 2, 3), (0, 0.5, -1), vertical_fov=math.radians(50)),
        orthographic((1, 2, 3), (0, 0.5, -1), 4.0),
    ],
    ids=["perspective", "orthographic"],
)
def test_shaders_project_as_numpy_does(device, camera):
    from tests.building import projected

    random = np.random.default_rng(0)
    local = np.stack([*random.uniform(-1, 1, (2, 64)), -random.uniform(0.5, 9, 64)], -1)
    points = (local @ camera.transform[:3, :3].T + camera.transform[:3, 3]).astype(np.float32)
    block = device.parameter_block("frame/constants.slang", "frame")
    constants = camera_constants(camera, SIZE)
    cameras, still = {"camera": constants, "previousCamera": constants}, spy.float2(0)
    sizes = {"size": spy.uint2(*SIZE), "outputSize": spy.uint2(*SIZE)}
    block.bind(
        **cameras, **sizes, jitter=still, previousJitter=still, index=0, seed=0, textureScale=1, restingTextureScale=1
    )
    seen, back = (device.structured(name, np.zeros((64, 3), np.float32)) for name in ("seen", "back"))
    depths = device.structured("depths", np.zeros(64, np.float32))
    run(
        device,
        PROJECT,
        64,
        points=device.structured("points", points),
        seen=seen,
        back=back,
        depths=depths,
        frame=block,
    )
    pixels = read(seen, np.float32).reshape(-1, 3)
    np.testing.assert_allclose(pixels[:, :2], projected(camera, points, SIZE), atol=1e-3)
    np.testing.assert_allclose(pixels[:, 2], -local[:, 2], rtol=1e-5)
    np.testing.assert_allclose(read(back, np.float32).reshape(-1, 3), points, atol=2e-4)
    found = read(depths, np.float32)
    assert (found > 0).all() and (np.argsort(found) == np.argsort(local[:, 2])).all(), "nearer is greater"


def test_frames_count_from_zero_and_know_a_moved_camera(device):
    sequence = FrameSequence(device, SIZE, seed=0)
    camera, other = Camera.look_at((0, 0, 1), (0, 0, 0)), Camera.look_at((0, 0.1, 1), (0, 0, 0))
    told = []
    for view in (camera, camera, other, other):
        frame = sequence.begin(view)
        told.append((frame.index, frame.changed))
        sequence.end(frame)
    assert told == [(0, True), (1, False), (2, True), (3, False)]
    assert 0 < sequence.host_seconds < 1
    sequence.reset()
    frame = sequence.begin(other)
    assert (frame.index, frame.changed) == (0, True)
    sequence.end(frame)


def test_same_view():
    from dataclasses import replace

    camera = Camera.look_at((0, 0, 1), (0, 0, 0))
    assert same_view(camera, Camera.look_at((0, 0, 1), (0, 0, 0), name="another name"))
    for change in ({"vertical_fov": 1.0}, {"near": 0.5}, {"far": 5.0}, {"orthographic_height": 2.0}):
        assert not same_view(camera, replace(camera, **change))
    assert not same_view(camera, Camera.look_at((0, 1e-9, 1), (0, 0, 0)))


def test_pixel_size_and_edges():
    camera = Camera.look_at((0, 0, 0), (0, 0, -1), vertical_fov=math.radians(90))
    constants = camera_constants(camera, (200, 100))
    assert constants["pixelSize"] == pytest.approx(0.02)
    assert constants["right"].x == pytest.approx(2.0) and constants["up"].y == pytest.approx(1.0)
    assert constants["orthographic"] == 0
    flat = camera_constants(orthographic((0, 0, 0), (0, 0, -1), 3.0), (200, 100))
    assert flat["up"].y == pytest.approx(1.5) and flat["pixelSize"] == pytest.approx(0.03) and flat["orthographic"]
    assert math.isclose(flat["forward"].z, -1)


@pytest.mark.parametrize("layers", [None, 1, 3])
@pytest.mark.parametrize(
    ("texture_format", "dtype"),
    [
        (spy.Format.rgba32_float, np.float32),
        (spy.Format.rg16_float, np.float16),
        (spy.Format.r32_uint, np.uint32),
        (spy.Format.rgba8_unorm, np.uint8),
    ],
)
def test_snapshots_do_not_change_with_their_source(device, texture_format, dtype, layers):
    texture = device.texture("source", texture_format, (7, 4), layers=layers)
    channels = spy.get_format_info(texture_format).channel_count
    values = np.arange(7 * 4 * channels * (layers or 1), dtype=dtype).reshape(layers or 1, 4, 7, channels)
    flat = values if channels > 1 else values[..., 0]
    for layer in range(layers or 1):
        texture.copy_from_numpy(flat[layer], layer=layer)
    with device.record() as recording:
        snapshot = Snapshot(device, recording.encoder, texture)
    for layer in range(layers or 1):
        texture.copy_from_numpy(np.zeros_like(flat[layer]), layer=layer)
    device.handle.wait_for_idle()
    expected = flat[0] if layers is None else values
    assert snapshot.array().dtype == dtype
    np.testing.assert_array_equal(snapshot.array(), expected)


@pytest.mark.parametrize("size", [(0, 10), (10, 0), (-1, 5), (16385, 10), (10, 99999)])
def test_impossible_sizes_are_one_line(size):
    with pytest.raises(PicaError, match=f"picture size {size[0]}x{size[1]}: .* 1 to 16384 pixels") as raised:
        checked_size(size)
    assert "\n" not in str(raised.value)


def test_possible_sizes_pass():
    assert checked_size((1, 16384)) == (1, 16384)

"""The binding checker: nothing unbound, nothing misspelt."""

import subprocess
import sys

import numpy as np
import pytest
import slangpy as spy

from pica.errors import BindingError, DeviceError
from pica.rhi import binding
from tests.tracing.kernels import kernel, read

SOURCE = """
StructuredBuffer<float> numbers;
RWStructuredBuffer<float> doubled;
float offset;
[shader("compute")] [numthreads(4, 1, 1)]
void main(uint3 thread : SV_DispatchThreadID) { doubled[thread.x] = numbers[thread.x] * 2 + offset; }
"""


@pytest.fixture
def compute(device):
    return kernel(device, SOURCE, "doubling")


@pytest.fixture
def buffers(device):
    return {
        "numbers": device.structured("numbers", np.arange(4, dtype=np.float32)),
        "doubled": device.structured("doubled", np.zeros(4, np.float32)),
    }


def test_what_is_bound_arrives_and_can_change(device, compute, buffers):
    with device.record() as recording:
        compute(recording, (4, 1, 1), **buffers, offset=1.0)
    np.testing.assert_array_equal(read(buffers["doubled"], np.float32), [1, 3, 5, 7])
    buffers["numbers"] = device.structured("other", np.full(4, 10, np.float32))
    with device.record() as recording:
        compute(recording, (4, 1, 1), **buffers, offset=2.0)
        compute(recording, (4, 1, 1), **buffers, offset=2.0)
    np.testing.assert_array_equal(read(buffers["doubled"], np.float32), [22, 22, 22, 22])


ROWS = """
import rhi.rows;
struct Place { uint number; float3 where; };
Rows<Place> places;
SmallRows<float3> points;
ThreeWordRows<float3> more;
RWStructuredBuffer<float> sums;
[shader("compute")] [numthreads(4, 1, 1)]
void main(uint3 thread : SV_DispatchThreadID)
{
    Place place = places[thread.x];
    float3 sum = place.where + points[thread.x] + more[thread.x];
    sums[thread.x] = place.number + sum.x + sum.y + sum.z;
}
"""


def test_tables_arrive_row_by_row_and_none_is_too_large_to_be_read(device, monkeypatch):
    places = np.zeros(4, np.dtype([("number", "u4"), ("where", "f4", 3)]))
    places["number"], places["where"] = np.arange(4), np.arange(12).reshape(4, 3)
    points = 100 * np.arange(12, dtype=np.float32).reshape(4, 3)
    rows = kernel(device, ROWS, "rows")
    values = {
        "places": device.buffer("places", data=places.view(np.uint32), struct_size=16),
        "points": device.buffer("points", data=points, struct_size=4),
        "more": device.buffer("more", data=10 * points, struct_size=12),
        "sums": device.structured("sums", np.zeros(4, np.float32)),
    }
    with device.record() as recording:
        rows(recording, (4, 1, 1), **values)
    expected = np.arange(4) + places["where"].sum(1) + 11 * points.sum(1)
    np.testing.assert_array_equal(read(values["sums"], np.float32), expected)
    monkeypatch.setattr(binding, "_MOST_TEXELS", 11)  # the points have 12
    with (
        device.record() as recording,
        pytest.raises(DeviceError, match="rows: points: 48 bytes, of which shaders can read 44"),
    ):
        rows(recording, (4, 1, 1), **{**values, "points": device.buffer("other", data=points, struct_size=4)})


def test_each_dispatch_of_one_recording_keeps_its_own_values(device, compute, buffers):
    other = device.structured("other", np.zeros(4, np.float32))
    with device.record() as recording:
        compute(recording, (4, 1, 1), **buffers, offset=1.0)
        compute(recording, (4, 1, 1), **{**buffers, "doubled": other}, offset=5.0)
    np.testing.assert_array_equal(read(buffers["doubled"], np.float32), [1, 3, 5, 7])
    np.testing.assert_array_equal(read(other, np.float32), [5, 7, 9, 11])


def test_unbound_names_are_named(device, compute, buffers):
    with device.record() as recording, pytest.raises(BindingError, match="doubling: not bound: numbers, offset"):
        compute(recording, (4, 1, 1), doubled=buffers["doubled"])


def test_misspelt_name_is_named_with_those_there_are(device, compute, buffers):
    with (
        device.record() as recording,
        pytest.raises(BindingError, match=r"doubling: no parameter 'ofset'.*doubled, numbers, offset"),
    ):
        compute(recording, (4, 1, 1), **buffers, ofset=1.0)


def test_incomplete_block_is_refused(device):
    gbuffer = device.parameter_block("frame/gbuffer.slang", "gbuffer")
    gbuffer.bind(depth=device.texture("depth", spy.Format.r32_float, (4, 4)))
    lighting = device.compute("effects/lighting/direct.slang", name="lighting")
    with pytest.raises(
        BindingError, match="block 'gbuffer': not bound: coats, emission, lobes, material, motion, normals"
    ):
        lighting.parameters(0).bind(gbuffer=gbuffer)


def test_misspelt_field_of_a_block_is_named(device):
    block = device.parameter_block("frame/constants.slang", "frame")
    with pytest.raises(BindingError, match=r"no parameter 'sized'.*camera, index, jitter"):
        block.bind(sized=spy.uint2(4, 4))


def test_unknown_block_is_named(device):
    with pytest.raises(BindingError, match=r"frame/constants\.slang: no parameter block 'fame'"):
        device.parameter_block("frame/constants.slang", "fame")


def test_raster_and_ray_passes_are_checked_too(device):
    from pica.rhi.passes import RasterState
    from pica.tracing.ray_effect import ray_effect

    state = RasterState((spy.Format.rg32_uint,), spy.CullMode.none)
    raster = device.raster("effects/gbuffer/raster.slang", ("vertexMain", "opaqueMain"), state)
    with pytest.raises(BindingError, match="raster: not bound: frame, scene"):
        raster.bind(None)
    rays = ray_effect(device, "effects/gbuffer/primary_rays.slang", "PrimaryRays", "hit")
    with device.record() as recording, pytest.raises(BindingError, match=r"primary_rays: not bound: .*visibility"):
        rays(recording, (4, 4))


def test_shader_that_does_not_compile_names_its_file(device):
    from pica.errors import DeviceError

    with pytest.raises(DeviceError, match=r"effects/nothing\.slang"):
        device.compute("effects/nothing.slang").pipeline  # noqa: B018


MANY_BLOCKS = """
import random
from pica.rhi.device import Device
device, alive = Device(), []
blocks = [("gpu_scene/scene.slang", "scene"), ("frame/gbuffer.slang", "gbuffer"), ("frame/constants.slang", "frame")]
for _ in range(1000):
    block = device.parameter_block(*random.choice(blocks))
    assert all(block._cursor[name] for name in block._names)
    alive.append(block)
    if len(alive) > 4:
        alive.pop(random.randrange(5))
print("fine")
"""


@pytest.mark.device
def test_blocks_stay_whole_when_others_go():
    """Slang-RHI knew block layouts by address only; a freed program's address led to a wrong one, or to a crash."""
    done = subprocess.run([sys.executable, "-c", MANY_BLOCKS], capture_output=True, text=True, timeout=120)
    assert done.stdout == "fine\n", done.stderr[-500:]

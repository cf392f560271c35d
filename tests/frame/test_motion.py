"""Motion vectors in 8 bytes: what goes in comes out, in shaders and for people."""

import numpy as np
import pytest

from pica.frame.aovs import motion_of
from tests.tracing.kernels import read, run

THROUGH = """
import frame.motion;
StructuredBuffer<float4> given; // pixels, depth change, known
RWStructuredBuffer<uint2> packed;
RWStructuredBuffer<float4> back;
[shader("compute")] [numthreads(64, 1, 1)]
void main(uint3 thread : SV_DispatchThreadID)
{
    float4 v = given[thread.x];
    Motion motion = { v.xy, v.z, v.w != 0 };
    packed[thread.x] = packMotion(motion);
    motion = unpackMotion(packed[thread.x]);
    back[thread.x] = float4(motion.pixels, motion.depthChange, motion.known ? 1 : 0);
}
"""


@pytest.fixture
def through(device):
    """What shaders and what people read of (64, 4) pixels right and down, depth change and whether it is known."""

    def go(given):
        given = device.structured("given", np.ascontiguousarray(given, np.float32))
        packed = device.structured("packed", np.zeros((64, 2), np.uint32))
        back = device.structured("back", np.zeros((64, 4), np.float32))
        run(device, THROUGH, 64, given=given, packed=packed, back=back)
        shaders = read(back, np.float32).reshape(64, 4)
        return shaders, motion_of(read(packed, np.uint32).reshape(8, 8, 2)).reshape(64, 3)

    return go


def test_motion_survives(through):
    random = np.random.default_rng(0)
    signs = random.choice([-1, 1], (64, 3))
    values = signs * 10 ** random.uniform([-4, -4, -8], [4, 4, 8], (64, 3))
    values[0], values[1], values[2] = (0, 0, 0), (-16000, 16000, -1), (1e9, -1e9, 1)
    back, people = through(np.c_[values, np.ones(64)])
    for found in (back[:, :3], people):
        inside = np.clip(values[:, :2], -16383, 16383)
        still = np.abs(inside) < 1 / 512
        assert not found[:, :2][still].any(), "what stands still stands still"
        np.testing.assert_allclose(found[:, :2][~still], inside[~still], rtol=2.0**-15)
        np.testing.assert_allclose(found[:, 2], values[:, 2], rtol=2.0**-10)
    assert (back[:, 3] == 1).all() and not people[0].any()


def test_what_is_not_known_stays_so(through):
    back, people = through(np.tile([3.5, -7.25, 0.5, 0], (64, 1)))
    assert (back == [3.5, -7.25, 0, 0]).all()
    assert (people[:, :2] == [3.5, -7.25]).all() and np.isnan(people[:, 2]).all()

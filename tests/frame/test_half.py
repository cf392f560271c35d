"""Half size: one pixel of each 2x2, as a picture of its own that effects work at unchanged."""

import numpy as np
import pytest
import slangpy as spy

from pica.effects.gbuffer.gbuffer import GBufferEffect
from pica.frame.aovs import motion_of
from pica.frame.context import FrameSequence, half_pixel_offset, half_size
from pica.graph.graph import FrameGraph
from pica.graph.memory import Memory
from pica.graph.plan import Plan
from pica.graph.resources import write
from pica.scene.camera import Camera
from pica.scene.coat import Coat
from pica.scenes.basic_meshes import box, plane
from pica.scenes.placing import move, rotate
from pica.tracing.ray_effect import ray_effect
from tests.building import lambert, orthographic, placed, scene_of
from tests.rays import gpu_scene

PROBE = """
import tracing.ray_effect;
import frame.constants;
import frame.gbuffer;
RWTexture2D<float4> found;

// Where a reflection ray from each pixel ends.
struct Reflection : IRayEffect
{
    struct State { float4 found; };
    static bool start(uint2 pixel, out Ray ray, out State state)
    {
        ray = {};
        state = {};
        Surface surface;
        if (!gbuffer.load(pixel, surface))
            return false;
        float3 direction = reflect(-frame.camera.toViewer(surface.position), surface.normal);
        float distance = length(surface.position - frame.camera.position);
        ray = Ray.leaving(RayType.surface, surface, distance, direction, 1e4, 0);
        return true;
    }
    static bool advance(uint2 pixel, Hit hit, Surface surface, inout Ray ray, inout State state)
    {
        state.found = hit.isMiss() ? float4(0, 0, 0, 1) : float4(surface.position, 2);
        return false;
    }
    static void finish(uint2 pixel, State state) { found[pixel] = state.found; }
}
"""
CAMERAS = {
    "perspective": Camera.look_at((1.2, 1.5, 3.2), (0, 0.4, 0)),
    "orthographic": orthographic((1.2, 1.5, 3.2), (0, 0.4, 0), 3.0),
}


class Halves:
    """Frames of a small scene in which a reflection ray works at full and at half size."""

    def __init__(self, device, size, **more):
        device.handle.load_module_from_source("reflection_probe", PROBE)
        self.device, self.size, self.half = device, size, half_size(size)
        node = placed(box(1, lambert(0.9, **more)), move(0, 0.5, 0) @ rotate("y", 30))
        self.scene = gpu_scene(device, scene_of(placed(plane(9, 9, lambert())), node))
        self.sequence, self.fill = FrameSequence(device, size, 3), GBufferEffect(device, "raster")
        self.effect = ray_effect(device, "reflection_probe", "Reflection", "surface")
        self.memory, self.plan = Memory(device), None

    def declare(self, at_half=True):
        """The frame: a G-buffer, and a reflection ray from it and, if so, from that of half size."""
        graph = FrameGraph(self.memory, self.size, self.size, self.sequence.block, self.sequence.half_block)
        self.full = self.fill(graph, self.scene)
        sizes = [("found", self.full, graph.frame, self.size)]
        if at_half:
            self.half_gbuffer = self.full.at_half(graph)
            assert self.full.at_half(graph) is self.half_gbuffer, "made once"
            sizes.append(("found at half", self.half_gbuffer, graph.half_frame, self.half))
        self.names = []
        for name, gbuffer, frame, size in sizes:
            found = graph.texture(name, spy.Format.rgba32_float, size)
            graph.add(self.effect, size, frame=frame, gbuffer=gbuffer, scene=self.scene, found=write(found))
            textures = {"found": found, **gbuffer.textures}
            self.names.append({each: f"{name}: {each}" for each in textures})
            for each, texture in textures.items():
                graph.offer(f"{name}: {each}", (texture,), lambda values: values)
        self.plan = Plan(graph)

    def advance(self, camera, only=None):
        """The frame's number, and what fetches both G-buffers' textures and what rays from them found."""
        frame = self.sequence.begin(camera)
        self.scene.update(frame, frame.camera)
        if self.plan is None:  # what materials the scene has is known by now
            self.declare()
        frame.requested = frozenset(name for names in self.names for name in names.values() if only is None)
        found = self.plan.replay(frame, only)
        self.sequence.end(frame)
        return frame.index, found

    def __call__(self, camera):
        """The frame's number, both G-buffers' textures and both (height, width, 4) results."""
        index, found = self.advance(camera)
        full, half = ({each: found[name]() for each, name in names.items()} for names in self.names)
        return index, full, half, full["found"], half["found"]

    @property
    def previous_visibility(self):
        """What the newest frame at half size found of the one before."""
        return self.half_gbuffer.shapes.state.sets[1]["visibility"].to_numpy()


def chosen(values, index):
    """The pixels of a full picture that stand for 2x2."""
    right, down = half_pixel_offset(index)
    return values[down::2, right::2]


@pytest.mark.parametrize("name", CAMERAS)
@pytest.mark.parametrize("size", [(32, 24), (33, 25)], ids=["even", "odd"])
def test_a_ray_effect_at_half_size_finds_what_it_finds_at_these_pixels(device, name, size):
    halves = Halves(device, size)
    for _ in range(5):
        index, _, _, whole, found = halves(CAMERAS[name])
        expected = chosen(whole, index)
        rows, columns = expected.shape[:2]
        part = found[:rows, :columns]
        assert (expected[..., 3] == 2).sum() > 5 and (expected[..., 3] == 1).sum() > 5
        # A ray that passes an edge may fall to either side of it, as places are rounded another way.
        same = part[..., 3] == expected[..., 3]
        assert same.mean() > 0.99
        away = np.abs(part - expected)[..., :3].max(-1)[same & (expected[..., 3] == 2)]
        assert np.percentile(away, 95) < 1e-4
        assert not found[rows:].any() and not found[:, columns:].any(), "nothing beyond the picture"


def test_the_g_buffer_is_that_of_the_pixel_which_stands_for_four(device):
    halves = Halves(device, (32, 24), coats=(Coat(strength=0.8, roughness=0.4),))
    cameras = [Camera.look_at((1.2 + 0.3 * n, 1.5, 3.2), (0, 0.4, 0)) for n in range(3)]
    for camera in cameras:
        index, full, half, *_ = halves(camera)
        for texture in ("visibility", "depth", "normals", "material", "emission"):
            expected = chosen(full[texture], index)
            np.testing.assert_array_equal(half[texture], expected)
        assert half["coats"].shape[1::-1] == halves.half
        seen = chosen(full["material"], index)[..., 2] >> 24 & 4 != 0
        expected = chosen(full["coats"], index)[seen]
        np.testing.assert_array_equal(half["coats"][seen], expected)
        assert (expected[:, 0] == (204 | 102 << 8)).any()
        motion = motion_of(half["motion"])
        expected = chosen(motion_of(full["motion"]), index)
        np.testing.assert_allclose(motion[..., :2], expected[..., :2] / 2, atol=1 / 500)
    assert np.abs(expected[..., :2]).max() > 1


def test_every_pixel_has_its_turn_and_meets_all_of_the_jitter():
    turns = [half_pixel_offset(index) for index in range(16)]
    for first in range(0, 16, 4):
        assert len(set(turns[first : first + 4])) == 4
    assert {(index % 4, turn) for index, turn in enumerate(turns)} == {
        (quarter, turn) for quarter in range(4) for turn in set(turns)
    }


def test_nothing_is_taken_unless_asked_for_and_what_is_old_is_not_known(device):
    halves = Halves(device, (32, 24))
    camera = CAMERAS["perspective"]

    def without():
        halves.advance(camera, only="gbuffer")

    halves.advance(camera)
    halves.declare(at_half=False)
    for _ in range(2):
        halves.advance(camera)
    before = device.memory
    halves.advance(camera)
    assert device.memory == before
    halves.declare()
    halves(camera)
    taken = device.memory - before
    assert taken > 0
    assert not halves.previous_visibility.any(), "there was none in the frame before"
    halves(camera)
    assert halves.previous_visibility.any()
    without()
    halves(camera)
    assert not halves.previous_visibility.any()
    assert device.memory - before == taken
    halves.declare(at_half=False)
    assert device.memory == before
    halves.sequence.resize((16, 16))
    halves.size = (16, 16)
    halves.declare(at_half=False)
    assert device.memory < before

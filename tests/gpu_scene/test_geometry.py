"""Vertices and indices on the GPU."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from pica.gpu_scene.geometry_store import VERTEX, octahedral
from pica.scene.camera import Camera
from pica.scenes.basic_meshes import box, plane, sphere
from tests.building import RASTER, RAYS, lambert, placed, render, scene_of
from tests.rays import gpu_scene
from tests.tracing.kernels import read, run

PACK = """
import shaders.packing;
StructuredBuffer<float3> normals;
RWStructuredBuffer<uint> packed;
RWStructuredBuffer<float3> unpacked;
[shader("compute")] [numthreads(64, 1, 1)]
void main(uint3 thread : SV_DispatchThreadID)
{
    packed[thread.x] = packNormal(normals[thread.x]);
    unpacked[thread.x] = unpackNormal(packed[thread.x]);
}
"""


def test_octahedral_agrees_with_the_shaders(device):
    normals = np.random.default_rng(0).normal(size=(64 * 64, 3))
    normals[:8] = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1], [1, 1, 0], [-1, 0, -1]]
    normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32)
    packed = device.structured("packed", np.zeros(len(normals), np.uint32))
    unpacked = device.structured("unpacked", np.zeros_like(normals))
    values = {"normals": device.structured("normals", normals), "packed": packed, "unpacked": unpacked}
    run(device, PACK, len(normals), **values)
    np.testing.assert_allclose(read(unpacked, np.float32).reshape(-1, 3), normals, atol=7e-5)
    shaders = read(packed, np.uint32).view(np.int16).astype(int)
    ours = octahedral(normals).view(np.int16).astype(int)
    # Rounding may fall the other way where a number lies half way between two steps.
    assert np.abs(shaders - ours).max() <= 1 and (shaders != ours).mean() < 0.01


def test_records_find_the_corners_of_their_section(device):
    first, second = box(1, lambert()), sphere(1, lambert(), 8)
    scene = gpu_scene(device, scene_of(placed(first), placed(second)))
    positions = read(scene.geometry.positions, np.float32).reshape(-1, 3)
    indices = read(scene.geometry.triangles, np.uint32).reshape(-1, 3)
    for section, record in zip((first, second), scene.records, strict=True):
        own = indices[record["first_index"] :][: len(section.indices)].ravel() + record["first_vertex"]
        np.testing.assert_array_equal(positions[own], section.positions[section.indices.ravel()])


def test_vertices_keep_their_attributes(device):
    section = sphere(1, lambert(), 12)
    tangents = section.tangents.copy()
    tangents[::2, 3] = -1
    section.tangents, section.colors = tangents, np.random.default_rng(1).random(section.colors.shape)
    section.uv1 = section.uv0[:, ::-1] * 3 - 1
    scene = gpu_scene(device, scene_of(placed(section)))
    vertices = read(scene.geometry.vertices, VERTEX)[: len(section.positions)]
    np.testing.assert_array_equal(vertices["normal"], octahedral(section.normals))
    np.testing.assert_array_equal(vertices["tangent"] & 1, section.tangents[:, 3] < 0)
    np.testing.assert_array_equal(vertices["tangent"] >> 1, octahedral(section.tangents[:, :3]) >> 1)
    np.testing.assert_array_equal(vertices["uv0"], section.uv0)
    np.testing.assert_array_equal(vertices["uv1"], section.uv1)
    np.testing.assert_allclose(vertices["color"] / 65535, section.colors, atol=1e-5)


@pytest.mark.device
@pytest.mark.parametrize("primary", ["raster", "rays"])
def test_unused_vertices_change_nothing(primary):
    """Slang-RHI takes the number of vertices for that of indices where it is greater, and drivers crash on that."""
    run_apart = [sys.executable, "-m", "tests.gpu_scene.unused_vertices", primary]
    done = subprocess.run(run_apart, cwd=Path(__file__).parents[2], capture_output=True, text=True, timeout=240)
    assert done.returncode == 0, f"exit code {done.returncode}: {done.stderr[-1000:]}"


def test_sections_without_triangles_and_meshes_without_sections_are_left_out(device):
    empty = plane(1, 1, lambert())
    empty.indices = np.zeros((0, 3), np.uint32)
    nodes = [placed(empty), placed([]), placed([empty, plane(3, 3, lambert()), empty])]
    camera = Camera.look_at((0, 2, 0.5), (0, 0, 0))
    for values in (RASTER, RAYS):
        assert (render(device, scene_of(*nodes), camera=camera, values=values).aov("instance") == 3).all()

"""A pass over many views: a dispatch for each with its own arguments, or one whose arguments are rows of a buffer.

python benchmarks/argument_rows.py [--views 64] [--size 128] [--passes 100]

A row has a view's textures as bindless handles. Prints milliseconds to record, and on the device.
"""

import argparse
import time
from collections.abc import Callable

import numpy as np
import slangpy as spy

from pica.rhi.device import Device, open_device

READ, WRITTEN = 8, 2
"""Textures of a view."""
_KERNEL = """
[shader("compute")] [numthreads(8, 8, 1)]
void main(uint3 thread : SV_DispatchThreadID)
{
    ARGUMENTS
    float4 even = 0, odd = 0;
    for (int y = -1; y <= 1; y++)
        for (int x = -1; x <= 1; x++)
        {
            int3 texel = int3(clamp(int2(thread.xy) + int2(x, y), 0, size - 1), 0);
            [unroll] for (int number = 0; number < 8; number += 2)
            {
                even += given.source[number].Load(texel);
                odd += given.source[number + 1].Load(texel);
            }
        }
    RWTexture2D<float4> first = given.target[0], second = given.target[1];
    first[thread.xy] = even * given.factor;
    second[thread.xy] = odd * given.factor;
}
"""
BOUND = (
    "struct Given { Texture2D<float4> source[8]; RWTexture2D<float4> target[2]; float factor; };"
    "uniform Given given; uniform int size;" + _KERNEL.replace("ARGUMENTS", "")
)
ROWS = (
    "struct Given { DescriptorHandle<Texture2D<float4>> source[8]; DescriptorHandle<RWTexture2D<float4>> target[2];"
    "float factor; float unused; }; StructuredBuffer<Given> rows; uniform int size;"
    + _KERNEL.replace("ARGUMENTS", "Given given = rows[thread.z];")
)
ROW = np.dtype([("source", "<u8", READ), ("target", "<u8", WRITTEN), ("factor", "<f4"), ("unused", "<f4")])
Textures = list[spy.Texture]
Record = Callable[[spy.CommandEncoder], object]


def pipeline(device: spy.Device, name: str, text: str) -> spy.ComputePipeline:
    """Of Slang's text."""
    module = device.load_module_from_source(name, text)
    return device.create_compute_pipeline(device.link_program([module], [module.entry_point("main")]))


def textures(device: spy.Device, views: int, size: int) -> list[Textures]:
    """Of each view, those to read first."""
    usage = spy.TextureUsage.shader_resource | spy.TextureUsage.unordered_access
    chance = np.random.default_rng(0)

    def made() -> spy.Texture:
        texels = chance.random((size, size, 4)).astype(np.float16)
        kind = {"type": spy.TextureType.texture_2d, "format": spy.Format.rgba16_float}
        return device.create_texture(**kind, width=size, height=size, usage=usage, data=texels)

    return [[made() for _ in range(READ + WRITTEN)] for _ in range(views)]


def one_by_one(device: spy.Device, of_views: list[Textures], size: int) -> Record:
    """A dispatch for each view."""
    program = pipeline(device, "bound", BOUND)

    def record(encoder: spy.CommandEncoder) -> None:
        for of_view in of_views:
            with encoder.begin_compute_pass() as compute:
                cursor = spy.ShaderCursor(compute.bind_pipeline(program))
                for number, texture in enumerate(of_view[:READ]):
                    cursor.given.source[number] = texture
                for number, texture in enumerate(of_view[READ:]):
                    cursor.given.target[number] = texture
                cursor.given.factor, cursor.size = 1.0, size
                compute.dispatch([size, size, 1])

    return record


def by_rows(device: spy.Device, of_views: list[Textures], size: int) -> Record:
    """One dispatch, whose third number of a thread is the view."""
    program = pipeline(device, "rows", ROWS)
    rows = np.zeros(len(of_views), ROW)
    for row, of_view in zip(rows, of_views, strict=True):
        row["source"] = [texture.descriptor_handle_ro.value for texture in of_view[:READ]]
        row["target"] = [texture.descriptor_handle_rw.value for texture in of_view[READ:]]
        row["factor"] = 1
    data = rows.view(np.uint8)
    buffer = device.create_buffer(
        size=data.nbytes, struct_size=ROW.itemsize, usage=spy.BufferUsage.shader_resource, data=data
    )

    def record(encoder: spy.CommandEncoder) -> None:
        with encoder.begin_compute_pass() as compute:
            cursor = spy.ShaderCursor(compute.bind_pipeline(program))
            cursor.rows, cursor.size = buffer, size
            compute.dispatch([size, size, len(of_views)])

    return record


def times(device: spy.Device, record: Record, passes: int) -> np.ndarray:
    """Milliseconds to record and on the device, the least of five runs."""
    stamps = device.create_query_pool(type=spy.QueryType.timestamp, count=2)

    def run() -> tuple[float, float]:
        began = time.perf_counter()
        encoder = device.create_command_encoder()
        encoder.write_timestamp(stamps, 0)
        for _ in range(passes):
            record(encoder)
            encoder.global_barrier()
        encoder.write_timestamp(stamps, 1)
        commands = encoder.finish()
        recorded = time.perf_counter() - began
        device.wait_for_submit(device.submit_command_buffer(commands))
        first, last = stamps.get_timestamp_results(0, 2)
        return 1000 * recorded, 1000 * (last - first)

    return np.min([run() for _ in range(5)], axis=0)


def main() -> None:
    """Measure both."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--views", type=int, default=64)
    parser.add_argument("--size", type=int, default=128)
    parser.add_argument("--passes", type=int, default=100)
    given = parser.parse_args()
    opened: Device = open_device()
    device = opened.handle
    of_views = textures(device, given.views, given.size)
    results = []
    for name, made in (("a dispatch for each view", one_by_one), ("one dispatch, rows by view", by_rows)):
        recorded, ran = times(device, made(device, of_views, given.size), given.passes)
        results.append([of_view[-1].to_numpy() for of_view in of_views])
        print(f"{name}: {recorded:.2f} ms to record, {ran:.2f} ms on {opened.name}")
    print("equal" if np.array_equal(*results) else "different")


if __name__ == "__main__":
    main()

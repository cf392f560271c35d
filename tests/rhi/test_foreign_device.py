"""Renderers on a SlangPy device that a program has opened by itself, each in a process of its own."""

import os
import subprocess
import sys

import pytest

OPEN = """
import numpy as np
import slangpy as spy
import pica
from pica.rhi.device import open_device
from pica.rhi.slang_sessions import PACKAGE

scene = pica.scenes.cornell()
settings = pica.Settings.preset("raster")
luid = spy.Device.enumerate_adapters(spy.DeviceType.vulkan)[NUMBER].luid
own = spy.Device(type=spy.DeviceType.vulkan, adapter_luid=luid)

def picture(device, **more):
    with pica.Renderer(scene, size=(32, 18), settings=settings, device=device) as renderer:
        return renderer.render(2).color
"""
EQUAL = """
assert (picture(own) == picture(ADAPTER)).all()
print("equal")
"""
SHARED = """
first, second = (pica.Renderer(scene, size=size, settings=settings, device=own) for size in ((32, 18), (16, 16)))
assert first.device is second.device and first.device.handle is own
alone = picture(ADAPTER)
for _ in range(2):
    second.render(1)
    shown = first.render(1)
assert (shown.color == alone).all()
second.close()
assert (first.render(2, cut=True).color == alone).all()
print("shared")
"""
PROGRAM = '''
DOUBLE = """
RWStructuredBuffer<float> values;
[shader("compute")] [numthreads(32, 1, 1)]
void main(uint3 thread : SV_DispatchThreadID) { values[thread.x] *= 2; }
"""
module = own.load_module_from_source("double", DOUBLE)
kernel = own.create_compute_kernel(own.link_program([module], [module.entry_point("main")]))
values = own.create_buffer(struct_size=4, data=np.arange(32, dtype=np.float32),
                           usage=spy.BufferUsage.shader_resource | spy.BufferUsage.unordered_access)

def doubled():
    kernel.dispatch([32, 1, 1], vars={"values": values})
    return values.to_numpy().view(np.float32)
'''
BESIDE = (
    PROGRAM
    + """
renderer = pica.Renderer(scene, size=(32, 18), settings=settings, device=own)
before = renderer.render(2).color
assert (doubled() == 2 * np.arange(32)).all()
assert (renderer.render(2, cut=True).color == before).all()
textures = renderer.advance(renderer.scene.default_camera(32 / 18))
assert textures["display"].to_numpy().shape == (18, 32, 4)  # the program's own device can read it
renderer.close()
renderer.device.close()
assert renderer.device.closed
assert (doubled() == 4 * np.arange(32)).all()
again = picture(own)  # the same device once more
assert (again == before).all()
own.wait()
print("usable")
"""
)
NO_VULKAN = """
for kind in (spy.DeviceType.cuda, spy.DeviceType.cpu):
    try:
        other = spy.Device(type=kind)
    except RuntimeError:
        continue
    try:
        pica.Renderer(scene, device=other)
    except pica.errors.DeviceError as error:
        assert "\\n" not in str(error) and "pica needs Vulkan" in str(error), error
        print("refused")
    else:
        print("taken")
print("end")
"""


def run(device, program):
    from pica.rhi.adapters import adapters

    number = next(number for number, adapter in enumerate(adapters()) if adapter.name == device.name)
    text = f"NUMBER, ADAPTER = {number}, {device.name!r}\n" + OPEN + program
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, timeout=600, env=os.environ)
    assert done.returncode == 0, done.stderr[-3000:]
    words = "equal", "shared", "usable", "refused", "taken", "end"
    return [line for line in done.stdout.splitlines() if line in words]  # SlangPy logs there too


@pytest.mark.parametrize(
    ("program", "says"),
    [(EQUAL, "equal"), (SHARED, "shared"), (BESIDE, "usable")],
    ids=["equal pictures", "two renderers", "beside a program"],
)
def test_renderers_on_a_program_s_device(device, program, says):
    assert run(device, program) == [says]


def test_a_device_without_vulkan_is_refused(device):
    *refused, end = run(device, NO_VULKAN)
    assert end == "end" and set(refused) <= {"refused"}
    if not refused:
        pytest.skip("there is no other kind of device here")

import subprocess
import sys

import numpy as np
import pytest

import pica
from pica.graph.offers import Decoder
from pica.rendering.tensors import cuda_tensors, decoded
from pica.rhi.cuda import SharedBuffers
from pica.scene.orbit import orbited
from tests.building import CAMERA, SIZE, still_life

ON_CARD = {"color", "display", "depth", "normal", "geometric_normal", "albedo", "metallic", "roughness", "emission"}
ON_CARD |= {"motion", "instance", "material"}
CAMERAS = {
    "perspective": CAMERA,
    "orthographic": pica.Camera(CAMERA.transform, orthographic_height=3.0, near=0.1, far=50.0),
}


@pytest.fixture(scope="module")
def renderer(device):
    settings = pica.Settings().with_values({"antialiasing.upscale": 2.0})
    with pica.Renderer(still_life(), size=SIZE, settings=settings, device=device) as renderer:
        yield renderer


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
def test_what_the_device_decodes_is_what_the_host_decodes(renderer, monkeypatch, camera):
    """With upscaling too, where AOVs are enlarged."""
    captures = {}
    monkeypatch.setattr("pica.renderer.gathered.cuda_tensors", lambda *given: captures.update(given[2]) or {})
    renderer.render(1, camera=camera)
    turned = orbited(camera, np.zeros(3), 0.1)
    frame = renderer.render(2, camera=turned)
    found = {name for name, capture in captures.items() if isinstance(capture.read, Decoder)}
    assert found == ON_CARD
    for name in found:
        loan, dtype, shape = decoded(renderer.device, SIZE, captures[name])
        values = loan.buffer.to_numpy().view(np.uint8).view(dtype).reshape(shape)
        expected = getattr(frame, name) if name in ("color", "display") else frame.aov(name)
        values = values[..., : captures[name].read.channels].reshape(expected.shape)
        assert expected.dtype == values.dtype
        assert name in ("emission", "metallic") or np.ptp(expected[np.isfinite(expected)]) > 0, name
        np.testing.assert_allclose(values, expected, rtol=2e-6, atol=2e-6, err_msg=name)


def test_without_shared_memory_there_are_no_tensors_on_the_device(renderer):
    assert not renderer.device.handle.supports_cuda_interop
    assert cuda_tensors(renderer.device, SIZE, {}) == {}


def test_buffers_are_lent_again_once_their_tensors_have_gone(renderer):
    """Those of another size are not, and no more are kept than a frame has AOVs."""
    buffers = SharedBuffers(renderer.device)
    first, second = buffers.lend("a", 64), buffers.lend("b", 64)
    assert first.buffer is not second.buffer
    buffer = first.buffer
    del first
    assert buffers.lend("c", 32).buffer is not buffer
    third = buffers.lend("d", 64)
    assert third.buffer is buffer
    lent = [buffers.lend("e", 16) for _ in range(2 * SharedBuffers.KEPT)]
    lent.clear()
    assert len({id(buffers.lend("f", 16).buffer) for _ in range(4)}) == 1
    assert len(buffers._free) == SharedBuffers.KEPT


def test_dlpack_shares_memory(renderer):
    frame = renderer.render(1, camera=CAMERA)
    assert np.shares_memory(np.from_dlpack(frame.dlpack("depth")), frame.aov("depth"))
    assert np.shares_memory(np.from_dlpack(frame), frame.color)
    assert frame.__dlpack_device__() == (1, 0)
    with pytest.raises(pica.PicaError, match=r"no AOV 'dept'.*depth"):
        frame.dlpack("dept")


def test_tensors_share_memory_and_outlive_the_frame(renderer):
    torch = pytest.importorskip("torch", reason="PyTorch is not installed")
    frame = renderer.render(1, camera=CAMERA)
    for name in ("display", "depth", "instance"):
        array = frame.display if name == "display" else frame.aov(name)
        tensor = frame.torch(name)
        assert tensor.data_ptr() == array.ctypes.data and tensor is frame.torch(name)
        assert tuple(tensor.shape) == array.shape and str(tensor.dtype) == f"torch.{array.dtype}"
    color = frame.torch()
    expected = frame.color.copy()
    del frame
    renderer.resize((SIZE[0] // 2, SIZE[1]))
    assert tuple(renderer.render(1, camera=CAMERA).torch().shape) == (SIZE[1], SIZE[0] // 2, 3)
    renderer.resize(SIZE)
    assert torch.equal(color, torch.from_numpy(expected))
    with pytest.raises(pica.PicaError, match="no AOV 'albdo'"):
        renderer.render(1, camera=CAMERA).torch("albdo")


def test_without_pytorch_one_line_says_so():
    program = """
import sys
sys.modules["torch"] = None
import numpy as np
from pica.errors import PicaError
from pica.images.output import Frame
frame = Frame((2, 1), lambda: np.ones((1, 2, 3), np.float32), None, {}, {})
assert np.from_dlpack(frame).sum() == 6
try:
    frame.torch()
except PicaError as error:
    print(error)
"""
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True)
    assert run.stdout == "frame.torch: PyTorch is not installed; pip install torch\n"

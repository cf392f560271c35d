"""Frames as CUDA tensors: that they are right, and their time beside that of arrays through host memory.

    python benchmarks/torch_frames.py
    python benchmarks/torch_frames.py --scene cornell --size 640x360 --frames 20

Needs an NVIDIA card and a PyTorch with CUDA; elsewhere it checks tensors on the processor. A time is a median by the
clock from a finished frame until the data is there: of a tensor on the card, and of the array and its upload. Exits
with 1 if a check fails.
"""

import argparse
import gc
import sys
import time
from collections.abc import Callable
from statistics import median
from typing import Any

import numpy as np
import torch

import pica

NAMES = "color", "display", "depth", "normal", "albedo", "motion", "instance"


def main() -> None:
    """Check, then measure."""
    parser = argparse.ArgumentParser(description="Frames as CUDA tensors: checks and times.")
    parser.add_argument("--scene", default="machine_world", help="a built-in scene")
    parser.add_argument("--size", default="1920x1080")
    parser.add_argument("--frames", type=int, default=50)
    arguments = parser.parse_args()
    width, height = (int(length) for length in arguments.size.split("x"))
    scene = getattr(pica.scenes, arguments.scene)()
    faults: list[str] = []
    with pica.Renderer(scene, size=(width, height)) as renderer:
        shares = renderer.device.handle.supports_cuda_interop
        cuda = shares and torch.cuda.is_available()
        print(f"{renderer.device_name}, PyTorch {torch.__version__}, memory shared with CUDA: {shares}")
        faults += check_values(renderer, cuda)
        faults += check_lifetimes(renderer, (width, height))
        print(f"{'':10}{'tensor, ms':>12}{'array and upload, ms':>22}")
        for name in NAMES:
            direct = measured(renderer, arguments.frames, lambda frame, name=name: frame.torch(name))
            host = measured(renderer, arguments.frames, lambda frame, name=name: uploaded(frame, name, cuda))
            print(f"{name:10}{direct:12.3f}{host:22.3f}")
    for fault in faults:
        print(f"failed: {fault}")
    print("all checks passed" if not faults else f"{len(faults)} checks failed")
    sys.exit(bool(faults))


def array_of(frame: pica.Frame, name: str) -> Any:
    """The NumPy array of a buffer."""
    return getattr(frame, name) if name in ("color", "display") else frame.aov(name)


def uploaded(frame: pica.Frame, name: str, cuda: bool) -> Any:
    """The way through host memory."""
    tensor = torch.from_numpy(array_of(frame, name))
    return tensor.cuda() if cuda else tensor


def check_values(renderer: pica.Renderer, cuda: bool) -> list[str]:
    """Tensors have the content, the type and the shape of the arrays, and are where they should be."""
    frame = renderer.render(2)
    faults = []
    for name in NAMES:
        tensor, array = frame.torch(name), array_of(frame, name)
        if tensor.is_cuda != cuda:
            faults.append(f"{name} is on {tensor.device}")
        values = tensor.cpu().numpy()
        exact = name in ("color", "display", "instance")
        equal = np.array_equal(values, array) if exact else np.allclose(values, array, rtol=2e-6, atol=2e-6)
        if not equal or values.dtype != array.dtype:
            faults.append(f"{name} differs from the array, {values.dtype} {values.shape}, {array.dtype} {array.shape}")
    if not torch.equal(torch.from_dlpack(frame), frame.torch()):
        faults.append("from_dlpack(frame) is not the colour")
    return faults


def check_lifetimes(renderer: pica.Renderer, size: tuple[int, int]) -> list[str]:
    """A tensor keeps its content through further frames, another size, and the end of its frame."""
    frame = renderer.render(2)
    tensor, before = frame.torch(), frame.color.copy()
    del frame
    gc.collect()
    renderer.resize((size[0] // 2, size[1] // 2))
    small = renderer.render(2)
    faults = [] if tuple(small.torch().shape[:2]) == (size[1] // 2, size[0] // 2) else ["shape after resize"]
    if not np.array_equal(small.torch().cpu().numpy(), small.color):
        faults.append("content after resize")
    for _ in range(8):
        renderer.render(1).torch()
    renderer.resize(size)
    renderer.render(1)
    if not np.array_equal(tensor.cpu().numpy(), before):
        faults.append("content after the frame has gone")
    return faults


def measured(renderer: pica.Renderer, frames: int, fetch: Callable[[pica.Frame], Any]) -> float:
    """Milliseconds from a finished frame until its data is there, the median."""
    times = []
    for _ in range(frames + 5):
        frame = renderer.render(1, aovs=("depth", "normal", "albedo", "motion", "instance"))
        renderer.device.handle.wait_for_idle()
        began = time.perf_counter()
        fetch(frame)
        if torch.cuda.is_available():
            torch.cuda.synchronize()
        times.append(1e3 * (time.perf_counter() - began))
    return median(times[5:])


if __name__ == "__main__":
    main()

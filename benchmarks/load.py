"""What loading large files takes: cores, seconds, and peak memory over what stays.

    python benchmarks/load.py model.glb other.glb [--made DIR]

Each file is loaded in a process of its own, after a small one. `--made`: also a file
of about 300 MB, which is made there unless it exists: 24 textures of 4096x4096, PNG and JPEG, on a grid of triangles.
"""

import argparse
import io
import json
import os
import resource
import struct
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np
import PIL.Image

_SIDE, _TEXTURES = 4096, 24
_NOISE = 3
"""Bits of noise in a colour, which the size of the file depends on."""


def made(folder: Path, side: int = _SIDE, count: int = _TEXTURES) -> Path:
    """The file with large textures."""
    path = folder / "large_textures.glb"
    if path.exists():
        return path
    binary, views = bytearray(), []

    def view(content: bytes) -> int:
        binary.extend(b"\0" * (-len(binary) % 4))
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(content)})
        binary.extend(content)
        return len(views) - 1

    corners = np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    accessors = [
        {"bufferView": view(corners.tobytes()), "componentType": 5126, "count": 3, "type": "VEC3"},
        {"bufferView": view(corners[:, :2].tobytes()), "componentType": 5126, "count": 3, "type": "VEC2"},
    ]
    accessors[0] |= {"min": [0, 0, 0], "max": [1, 1, 0]}
    images = []
    for number in range(count):
        noise = np.random.default_rng(number).integers(0, 1 << _NOISE, (side, side, 3), np.uint8)
        ramp = (np.arange(side) >> 4).astype(np.uint8)[None, :, None]
        stream = io.BytesIO()
        kind, options = ("JPEG", {"quality": 90}) if number % 3 else ("PNG", {"compress_level": 1})
        PIL.Image.fromarray(noise + ramp // 2).save(stream, kind, **options)
        images.append({"bufferView": view(stream.getvalue()), "mimeType": f"image/{kind.lower()}"})
    attributes = {"POSITION": 0, "TEXCOORD_0": 1}
    root = {
        "asset": {"version": "2.0"},
        "images": images,
        "textures": [{"source": row} for row in range(count)],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": row}}} for row in range(count)],
        "meshes": [{"primitives": [{"attributes": attributes, "material": row}]} for row in range(count)],
        "nodes": [{"mesh": row, "translation": [row, 0, 0]} for row in range(count)],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(binary)}],
    }
    text = json.dumps(root).encode()
    text += b" " * (-len(text) % 4)
    binary.extend(b"\0" * (-len(binary) % 4))
    size = 12 + 16 + len(text) + len(binary)
    chunks = struct.pack("<2I", len(text), 0x4E4F534A) + text + struct.pack("<2I", len(binary), 0x004E4942)
    path.write_bytes(b"glTF" + struct.pack("<2I", 2, size) + chunks + binary)
    return path


def resident() -> float:
    """MB of this process that are in memory now."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 1e6


def peak() -> float:
    """Most MB of this process that were in memory since `forget_peak`."""
    status = Path("/proc/self/status").read_text()
    return int(status.partition("VmHWM:")[2].split()[0]) * 1024 / 1e6


def forget_peak() -> None:
    """Start anew."""
    Path("/proc/self/clear_refs").write_text("5")


def load_one(path: Path) -> None:
    """Print what loading a file takes, as JSON."""
    import pica

    warnings.simplefilter("ignore")
    with tempfile.TemporaryDirectory() as folder:
        pica.load(made(Path(folder), side=16, count=2))  # which brings in the libraries
    before = resident()
    forget_peak()
    cores, start = time.process_time(), time.perf_counter()
    scene = pica.load(path)
    seconds, busy = time.perf_counter() - start, time.process_time() - cores
    values = {"seconds": seconds, "cores": busy / seconds, "stays": resident() - before, "peak": peak() - before}
    print(json.dumps(values | {"triangles": scene.triangle_count()}))


def main() -> None:
    """Print a line for each file."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", type=Path)
    parser.add_argument("--made", type=Path)
    parser.add_argument("--one", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one is not None:
        load_one(arguments.one)
        return
    files = [*arguments.files, *([made(arguments.made)] if arguments.made is not None else [])]
    print(f"{os.cpu_count()} cores")
    for path in files:
        run = [sys.executable, __file__, "--one", str(path)]
        values = json.loads(subprocess.run(run, capture_output=True, text=True, check=True).stdout)
        print(
            f"{path.name}: {path.stat().st_size / 1e6:.1f} MB, {values['triangles']:,} triangles, "
            f"{values['seconds']:.2f} s on {values['cores']:.2f} cores, {values['stays']:.0f} MB stay, "
            f"peak {values['peak'] / max(values['stays'], 1):.2f} times that"
        )


if __name__ == "__main__":
    main()

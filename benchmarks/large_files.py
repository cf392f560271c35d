"""A glTF file of many nodes that show one mesh: what loading it, making a renderer and a picture cost.

    PYTHONPATH=. python benchmarks/large_files.py [--nodes 100000]

Prints processor seconds and resident memory (Linux). Ends where the process has more than 6 GB.
"""

import argparse
import base64
import json
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np

import pica
from benchmarks.endurance import resident
from pica.rhi.device import open_device

ALLOWED = 6000  # MB
_Result = TypeVar("_Result")


def write(path: Path, count: int) -> None:
    """One triangle, `count` times."""
    data = np.eye(3, dtype=np.float32).tobytes() + np.arange(3, dtype=np.uint16).tobytes()
    places = np.random.default_rng(1).uniform(-100, 100, (count, 3)).round(3).tolist()
    accessor = {"count": 3, "bufferView": 0, "componentType": 5126, "type": "VEC3", "min": [0] * 3, "max": [1] * 3}
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": list(range(count))}],
        "nodes": [{"mesh": 0, "translation": place} for place in places],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [accessor, {"count": 3, "bufferView": 1, "componentType": 5123, "type": "SCALAR"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 6}],
        "buffers": [{"byteLength": len(data), "uri": f"data:;base64,{base64.b64encode(data).decode()}"}],
    }
    path.write_text(json.dumps(document))


def timed(what: str, call: Callable[[], _Result]) -> _Result:
    """Print what a call costs."""
    begun = time.process_time()
    result = call()
    print(f"{what}: {time.process_time() - begun:.1f} s, {resident():.0f} MB", flush=True)
    if resident() > ALLOWED:
        sys.exit(f"more than {ALLOWED} MB")
    return result


def main() -> None:
    """Run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--nodes", type=int, default=100_000)
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "large.gltf")
        write(path, arguments.nodes)
        scene = timed("load", lambda: pica.load(path))
    timed("device", open_device)
    renderer = timed("renderer", lambda: pica.Renderer(scene, size=(32, 18)))
    for _ in range(2):
        timed("render(frames=1)", lambda: renderer.render(frames=1))


if __name__ == "__main__":
    main()

"""What loading a glTF file takes for each mesh, texture, animation channel and node of large ones.

    python benchmarks/loading.py [--scale 1] [--runs 3] [--only meshes,nodes] [--renderer]

Writes the files (JSON and one buffer) into a temporary folder, loads each `--runs` times and prints microseconds of
processor time an item, the least of the runs. A mesh has a node, a material, and accessors and buffer views of its own
for positions, normals, texture coordinates and indices. Textures are PNG pictures of 4x4, all different, with an image
each; what their materials take without them is subtracted. So are the nodes of channels, three each, whose samplers
have outputs of their own. `--scale` multiplies the numbers of items. `--renderer` times `pica.Renderer(scene)` too.
"""

import argparse
import gc
import io
import json
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

import pica

COUNTS = {"meshes": 20_000, "textures": 5_000, "channels": 100_000, "nodes": 200_000}
FLOAT, SHORT = 5126, 5123
KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}


class Writer:
    """A file in the making."""

    def __init__(self) -> None:
        self.json: dict[str, Any] = {"asset": {"version": "2.0"}, "accessors": [], "bufferViews": []}
        self._parts: list[bytes] = []
        self._length = 0
        self._random = np.random.default_rng(1)

    def view(self, content: bytes) -> int:
        """A buffer view of its own."""
        self._parts.append(content + b"\0" * (-len(content) % 4))
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": self._length, "byteLength": len(content)})
        self._length += len(self._parts[-1])
        return len(self.json["bufferViews"]) - 1

    def accessor(self, values: Any) -> int:
        """An accessor of its own, of floats or of 16-bit integers."""
        kind = SHORT if values.dtype == np.uint16 else FLOAT
        width = values.shape[1] if values.ndim == 2 else 1
        entry = {"bufferView": self.view(values.tobytes()), "componentType": kind, "count": len(values)}
        self.json["accessors"].append(entry | {"type": KINDS[width]})
        return len(self.json["accessors"]) - 1

    def floats(self, *shape: int) -> Any:
        """Random numbers of three digits."""
        return self._random.uniform(-1, 1, shape).round(3).astype(np.float32)

    def write(self, folder: Path, name: str) -> Path:
        """Write it."""
        (folder / f"{name}.bin").write_bytes(b"".join(self._parts))
        self.json["buffers"] = [{"uri": f"{name}.bin", "byteLength": self._length}]
        path = folder / f"{name}.gltf"
        path.write_text(json.dumps(self.json))
        return path


def quad(file: Writer) -> dict[str, Any]:
    """A primitive of two triangles."""
    attributes = {"POSITION": file.accessor(file.floats(4, 3)), "NORMAL": file.accessor(file.floats(4, 3))}
    attributes["TEXCOORD_0"] = file.accessor(file.floats(4, 2))
    return {"attributes": attributes, "indices": file.accessor(np.array([0, 1, 2, 0, 2, 3], np.uint16))}


def meshes(file: Writer, count: int) -> None:
    """Each with a material and a node."""
    file.json["materials"] = [
        {
            "name": f"material {number}",
            "doubleSided": True,
            "pbrMetallicRoughness": {
                "baseColorFactor": [*file.floats(3).clip(0, 1).tolist(), 1],
                "metallicFactor": 0,
                "roughnessFactor": 0.5,
            },
        }
        for number in range(count)
    ]
    file.json["meshes"] = [
        {"name": f"mesh {number}", "primitives": [quad(file) | {"material": number}]} for number in range(count)
    ]
    nodes(file, count)


def textures(file: Writer, count: int, textured: bool = True) -> None:
    """Four a material; one mesh for each of those."""
    pictures = np.random.default_rng(2).integers(0, 256, (count, 4, 4, 3), np.uint8)
    views = [file.view(_png(pixels)) for pixels in pictures]
    file.json["images"] = [{"bufferView": view, "mimeType": "image/png"} for view in views]
    file.json["samplers"] = [{"magFilter": 9729, "wrapS": 10497}]
    file.json["textures"] = [{"source": number, "sampler": 0} for number in range(count)]
    file.json["materials"] = [{"name": f"material {number}"} for number in range(count // 4)]
    for number, entry in enumerate(file.json["materials"]) if textured else ():
        first, second, third, fourth = ({"index": 4 * number + each} for each in range(4))
        pbr = {"baseColorTexture": first, "metallicRoughnessTexture": second}
        entry |= {"pbrMetallicRoughness": pbr, "occlusionTexture": third, "emissiveTexture": fourth}
    primitive = quad(file)
    file.json["meshes"] = [{"primitives": [primitive | {"material": number}]} for number in range(count // 4)]
    nodes(file, count // 4)


def plain(file: Writer, count: int) -> None:
    """The same without the textures."""
    textures(file, count, textured=False)


def channels(file: Writer, count: int) -> None:
    """Three a node, with outputs of their own."""
    still(file, count)
    times = file.accessor(np.arange(4, dtype=np.float32))
    widths = {"translation": 3, "rotation": 4, "scale": 3}
    samplers = [
        {"input": times, "output": file.accessor(file.floats(4, width)), "interpolation": "LINEAR"}
        for _ in range(count // 3)
        for width in widths.values()
    ]
    targets = [{"node": node, "path": path} for node in range(count // 3) for path in widths]
    moved = [{"sampler": number, "target": target} for number, target in enumerate(targets)]
    file.json["animations"] = [{"name": "all", "samplers": samplers, "channels": moved}]


def still(file: Writer, count: int) -> None:
    """The same without the channels."""
    nodes(file, count // 3)


def nodes(file: Writer, count: int) -> None:
    """Named, placed, ten below each of a tenth of them; with a mesh of their own, or one for all."""
    places, turns = file.floats(count, 3).tolist(), file.floats(count, 4).tolist()
    if "meshes" not in file.json:
        file.json["meshes"] = [{"primitives": [quad(file)]}]
    own = len(file.json["meshes"]) > 1
    file.json["nodes"] = [
        {"name": f"node {n}", "mesh": n if own else 0, "translation": places[n], "rotation": turns[n]}
        for n in range(count)
    ]
    parents = max(count // 11, 1)
    for parent in range(parents):
        below = list(range(parents + parent, count, parents))
        file.json["nodes"][parent] |= {"children": below} if below else {}
    file.json["scenes"] = [{"nodes": list(range(parents))}]


def timed(call: Callable[[], object], runs: int) -> float:
    """Seconds of processor time that it takes at least."""
    least = float("inf")
    for _ in range(runs):
        gc.collect()
        begun = time.process_time()
        kept = call()
        least = min(least, time.process_time() - begun)
        del kept
    return least


def main() -> None:
    """Run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scale", type=float, default=1.0)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--only", default=",".join(COUNTS))
    parser.add_argument("--renderer", action="store_true")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    makers = {"meshes": (meshes, None), "textures": (textures, plain), "channels": (channels, still)}
    for kind in arguments.only.split(","):
        count = int(COUNTS[kind] * arguments.scale)
        seconds = []
        for make in makers.get(kind, (nodes, None)):
            if make is None:
                continue
            with tempfile.TemporaryDirectory() as folder:
                file = Writer()
                make(file, count)
                path = file.write(Path(folder), "large")
                del file
                seconds.append(timed(lambda path=path: pica.load(path), arguments.runs))  # type: ignore[misc]
                if arguments.renderer and len(seconds) == 1:
                    scene = pica.load(path)
                    made = timed(lambda scene=scene: pica.Renderer(scene, size=(32, 18)), 1)  # type: ignore[misc]
                    print(f"{kind}: pica.Renderer takes {made / count * 1e6:.1f} us each")
        own = seconds[0] - sum(seconds[1:])
        print(
            f"{kind}: {own / count * 1e6:.1f} us each ({count:,} of them; the whole file {seconds[0]:.2f} s)",
            flush=True,
        )


def _png(pixels: Any) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "PNG")
    return stream.getvalue()


if __name__ == "__main__":
    main()

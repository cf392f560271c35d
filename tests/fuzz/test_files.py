"""Broken scenes, pictures and environments load or are refused with one line."""

import base64
import io
import json
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import pica
from pica.gpu_scene.memory_estimate import estimated_memory
from pica.scene.contents import contents
from tests.fuzz import whole_files
from tests.fuzz.mutations import NUMBERS, TEXTS, broken_bytes, broken_json
from tests.fuzz.outcome import held
from tests.scene.compressed_files import draco_bytes, draco_file, grid, meshopt_view
from tests.scene.gltf_files import GltfFile

CASES = sorted((Path(__file__).parent / "cases").iterdir())
LIMITS = pica.Limits(bytes=1 << 26, vertices=1 << 18, instances=1 << 16, pixels=1 << 20)


def document(file=None):
    file = file or whole_files.gltf()
    uri = "data:application/octet-stream;base64," + base64.b64encode(file.buffer).decode()
    return file.json | {"buffers": [{"uri": uri, "byteLength": len(file.buffer)}, *file.more_buffers]}


def loaded(path, environment=None):
    """Loaded, and asked for all that rendering and `pica info` would ask for."""
    scene = pica.load(path, environment=environment, limits=LIMITS)
    scene.default_camera(1.5)
    for time in (0.0, 0.3, 2.0):
        if scene.animations:
            scene.animate(time)
        for node in scene.nodes():
            assert np.isfinite(node.world).all()
    json.dumps(contents(scene) | vars(scene.source) | estimated_memory(scene))


def test_the_whole_files_are_good(tmp_path):
    loaded(whole_files.gltf().write(tmp_path))
    loaded(whole_files.compressed().write(tmp_path, "compressed.glb"))
    (tmp_path / "a.png").write_bytes(whole_files.picture("PNG"))
    for suffix, content in whole_files.other_formats().items():
        path = tmp_path / f"whole{suffix}"
        path.write_bytes(content)
        loaded(path)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_what_was_found_before(case):
    with held():
        if case.suffix in (".hdr", ".exr"):
            pica.load(case.parent / "plain.gltf", environment=case)
        else:
            loaded(case)


@given(st.data())
def test_json(tmp_path_factory, data):
    path = tmp_path_factory.getbasetemp() / "fuzzed.gltf"
    text = json.dumps(data.draw(broken_json(document())))
    path.write_text(text, "utf-8", "surrogatepass")
    with held():
        loaded(path)


@given(broken_bytes(whole_files.gltf().binary()))
def test_binary(tmp_path_factory, content):
    path = tmp_path_factory.getbasetemp() / "fuzzed.glb"
    path.write_bytes(content)
    with held():
        loaded(path)


def few(test):
    """A fourth of the examples: each starts a process."""
    return settings(max_examples=settings.default.max_examples // 4)(test)


@few
@given(st.data())
def test_json_of_compressed_files(tmp_path_factory, data):
    path = tmp_path_factory.getbasetemp() / "fuzzed.gltf"
    text = json.dumps(data.draw(broken_json(document(whole_files.compressed()))))
    path.write_text(text, "utf-8", "surrogatepass")
    with held():
        loaded(path)


@few
@given(st.data())
def test_other_formats(tmp_path_factory, data):
    suffix = data.draw(st.sampled_from(sorted(whole_files.other_formats())))
    path = tmp_path_factory.getbasetemp() / f"fuzzed{suffix}"
    path.write_bytes(data.draw(broken_bytes(whole_files.other_formats()[suffix])))
    with held():
        loaded(path)


@few
@given(st.data())
def test_parts_of_3mf(tmp_path_factory, data):
    """The XML inside, which broken bytes of the whole file seldom reach: its parts have checksums."""
    path = tmp_path_factory.getbasetemp() / "fuzzed.3mf"
    with zipfile.ZipFile(io.BytesIO(whole_files.other_formats()[".3mf"])) as whole:
        parts = {name: whole.read(name) for name in whole.namelist()}
    broken = data.draw(st.sampled_from(sorted(parts)))
    parts[broken] = data.draw(broken_bytes(parts[broken]))
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, content in parts.items():
            file.writestr(name, content)
    with held():
        loaded(path)


@given(st.data())
def test_look_up_tables(tmp_path_factory, data):
    path = tmp_path_factory.getbasetemp() / "fuzzed.cube"
    lines = whole_files.look_up_table().decode().splitlines()
    place = data.draw(st.integers(0, len(lines) - 1))
    lines[place] = data.draw(st.just(lines[place]) | broken_line(lines[place]))
    path.write_bytes(data.draw(broken_bytes("\n".join(lines).encode("utf-8", "surrogatepass"))))
    with held():
        pica.Lut.load(path)


def broken_line(line):
    """A line of which one word is another."""
    words = line.split()
    hostile = st.sampled_from([*map(str, NUMBERS), *TEXTS, "9" * 5000, "1_0", "\u0663", "0x3", "1e999"])
    return st.builds(
        lambda place, word: " ".join([*words[:place], word, *words[place + 1 :]]),
        st.integers(0, len(words) - 1),
        hostile,
    )


@few
@given(broken_bytes(whole_files.compressed().binary()))
def test_binary_of_compressed_files(tmp_path_factory, content):
    path = tmp_path_factory.getbasetemp() / "fuzzed.glb"
    path.write_bytes(content)
    with held():
        loaded(path)


MESH = grid(5)


@few
@given(broken_bytes(draco_bytes(*MESH)))
def test_draco(tmp_path_factory, content):
    path = draco_file(*MESH, content=content or b"\0").write(tmp_path_factory.getbasetemp(), "draco.glb")
    with held():
        loaded(path)


@given(st.data(), st.sampled_from(["ATTRIBUTES", "TRIANGLES", "INDICES"]), st.sampled_from(["EXT", "KHR"]))
def test_meshopt(tmp_path_factory, data, mode, prefix):
    attributes, triangles = MESH
    file = GltfFile()
    views = [
        meshopt_view(file, attributes["POSITION"], "ATTRIBUTES", version=int(prefix == "KHR"), prefix=prefix),
        meshopt_view(file, triangles.reshape(-1), "INDICES" if mode == "INDICES" else "TRIANGLES", prefix=prefix),
    ]
    positions = file.add("accessors", type="VEC3", componentType=5126, count=25, bufferView=views[0])
    order = file.add("accessors", type="SCALAR", componentType=5125, count=triangles.size, bufferView=views[1])
    file.mesh(positions, indices=order)
    name = f"{prefix}_meshopt_compression"
    extension = file.json["bufferViews"][views[mode != "ATTRIBUTES"]]["extensions"][name]
    start = extension["byteOffset"]
    broken = data.draw(broken_bytes(bytes(file.buffer[start : start + extension["byteLength"]])))
    extension |= {"byteOffset": len(file.buffer), "byteLength": len(broken)}
    file.buffer += broken
    path = file.write(tmp_path_factory.getbasetemp(), "meshopt.glb")
    with held():
        loaded(path)


KINDS = ["PNG", "JPEG", "WEBP", "AVIF", "DDS", "etc1s", "etc1s_alpha", "uastc", "uastc_zstandard", "plain"]
KINDS += ["blocks", "zstandard_blocks", "dds_blocks"]


@pytest.mark.parametrize("kind", KINDS)
@given(st.data())
def test_pictures(tmp_path_factory, kind, data):
    folder = tmp_path_factory.getbasetemp()
    (folder / "fuzzed.picture").write_bytes(data.draw(broken_bytes(whole_files.picture(kind))))
    file = document()
    file["images"][0] = {"uri": "fuzzed.picture"}
    (folder / "picture.gltf").write_text(json.dumps(file))
    with held():
        loaded(folder / "picture.gltf")


ENVIRONMENTS = {
    "hdr": whole_files.hdr,
    "exr": whole_files.exr,
    "ktx2": whole_files.cube_map,
    "png": lambda: whole_files.picture("PNG"),
}


@given(st.data(), st.sampled_from(sorted(ENVIRONMENTS)))
def test_environments(tmp_path_factory, data, kind):
    folder = tmp_path_factory.getbasetemp()
    whole = ENVIRONMENTS[kind]()
    path = folder / f"fuzzed.{kind}"
    path.write_bytes(data.draw(broken_bytes(whole)))
    with held():
        loaded(whole_files.gltf().write(folder), path)
    if kind == "exr":
        with held():
            pica.read_exr(path, limits=LIMITS)

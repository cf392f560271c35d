"""Broken scenes, pictures and environments load or are refused with one line."""

import base64
import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import pica
from tests.fuzz import whole_files
from tests.fuzz.mutations import broken_bytes, broken_json
from tests.fuzz.outcome import held

CASES = sorted((Path(__file__).parent / "cases").iterdir())
LIMITS = pica.Limits(bytes=1 << 26, vertices=1 << 18, instances=1 << 16, pixels=1 << 20)


def document():
    file = whole_files.gltf()
    uri = "data:application/octet-stream;base64," + base64.b64encode(file.buffer).decode()
    return file.json | {"buffers": [{"uri": uri, "byteLength": len(file.buffer)}]}


def loaded(path, environment=None):
    """Loaded, and asked for all that rendering would ask for."""
    scene = pica.load(path, environment=environment, limits=LIMITS)
    scene.default_camera(1.5)
    for time in (0.0, 0.3, 2.0):
        if scene.animations:
            scene.animate(time)
        for node in scene.nodes():
            assert np.isfinite(node.world).all()


def test_the_whole_file_is_good(tmp_path):
    loaded(whole_files.gltf().write(tmp_path))


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


@given(st.data(), st.sampled_from(["PNG", "JPEG", "WEBP"]))
def test_pictures(tmp_path_factory, data, kind):
    folder = tmp_path_factory.getbasetemp()
    (folder / "fuzzed.picture").write_bytes(data.draw(broken_bytes(whole_files.picture(kind))))
    file = document()
    file["images"][0] = {"uri": "fuzzed.picture"}
    (folder / "picture.gltf").write_text(json.dumps(file))
    with held():
        loaded(folder / "picture.gltf")


@given(st.data(), st.sampled_from(["hdr", "exr", "png"]))
def test_environments(tmp_path_factory, data, kind):
    folder = tmp_path_factory.getbasetemp()
    whole = {"hdr": whole_files.hdr, "exr": whole_files.exr, "png": lambda: whole_files.picture("PNG")}[kind]()
    path = folder / f"fuzzed.{kind}"
    path.write_bytes(data.draw(broken_bytes(whole)))
    with held():
        loaded(whole_files.gltf().write(folder), path)
    if kind == "exr":
        with held():
            pica.read_exr(path, limits=LIMITS)

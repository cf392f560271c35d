"""The loader against every file of the shared assets, whole and broken."""

import json
import re
import resource
import sys
import time
import warnings
from pathlib import Path
from typing import Any

import pytest

from pica.errors import SceneError
from pica.scene import gltf
from pica.scene.gltf.container import Document
from pica.scene.gltf.element import Element
from pica.scene.gltf.extensions import unsupported
from pica.scene.gltf.textures import Textures
from pica.scene.loading import load
from tests.assets import ASSETS, needs_assets

pytestmark = needs_assets

BROKEN = ASSETS / "invalid_glTF-Validator"
FILES = sorted(path for path in ASSETS.rglob("*") if path.suffix in (".gltf", ".glb"))
WHOLE_FILES = [path for path in FILES if BROKEN not in path.parents]
BROKEN_FILES = [path for path in FILES if BROKEN in path.parents]
LONGEST_SECONDS, MOST_BYTES = 10, 1 << 30


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("path", WHOLE_FILES, ids=lambda path: str(path.relative_to(ASSETS)))
def test_every_asset_loads(path: Path) -> None:
    missing = unsupported(Document(path).root.texts("extensionsRequired"))
    if missing:
        with pytest.raises(SceneError, match=re.escape(missing)):
            load(path)
        return
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        scene = load(path)
    ignored = [str(warning.message) for warning in caught if "ignores what is not supported" in str(warning.message)]
    used = unsupported(Document(path).root.texts("extensionsUsed"))
    assert ignored == ([f"{path}: ignores what is not supported: {used}"] if used else [])
    for node in scene.nodes():
        for section in node.mesh.sections if node.mesh else ():
            vertices = len(section.positions)
            for array in (section.normals, section.tangents, section.uv0, section.uv1, section.colors):
                assert len(array) == vertices
            assert section.indices.max() < vertices


def check_ends_well(path: Path) -> None:
    start = time.monotonic()
    try:
        load(path)
    except SceneError as error:
        assert str(error).startswith(str(path)) and "\n" not in str(error)
    assert time.monotonic() - start < LONGEST_SECONDS


def peak_memory() -> int:
    """Bytes that the process has held at most."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_every_broken_file_loads_or_ends_in_one_line_that_names_it() -> None:
    assert len(BROKEN_FILES) == 372
    before = peak_memory()  # of whatever ran before in this process
    for path in BROKEN_FILES:
        check_ends_well(path)
    assert peak_memory() - before < MOST_BYTES


def with_everything_in_use(document: dict[str, Any]) -> dict[str, Any]:
    """The broken files mostly leave their fault unused; this puts every mesh, camera, light and image to use."""

    def entries(array: str) -> int:
        found = document.get(array)
        return len(found) if isinstance(found, list) else 0

    lights = document.get("extensions", {}).get("KHR_lights_punctual", {}).get("lights", [])
    nodes = [{"mesh": i} for i in range(entries("meshes"))] + [{"camera": i} for i in range(entries("cameras"))]
    nodes += [{"extensions": {"KHR_lights_punctual": {"light": i}}} for i in range(len(lights))]
    materials = [*range(entries("materials")), None]
    primitives = [
        {"attributes": {"POSITION": i}, **({} if material is None else {"material": material})}
        for i in range(entries("accessors"))
        for material in materials
    ]
    extra = [{"primitives": [primitive]} for primitive in primitives]
    nodes += [{"mesh": entries("meshes") + i} for i in range(len(extra))]
    return document | {"nodes": nodes, "meshes": document.get("meshes", []) + extra, "scenes": [], "scene": None}


@pytest.mark.thorough
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_every_broken_part_ends_in_one_line_when_it_is_in_use(tmp_path: Path) -> None:
    refused = 0
    for path in BROKEN_FILES:
        try:
            changed = with_everything_in_use(json.loads(path.read_bytes()))
        except (ValueError, AttributeError, TypeError):  # not JSON at all, or not an object
            continue
        copy = tmp_path / path.name
        for i in range(len(changed["nodes"])):  # one at a time: the first fault ends the reading
            copy.write_text(json.dumps(changed | {"nodes": changed["nodes"][i : i + 1]}))
            try:
                gltf.read(copy)
            except SceneError as error:
                refused += 1
                assert str(error).startswith(str(copy)) and "\n" not in str(error)
    assert refused > 100


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_every_broken_picture_ends_in_one_line() -> None:
    refused = 0
    for path in (BROKEN / "base" / "data" / "image").glob("*.gltf"):
        document = json.loads(path.read_bytes())
        if not all(isinstance(image, dict) for image in document.get("images", [])):
            continue
        opened = Document(path)
        count = len(opened.entries("images"))
        opened.entries("textures")[:] = [Element({"source": i}, "textures", opened.root, i) for i in range(count)]
        textures = Textures(opened)
        for i in range(count):
            try:
                textures.get(Element({"info": {"index": i}}), "info")
            except SceneError as error:
                refused += 1
                assert "\n" not in str(error)
    assert refused >= 5


def test_flight_helmet_loads_fast() -> None:
    start = time.monotonic()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        scene = load(ASSETS / "FlightHelmet" / "FlightHelmet.gltf")
    assert scene.triangle_count() == 94722
    assert time.monotonic() - start < 3

import json
import re
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pica.errors import SceneError
from pica.scene.gltf import read
from tests.scene.gltf_files import GltfFile


def triangle() -> GltfFile:
    file = GltfFile()
    file.mesh()
    return file


def test_gltf_and_glb_hold_the_same(tmp_path: Path) -> None:
    text, binary = (read(triangle().write(tmp_path, name)) for name in ("a.gltf", "a.glb"))
    sections = [next(scene.nodes()).mesh.sections[0] for scene in (text, binary)]  # type: ignore[union-attr]
    np.testing.assert_array_equal(sections[0].positions, sections[1].positions)


@pytest.mark.parametrize("uri", ["my%20data.bin", "side/../my data.bin", "./my data.bin"])
def test_buffers_in_files(uri: str, tmp_path: Path) -> None:
    file = triangle()
    folder = tmp_path / "models"
    for other in (folder, tmp_path / "side"):
        other.mkdir()
    for target in (folder / "my data.bin", tmp_path / "side" / "data.bin"):
        target.write_bytes(file.buffer + b"more than byteLength says")
    file.json["buffers"] = [{"uri": uri, "byteLength": len(file.buffer)}]
    assert read(file.write(folder)).triangle_count() == 1


def test_a_byte_order_mark_does_no_harm(tmp_path: Path) -> None:
    path = triangle().write(tmp_path)
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    assert read(path).triangle_count() == 1


@pytest.mark.parametrize(
    ("buffer", "fault"),
    [
        ({"uri": "gone.bin", "byteLength": 36}, r"buffers\[0\].uri: 'gone.bin': no such file"),
        ({"uri": "short.bin", "byteLength": 36}, r"buffers\[0\]: holds 5 bytes where byteLength says 36"),
        ({"uri": ".", "byteLength": 36}, "not a file"),
        ({"uri": "a\0b", "byteLength": 36}, "is not a path"),
        ({"uri": "file:///etc/passwd", "byteLength": 36}, "is not a path relative to the file"),
        ({"uri": "data:;base64,QUJD", "byteLength": 36}, "holds 3 bytes where byteLength says 36"),
        ({"uri": 7, "byteLength": 36}, r"buffers\[0\].uri: 7 is not text"),
        ({"byteLength": 36}, "has neither a uri nor a binary chunk"),
        ({"uri": "short.bin", "byteLength": -1}, "byteLength: -1 is not a whole number"),
    ],
)
def test_faults_of_buffers_are_named(buffer: dict[str, Any], fault: str, tmp_path: Path) -> None:
    (tmp_path / "short.bin").write_bytes(b"12345")
    file = triangle()
    file.json["buffers"] = [buffer]
    with pytest.raises(SceneError, match=f"model.gltf: .*{fault}"):
        read(file.write(tmp_path))


BINARY = triangle().binary()


@pytest.mark.parametrize("content", [b"# Blender\nv 0 0 0\n", b"Kaydara FBX Binary \x00\xff"])
def test_other_kinds_of_files_are_told_what_is_read(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "model.fbx"
    path.write_bytes(content)
    with pytest.raises(SceneError, match=r"model.fbx: of no format that is read \(\.gltf, \.glb, \.obj, "):
        read(path)


@pytest.mark.parametrize(
    ("content", "fault"),
    [
        (b"", "neither binary glTF nor JSON"),
        (b"\x89PNG\r\n\x1a\n", "neither binary glTF nor JSON text"),
        (b"{", "neither binary glTF nor JSON"),
        (b"[1]", r"its JSON is not an object but \[1\]"),
        (b"{}", "asset.version: is missing"),
        (b'{"asset": {"version": "1.0"}}', "asset.version: '1.0' is not glTF 2"),
        (b'{"asset": {"version": "2.0", "minVersion": "2.9"}}', "asset.minVersion: '2.9' is newer"),
        (b'{"asset": {"version": "2.0"}, "nodes": {}}', "nodes: {} is not an array"),
        (b'{"asset": {"version": "2.0"}, "nodes": [7]}', r"nodes\[0\]: 7 is not an object"),
        (b'{"asset":' * 100000, "its JSON is nested too deeply"),
        (b'{"asset": ' + b"1" * 5000 + b"}", "neither binary glTF nor JSON"),
        (b"glTF", "truncated at 4 bytes"),
        (BINARY[:-4], "truncated"),
        (BINARY[:8] + b"\x18\0\0\0" + BINARY[12:], "truncated at 24 bytes"),
        (BINARY[:20] + b"!" + BINARY[21:], "its first chunk is not JSON"),
        (BINARY.replace(b"BIN\0", b"EXTR"), r"buffers\[0\]: has neither a uri nor a binary chunk"),
        (BINARY[:4] + b"\1\0\0\0" + BINARY[8:], "binary glTF of version 1"),
        (BINARY[:16] + b"BIN\0" + BINARY[20:], "binary glTF that does not begin with a JSON chunk"),
    ],
)
def test_broken_files_end_in_one_line(content: bytes, fault: str, tmp_path: Path) -> None:
    path = tmp_path / "model.gltf"
    path.write_bytes(content)
    with pytest.raises(SceneError, match=f"model.gltf: {fault}") as caught:
        read(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("depth", [90, 400, 700, 900, 950, 990, 5000])
@pytest.mark.parametrize("key", ["extras", "nodes", "asset", "meshes", "scene"])
def test_json_of_any_depth_loads_or_ends_in_one_line(key: str, depth: int, tmp_path: Path) -> None:
    deep = "[" * depth + "]" * depth
    path = tmp_path / "model.gltf"
    path.write_text(json.dumps(triangle().json)[:-1].replace(f'"{key}"', '"instead"') + f', "{key}": {deep}}}')
    try:
        read(path)
    except SceneError as error:
        assert re.search(
            rf"model.gltf: ({key}[\w.\[\]]*: .* not |its JSON is nested too deeply|\w+: is missing|.*buffer)",
            str(error),
        )
        assert len(str(error)) < 300


@pytest.mark.parametrize(
    "number",
    ["1" * 4300, "-" + "1" * 4300, "1e999999999", "0." + "3" * 10**6, "1" * 10**6, "NaN", "-Infinity", "1e-9999999"],
)
def test_numbers_of_any_length_take_no_time(number: str, tmp_path: Path) -> None:
    start = time.process_time()
    for key in ("scale", "mesh"):
        path = tmp_path / "model.gltf"
        path.write_text(
            f'{{"asset": {{"version": "2.0"}}, "nodes": [{{"{key}": [{number}, 1, 1]}}, {{"mesh": {number}}}]}}'
        )
        with pytest.raises(
            SceneError, match=r"model.gltf: (nodes\[\d\]\.(scale\[0\]|mesh|scale): |neither binary)"
        ) as caught:
            read(path)
        assert len(str(caught.value)) < 400
    assert time.process_time() - start < 2


def test_there_is_an_end_to_warnings(tmp_path: Path) -> None:
    file = triangle()
    for _ in range(100):
        texture = {"index": file.add("textures")}
        file.mesh(0, material=file.add("materials", emissiveTexture=texture))
    with pytest.warns(UserWarning) as caught:
        read(file.write(tmp_path))
    assert len(caught) == 21 and str(caught[-1].message).endswith("further warnings are left out")


def test_names_of_extensions_are_shown_in_part_and_without_control_characters(tmp_path: Path) -> None:
    file = triangle()
    file.json["extensionsUsed"] = ["\x1b[31mred\n", "y" * 10**6, *map(str, range(1000))]
    with pytest.warns(UserWarning) as caught:
        read(file.write(tmp_path))
    message = str(caught[0].message)
    assert message.isprintable() and len(message) < 2000 and message.endswith(" and 990 more")


def test_missing_file_and_folder(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"nowhere.gltf: the file: no such file"):
        read(tmp_path / "nowhere.gltf")
    with pytest.raises(SceneError, match="not a file"):
        read(tmp_path)


def test_a_required_extension_that_is_not_supported_is_an_error(tmp_path: Path) -> None:
    file = triangle()
    file.json |= {
        "extensionsRequired": ["KHR_mesh_other"],
        "extensionsUsed": ["KHR_mesh_other"],
    }
    with pytest.raises(SceneError, match=r"model.gltf: needs KHR_mesh_other, which is not supported"):
        read(file.write(tmp_path))


def test_used_extensions_that_are_not_supported_are_one_warning(tmp_path: Path) -> None:
    file = triangle()
    file.json["extensionsUsed"] = [
        "KHR_mesh_other",
        "KHR_texture_transform",
        "KHR_materials_variants_other",
    ]
    with pytest.warns(UserWarning) as caught:
        read(file.write(tmp_path))
    assert len(caught) == 1
    assert str(caught[0].message).endswith("not supported: KHR_mesh_other, KHR_materials_variants_other")


def test_extensions_that_the_file_does_not_list_are_named_too(tmp_path: Path) -> None:
    file = triangle()
    file.json["extensionsUsed"] = ["KHR_audio", "KHR_materials_unlit"]
    file.json["extensions"] = {"KHR_audio": {"audio": [{"name": "red"}]}}
    file.json["meshes"][0]["primitives"][0]["extensions"] = {"KHR_mesh_other": {"bufferView": 0}}
    material = {"clearcoatTexture": {"index": 0, "extensions": {"EXT_inner": {}}}}
    file.add("materials", extensions={"KHR_materials_another": {}, "KHR_materials_other": material})
    file.json["nodes"][0]["extras"] = {"extensions": {"mine": {}}}
    with pytest.warns(UserWarning) as caught:
        read(file.write(tmp_path))
    assert len(caught) == 1
    named = str(caught[0].message).partition("not supported: ")[2].split(", ")
    others = "KHR_mesh_other", "KHR_materials_another", "KHR_materials_other", "EXT_inner"
    assert named[0] == "KHR_audio" and sorted(named[1:]) == sorted(others)


def test_a_file_that_shows_nothing_says_so(tmp_path: Path) -> None:
    path = tmp_path / "empty.gltf"
    path.write_text(json.dumps({"asset": {"version": "2.0"}}))
    with pytest.warns(UserWarning, match=r"empty.gltf: shows nothing"):
        read(path)


def test_animations_skins_and_morph_targets_do_not_hinder(tmp_path: Path) -> None:
    file = triangle()
    file.json["meshes"][0]["primitives"][0]["targets"] = [{"POSITION": 0}]
    file.json["nodes"][0] |= {"skin": 0}
    file.add("skins", joints=[0])
    file.add(
        "animations", channels=[{"sampler": 0, "target": {"path": "translation"}}], samplers=[{"input": 0, "output": 0}]
    )
    assert read(file.write(tmp_path)).triangle_count() == 1

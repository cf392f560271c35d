"""`pica info`: what files of each format hold."""

import io
import json
from functools import reduce

import numpy as np
import PIL.Image
import pytest

import pica
from tests.scene import mesh_files
from tests.scene.gltf_files import GltfFile

pytestmark = pytest.mark.filterwarnings("ignore:.*(EXT_unknown|MSFT_lod|neutral sky)")


def png(width, height):
    content = io.BytesIO()
    PIL.Image.fromarray(np.zeros((height, width, 4), np.uint8)).save(content, "PNG")
    return content.getvalue()


def described_file(**asset):
    """A file with a light, a camera, a texture, metadata, and two instances of a triangle."""
    file = GltfFile()
    image = file.add("images", bufferView=file.view(png(8, 4)), name="wood")
    texture = file.add("textures", source=image)
    material = file.add("materials", pbrMetallicRoughness={"baseColorTexture": {"index": texture}})
    file.mesh(material=material)
    file.add("nodes", mesh=0, translation=[5, 0, 0])
    file.add("nodes", extensions={"KHR_lights_punctual": {"light": 0}})
    file.add("cameras", type="perspective", perspective={"yfov": 1, "znear": 0.1}, name="front")
    file.add("nodes", camera=0)
    file.json["extensions"] = {
        "KHR_lights_punctual": {"lights": [{"type": "spot"}]},
        "KHR_xmp_json_ld": {"packets": [{}, {"dc:title": "Two triangles"}]},
    }
    file.json["asset"] |= {"copyright": "2026 Ada", "extensions": {"KHR_xmp_json_ld": {"packet": 1}}} | asset
    file.json["extensionsUsed"] = ["KHR_lights_punctual", "MSFT_lod", "EXT_unknown"]
    return file


def test_what_a_gltf_file_holds(run, tmp_path):
    path = described_file(generator="by hand").write(tmp_path)
    code, out, err = run("info", path, "--json")
    held = json.loads(out)
    assert (code, err) == (0, "")
    expected = {
        "format": "glTF 2.0",
        "bytes": path.stat().st_size,
        "copyright": "2026 Ada",
        "generator": "by hand",
        "xmp": {"dc:title": "Two triangles"},
        "extensions": {
            "EXT_unknown": "ignored: not supported",
            "KHR_lights_punctual": "supported",
            "KHR_xmp_json_ld": "supported",
            "MSFT_lod": "ignored: the finest level of detail is shown",
        },
        "size": [6, 1, 0],
        "nodes": 4,
        "meshes": 1,
        "instances": 2,
        "vertices": 3,
        "triangles": 1,
        "triangles_shown": 2,
        "materials": 1,
        "textures": [{"name": "wood", "width": 8, "height": 4, "file_format": "PNG", "device_format": "RGBA8"}],
        "lights": {"spot": 1},
        "environment": None,
        "cameras": ["front"],
        "warnings": [
            "ignores what is not supported: EXT_unknown",
            "ignores MSFT_lod: the finest level of detail is shown",
        ],
    }
    assert {key: held[key] for key in expected} == expected
    memory = held["device_memory"]
    assert memory["textures"] == 4 * (8 * 4 + 4 * 2 + 2 + 1)
    assert memory["total"] == sum(memory.values()) - memory["total"]


def test_its_text(run, tmp_path):
    code, out, _ = run("info", described_file(copyright="\x1b[31m2026\nAda").write(tmp_path))
    lines = {line.partition("  ")[0] or line.strip().partition("  ")[0]: line for line in out.splitlines()}
    assert code == 0 and all(line.isprintable() for line in out.splitlines())
    assert lines["copyright"].split(maxsplit=1)[1] == r"\x1b[31m2026\nAda"
    assert "  wood  " in out and "8x4, PNG, RGBA8 on the device" in out
    assert lines["triangles shown"].split() == ["triangles", "shown", "2"]
    assert lines["lights"].split() == ["lights", "1", "spot"]
    assert out.endswith("warning: ignores MSFT_lod: the finest level of detail is shown\n")


def test_a_refused_file_is_told_as_far_as_it_can_be_read(run, tmp_path):
    file = described_file()
    file.json["extensionsRequired"] = ["EXT_unknown"]
    code, out, err = run("info", file.write(tmp_path), "--json")
    held = json.loads(out)
    assert code == 2 and "needs EXT_unknown, which is not supported" in err
    assert held["extensions"]["EXT_unknown"] == "refused: required and not supported"
    assert held["copyright"] == "2026 Ada" and "triangles" not in held


@pytest.mark.parametrize("name", ["missing.glb", "broken.glb", "missing.obj"])
def test_a_file_that_cannot_be_read_is_one_line(run, name, tmp_path):
    if name == "broken.glb":
        (tmp_path / name).write_bytes(b"glTF" + bytes(20))
    code, out, err = run("info", tmp_path / name)
    assert (code, out) == (2, "") and name in err and err.count("\n") == 1


@pytest.mark.parametrize("name", ["shape.obj", "shape.ply", "shape.stl", "shape.3mf", "shape.dae"])
def test_meshes_of_other_formats(run, name, tmp_path):
    pytest.importorskip("collada" if name.endswith("dae") else "networkx")
    shape = mesh_files.cube()
    code, out, _ = run("info", mesh_files.write(tmp_path, name, shape), "--json")
    held = json.loads(out)
    assert code == 0 and held["triangles"] == len(shape.triangles)
    assert held["format"] == name.rpartition(".")[2].upper() and held["extensions"] == {}


def test_who_made_a_collada_file(tmp_path):
    pytest.importorskip("collada")
    path = mesh_files.write(tmp_path, "shape.dae", mesh_files.cube())
    text = path.read_text()
    start = text.index("<asset>") + len("<asset>")
    about = "<contributor><authoring_tool>A &amp; B</authoring_tool><copyright> 2026 Ada</copyright></contributor>"
    path.write_text(text[:start] + about + text[start:])
    source = pica.load(path).source
    assert (source.copyright, source.generator) == ("2026 Ada", "A & B")


def test_a_usd_file(run, tmp_path):
    usd_files = pytest.importorskip("tests.scene.usd_files")
    from pxr import UsdGeom

    stage = usd_files.stage(tmp_path / "stage.usda")
    UsdGeom.Cube.Define(stage, "/World/cube")
    stage.GetRootLayer().customLayerData = {"copyright": "2026 Ada", "creator": "by hand", "other": 1}
    code, out, _ = run("info", usd_files.saved(stage), "--json")
    held = json.loads(out)
    assert code == 0
    assert [held[key] for key in ("format", "copyright", "generator", "triangles")] == [
        "USDA",
        "2026 Ada",
        "by hand",
        12,
    ]


def test_a_built_in_scene(run):
    code, out, _ = run("info", "cornell", "--json")
    held = json.loads(out)
    assert code == 0 and "format" not in held and held["nodes"] == len(list(pica.scenes.cornell().nodes()))


def test_metadata_is_saved(tmp_path):
    loaded = pica.load(described_file().write(tmp_path))
    loaded.save(tmp_path / "saved.glb")
    source = pica.load(tmp_path / "saved.glb").source
    assert (source.copyright, source.generator) == ("2026 Ada", "pica")
    assert source.xmp == {"dc:title": "Two triangles"}


DEEP = reduce(lambda below, _: {"a": [below]}, range(100), {})


@pytest.mark.parametrize("packet", [DEEP, [1], "text", None])
def test_metadata_of_other_forms_is_left_out(packet, tmp_path):
    file = described_file(copyright=3, extensions={"KHR_xmp_json_ld": {"packet": 0}})
    file.json["extensions"]["KHR_xmp_json_ld"]["packets"] = [packet]
    source = pica.load(file.write(tmp_path)).source
    assert source.xmp == {} and source.copyright == ""


def test_the_memory_of_a_scene_is_about_what_a_device_takes(device):
    from pica.gpu_scene.gpu_scene import GpuScene
    from pica.gpu_scene.memory_estimate import estimated_memory

    scene = pica.scenes.corridor()
    before = device.memory
    gpu_scene = GpuScene.of(device, scene)
    taken = device.memory - before
    assert gpu_scene.source is scene
    assert 0.7 * taken < sum(estimated_memory(scene).values()) < 1.2 * taken

"""OBJ, PLY, STL, 3MF and COLLADA: what is read of them."""

import io
import math
import sys
import warnings
from pathlib import Path

import numpy as np
import PIL.Image
import pytest

import pica
from pica.errors import SceneError
from pica.scene.conversion import formats
from tests.scene import mesh_files
from tests.scene.mesh_files import cube, sphere

SKY = pica.Environment(np.ones((2, 4, 3)))


def load(path: Path, **options: object) -> pica.Scene:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return pica.load(path, environment=SKY, **options)  # type: ignore[arg-type]


def only_section(scene: pica.Scene) -> pica.Section:
    ((section,),) = [node.mesh.sections for node in scene.nodes() if node.mesh]
    return section


def write(path: Path, content: str | bytes) -> Path:
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def picture(color: tuple[int, ...], kind: str = "PNG") -> bytes:
    content = io.BytesIO()
    PIL.Image.new("RGB", (2, 2), color).save(content, kind)
    return content.getvalue()


@pytest.mark.parametrize("name", ["a.obj", "a.ply", "a.stl", "a.3mf", "a.dae", "A.OBJ"])
def test_positions_are_in_metres(name: str, tmp_path: Path) -> None:
    shape = cube()
    path = tmp_path / name
    mesh_files.write(tmp_path, name.lower(), shape).rename(path)
    low, high = load(path, up="y").bounds()
    np.testing.assert_allclose(low, shape.positions.min(axis=0), atol=1e-6)
    np.testing.assert_allclose(high, shape.positions.max(axis=0), atol=1e-6)


@pytest.mark.parametrize("name, up", [("a.obj", "y"), ("a.ply", "y"), ("a.stl", "z"), ("a.3mf", "z"), ("a.dae", "y")])
def test_the_up_axis_is_that_of_the_format_unless_it_is_given(name: str, up: str, tmp_path: Path) -> None:
    path = mesh_files.write(tmp_path, name, cube())
    as_given = {axis: load(path, up=axis).bounds()[1] for axis in ("y", "z")}
    np.testing.assert_allclose(load(path).bounds()[1], as_given[up])
    np.testing.assert_allclose(as_given["y"], [0.5, 0.825, 0.375], atol=1e-6)
    np.testing.assert_allclose(as_given["z"], [0.5, 0.375, 0.425], atol=1e-6)


def test_up_axis_and_unit_of_collada_are_those_of_the_file(tmp_path: Path) -> None:
    content = mesh_files.collada(cube())
    assert b"<up_axis>Y_UP" in content
    content = content.replace(b"<up_axis>Y_UP", b'<unit meter="0.5"/><up_axis>Z_UP')
    high = load(write(tmp_path / "a.dae", content)).bounds()[1]
    np.testing.assert_allclose(high, np.array([0.5, 0.375, 0.425]) / 2, atol=1e-6)


def test_the_unit_of_3mf_is_that_of_the_file(tmp_path: Path) -> None:
    path = write(tmp_path / "a.3mf", mesh_files.threemf(cube(), "meter"))
    np.testing.assert_allclose(load(path, up="y").bounds()[1], [0.5, 0.825, 0.375], atol=1e-6)


def test_normals_are_flat_unless_the_file_has_others(tmp_path: Path) -> None:
    shape = sphere()
    flat, group = mesh_files.obj(shape, normals=False), mesh_files.obj(shape, before="s 1", normals=False)
    assert only_section(load(write(tmp_path / "flat.obj", flat))).flat
    assert only_section(load(write(tmp_path / "off.obj", flat.replace("\nf", "\ns off\nf", 1)))).flat
    assert only_section(load(mesh_files.write(tmp_path, "a.stl", shape))).flat
    for name, content in (("smooth.obj", group), ("a.obj", mesh_files.obj(shape)), ("a.ply", mesh_files.ply(shape))):
        section = only_section(load(write(tmp_path / name, content)))
        outwards = section.positions / np.linalg.norm(section.positions, axis=1, keepdims=True)
        np.testing.assert_allclose(section.normals, outwards, atol=0.02)


@pytest.mark.parametrize("binary", [True, False])
def test_colors_of_vertices_are_decoded(binary: bool, tmp_path: Path) -> None:
    shape = sphere()
    section = only_section(load(write(tmp_path / "a.ply", mesh_files.ply(shape, colors=True, binary=binary))))
    np.testing.assert_allclose(section.colors[:, :3], mesh_files.linear(shape.colors), atol=1e-6)
    assert section.material.metallic == 0


def test_polygons_are_fans_and_indices_may_count_from_the_end(tmp_path: Path) -> None:
    text = "v 0 0 0\nv 1 0 0\nv 2 1 0\nv 1 2 0\nv 0 1 0\nf 1 2 3 4 5\nf -5 -4 -3 -2\n"
    section = only_section(load(write(tmp_path / "a.obj", text)))
    corners = section.positions[section.indices]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    assert len(section.indices) == 5 and area == pytest.approx(2.5 + 2.0)


@pytest.mark.parametrize("relative", [False, True])
def test_polygons_that_are_not_convex_are_not_fans(relative: bool, tmp_path: Path) -> None:
    places = [(0, 0), (7, 0), *((7 - x, 3 - 2 * (x % 2)) for x in range(8))]
    rows = [str(row - 10) if relative else f"{row + 1}/1" for row in range(10)]
    text = "vt 0 0\n" + "".join(f"v {x} {y} 0\n" for x, y in places) + f"f {' '.join(rows)}\r\nv 9 9 9\n"
    section = only_section(load(write(tmp_path / "a.obj", text)))
    corners = section.positions[section.indices]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (normals[:, 2] >= 0).all() and normals[:, 2].sum() / 2 == pytest.approx(7 + 7)


def test_indices_count_back_from_their_own_line(tmp_path: Path) -> None:
    """Each object's faces follow its vertices, as exporters write them that have no count of all."""
    text = ""
    for x in (0, 10):
        text += f"o at{x}\nv {x} 0 0\nv {x + 1} 0 0\nv {x} 1 0\nvt 0 {x / 10}\nvn 0 0 1\nf -3/-1/-1 -2/-1/-1 -1/-1/-1\n"
    scene = load(write(tmp_path / "a.obj", text))
    for x in (0, 10):
        (section,) = next(node for node in scene.nodes() if node.name == f"at{x}").mesh.sections  # type: ignore[union-attr]
        assert sorted(section.positions[:, 0].tolist()) == [x, x, x + 1] and section.uv0[0, 1] == 1 - x / 10


MTL = """newmtl painted
Kd 0.1 0.2 0.3
Ke 0 2 4
Ns 30
Ni 1.4
d 0.5
map_Kd -s 1 1 1 my paint.png
newmtl metal
Kd 1 1 1
Pr 0.25
Pm 0.75
map_Pr rough.bmp
illum 2
"""


def test_materials_of_obj(tmp_path: Path) -> None:
    (tmp_path / "my paint.png").write_bytes(picture((10, 20, 30)))
    (tmp_path / "rough.bmp").write_bytes(picture((51, 0, 0), "BMP"))
    (tmp_path / "a.mtl").write_text(MTL)
    text = mesh_files.obj(cube(), "mtllib a.mtl", "o one\nusemtl painted")
    text += "o two\nusemtl metal\nf 1/1/1 2/2/2 3/3/3\n"
    with pytest.warns(UserWarning, match=r"a.obj: -s of map_kd is left out"):
        scene = pica.load(write(tmp_path / "a.obj", text), environment=SKY)
    materials = {node.mesh.sections[0].material.name: node for node in scene.nodes() if node.mesh}
    painted, metal = (materials[name].mesh.sections[0].material for name in ("painted", "metal"))
    assert painted.base_color == (0.1, 0.2, 0.3, 0.5) and painted.alpha_mode is pica.AlphaMode.BLEND
    assert painted.emission == (0, 2, 4) and painted.metallic == 0 and painted.ior == pytest.approx(1.4)
    assert painted.roughness**4 == pytest.approx(2 / 32)  # alpha^2 = 2 / (Ns + 2)
    assert painted.base_color_texture.image.pixels[0, 0].tolist() == [10, 20, 30, 255]
    packed = metal.metallic_roughness_texture.image.pixels[0, 0]
    assert packed[1] == 51 and packed[2] == round(0.75 * 255)
    assert (metal.metallic, metal.roughness) == (1, 1) and metal.alpha_mode is pica.AlphaMode.OPAQUE


@pytest.mark.parametrize("statement", ["mtllib one.mtl my two.mtl", "mtllib one.mtl\n mtllib\tmy two.mtl"])
def test_several_libraries_tabs_and_indents(statement: str, tmp_path: Path) -> None:
    (tmp_path / "one.mtl").write_text("newmtl\tred\n\tKd\t1 0 0\n")
    (tmp_path / "my two.mtl").write_text("  newmtl deep blue\n  Kd 0 0 1\n")
    text = f"{statement}\n\tv\t0 0 0\n v 1e0\t0 0\n\tv 0 1 0\n\tusemtl\tred\n\tf\t1 2\t3\n"
    text += " usemtl deep blue\n f 3 2 1\nl 1 2\np 1\n"
    scene = load(write(tmp_path / "a.obj", text))
    colors = {node.mesh.sections[0].material.base_color[:3] for node in scene.nodes() if node.mesh}
    assert colors == {(1, 0, 0), (0, 0, 1)}


def bumped(folder: Path, line: str) -> pica.Material:
    """The material of a cube with a line in its MTL file."""
    (folder / "a.mtl").write_text(f"newmtl m\n{line}\n")
    return only_section(load(write(folder / "a.obj", mesh_files.obj(cube(), "mtllib a.mtl", "usemtl m")))).material


def test_bumps_of_obj_are_normals_or_heights(tmp_path: Path) -> None:
    (tmp_path / "my normals.png").write_bytes(picture((128, 128, 255)))
    for line in ("map_Bump -bm 0.5 my normals.png", "bump my normals.png", "norm my normals.png"):
        material = bumped(tmp_path, line)
        assert material.normal_texture is not None and material.normal_scale == (0.5 if "-bm" in line else 1)
        assert material.normal_texture.image.pixels[0, 0].tolist() == [128, 128, 255, 255]
    side = 64
    heights = np.zeros((side, side), np.uint8)
    heights[:, :32] = 4 * np.arange(32)  # rises to the right, by 1 in 64 / 1.004 texels
    heights[:, 32:] = 4 * np.arange(32)[:, None][:32].repeat(2, axis=0)  # on the right it rises downwards
    PIL.Image.fromarray(heights).save(tmp_path / "heights.png")
    pixels = bumped(tmp_path, "map_Bump -bm 50 heights.png").normal_texture.image.pixels  # type: ignore[union-attr]
    normal = pixels[20, 10, :3] / 127.5 - 1
    slope = 4 / 255 * side * 0.5
    np.testing.assert_allclose(normal, np.array([-slope, 0, 1]) / np.hypot(slope, 1), atol=0.01)
    downwards = pixels[20, 48, :3] / 127.5 - 1
    assert downwards[1] > 0.2 and abs(downwards[0]) < 0.02  # v points up


def test_texture_coordinates_point_down(tmp_path: Path) -> None:
    shape = sphere()
    section = only_section(load(write(tmp_path / "a.obj", mesh_files.obj(shape))))
    np.testing.assert_allclose(section.uv0, section.positions[:, :2] * [1, -1] + [0.5, 0.5], atol=1e-6)


@pytest.mark.parametrize(
    ("name", "fault"),
    [("missing.png", "no such file"), ("../outside.png", "allow_outside"), ("/etc/hostname", "not a path relative")],
)
def test_textures_that_cannot_be_read_are_left_out(name: str, fault: str, tmp_path: Path) -> None:
    (tmp_path / "outside.png").write_bytes(picture((1, 2, 3)))
    folder = tmp_path / "folder"
    folder.mkdir()
    (folder / "a.mtl").write_text(f"newmtl m\nmap_Kd {name}\n")
    path = write(folder / "a.obj", mesh_files.obj(cube(), "mtllib a.mtl", "usemtl m"))
    with pytest.warns(UserWarning, match=f"map_kd: .*{fault}"):
        scene = pica.load(path, environment=SKY)
    assert only_section(scene).material.base_color_texture is None
    if "outside" in fault:
        assert only_section(load(path, allow_outside=True)).material.base_color_texture is not None


def test_limits_hold(tmp_path: Path) -> None:
    path = mesh_files.write(tmp_path, "a.ply", sphere())
    with pytest.raises(SceneError, match=r"a.ply: .*would take 162 vertices; the limit is 100 vertices"):
        load(path, limits=pica.Limits(vertices=100))
    with pytest.raises(SceneError, match=r"a.ply: .*the limit is"):
        load(path, limits=pica.Limits(bytes=1000))


def test_a_missing_library_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = mesh_files.write(tmp_path, "a.3mf", cube())
    monkeypatch.setattr(formats, "find_spec", lambda name: None if name == "lxml" else object())
    with pytest.raises(
        SceneError, match=r"""a.3mf: its format needs the extra 'meshes': pip install "pica\[meshes\]"$"""
    ):
        load(path)


def test_a_variant_is_none_of_these_formats(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="variant"):
        load(mesh_files.write(tmp_path, "a.stl", cube()), variant="red")


def zip_bomb() -> bytes:
    return mesh_files.packed({"3D/3dmodel.model": b"<model>" + b" " * 1_300_000_000})


def entities() -> bytes:
    nested = "".join(f'<!ENTITY e{i} "{f"&e{i - 1};" * 10}">' for i in range(1, 12))
    return f'<!DOCTYPE x [<!ENTITY e0 "0">{nested}]><COLLADA>&e11;</COLLADA>'.encode()


BROKEN = {
    "empty.obj": b"",
    "text.ply": b"ply\nformat ascii 1.0\nelement vertex 99999999999\nproperty float x\nend_header\n",
    "huge.ply": b"ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty double x\nend_header\n",
    "cut.stl": mesh_files.stl(cube())[:200],
    "far.obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n",
    "nan.obj": b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    "large.obj": b"v 1e300 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    "no.3mf": b"PK\3\4 not a zip",
    "empty.3mf": mesh_files.packed({}),
    "no.dae": b"<COLLADA",
    "entities.dae": entities(),
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_files_are_one_error(name: str, tmp_path: Path) -> None:
    path = write(tmp_path / name, BROKEN[name])
    with pytest.raises(SceneError, match=name) as caught:
        load(path)
    assert "Error" not in str(caught.value)


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have no limit on memory")
@pytest.mark.thorough
def test_archives_that_expand_end_at_the_limit(tmp_path: Path) -> None:
    path = write(tmp_path / "bomb.3mf", zip_bomb())
    with pytest.raises(SceneError, match=r"bomb.3mf: takes more memory to read than its bytes account for"):
        load(path)


def test_a_large_angle_of_polygons(tmp_path: Path) -> None:
    """Many corners, counted as such."""
    count = 1000
    corners = [
        f"v {math.cos(2 * math.pi * i / count):.9f} {math.sin(2 * math.pi * i / count):.9f} 0" for i in range(count)
    ]
    text = "\n".join([*corners, "f " + " ".join(str(i + 1) for i in range(count)), ""])
    section = only_section(load(write(tmp_path / "disk.obj", text)))
    assert len(section.indices) == count - 2

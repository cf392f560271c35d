"""Light maps in files, which may come from anybody."""

import time
import tracemalloc
import warnings
import zipfile
from io import BytesIO

import numpy as np
import pytest

import pica
from pica.light_map.bricks import CELLS, CORNERS, NOWHERE, bricks_around
from pica.light_map.fingerprint import content_of, layout_of
from pica.light_map.light_map import HARMONICS, SEEN_PER_BRICK, LightMap
from pica.scene.light import PointLight
from pica.scene.material import Image, Texture
from pica.scenes.basic_meshes import box
from pica.scenes.placing import move
from tests.building import checkered, lambert, placed, scene_of, shining, uniform


def a_scene(shade=0.5, place=(0, 0, 0), light=3.0, sky=0.5):
    return scene_of(
        placed(box(1, lambert(shade)), move(*place)), shining(PointLight(intensity=light)), environment=uniform(sky)
    )


@pytest.fixture(scope="module")
def light_map():
    random = np.random.default_rng(1)
    bricks = bricks_around(np.zeros(3), np.ones(3), 0.2, *[np.array([[[True, False]] * 2] * 2)] * 2)
    count = len(bricks.probes)
    seen = random.integers(0, 256, (len(bricks.places), SEEN_PER_BRICK), np.uint8)
    harmonics = random.normal(size=(count, HARMONICS, 3)).astype(np.float16)
    digests = content_of(a_scene()), layout_of(a_scene())
    return LightMap(bricks, 3.0, harmonics, random.random(count) < 0.5, seen, *digests)


MUTANTS = 600
HOSTILE = [0, -1, 1, 2**15, 2**22, 2**31 - 1, -(2**31), 1e-300, 1e36, 3e38, 1e308, np.nan, np.inf, -np.inf]
TEXTS = [
    b"",
    b"'",
    b"(",
    b"-1",
    b"9" * 20,
    b"9" * 4000,
    b"(" * 3000,
    b"\xff",
    b"\0",
    b"|O",
    b">f8",
    b"True",
    b", ",
    b"\\N{x}",
]


def npy(array) -> bytes:
    member = BytesIO()
    np.save(member, array)
    return member.getvalue()


def members_of(path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def write_members(path, members, way=None) -> None:
    """As pica compresses them, or all in one way."""
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in members.items():
            own = zipfile.ZIP_STORED if name == "harmonics.npy" else zipfile.ZIP_DEFLATED
            archive.writestr(name, content, own if way is None else way)


def forged(path, random, whole: bytes, members: dict[str, bytes]) -> None:
    """Write a file that is not quite the whole one."""
    pick = lambda items: items[random.integers(len(items))]  # noqa: E731
    kind = pick(["bytes", "directory", "header", "data", "numbers", "numbers", "ways"])
    content, changed = bytearray(whole), dict(members)
    name = pick(list(members))
    if kind in ("bytes", "directory"):
        start = 0 if kind == "bytes" else whole.rindex(b"PK\1\2") if random.random() < 0.5 else whole.index(b"PK\1\2")
        for place in random.integers(start, len(whole), pick([1, 2, 8])):
            content[place] = pick([0, 1, 0x7F, 0x80, 0xFF, content[place] ^ 1 << random.integers(8)])
        path.write_bytes(content)
        return
    member = changed[name]
    end = member.index(b"\n") + 1
    if kind == "header":
        place = int(random.integers(end))
        changed[name] = member[:place] + pick(TEXTS) + member[place + int(random.integers(4)) :]
    elif kind == "data":
        place = int(random.integers(end, len(member) + 1))
        changed[name] = member[:place] + random.bytes(random.integers(1, 9)) + member[place + int(random.integers(9)) :]
    elif kind == "numbers":
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            array = np.load(BytesIO(member)).copy()
            flat = array.reshape(-1)
            value = "\U0010ffff" * 32 if array.dtype.kind == "U" else np.array(pick(HOSTILE)).astype(array.dtype)
            flat[random.integers(flat.size) if random.random() < 0.5 else slice(None)] = value
        changed[name] = npy(array)
    write_members(path, changed, pick([None, 0, 8, 12, 14]) if kind == "ways" else None)


def test_a_file_holds_all_of_it(light_map, tmp_path):
    light_map.save(tmp_path / "a.lightmap")
    found = LightMap.load(tmp_path / "a.lightmap")
    for name in ("scale", "harmonics", "in_the_open", "seen", "content", "layout"):
        np.testing.assert_array_equal(getattr(found, name), getattr(light_map, name))
    for name in ("origin", "spacing", "size", "places", "probe_of", "positions"):
        np.testing.assert_array_equal(getattr(found.bricks, name), getattr(light_map.bricks, name))
    found.save(tmp_path / "b.lightmap")
    assert (tmp_path / "a.lightmap").read_bytes() == (tmp_path / "b.lightmap").read_bytes()


def test_broken_files_are_refused(light_map, tmp_path):
    """Cut short anywhere, or with any byte changed: an error of one line, or what it held is unharmed."""
    path = tmp_path / "a.lightmap"
    light_map.save(path)
    whole = path.read_bytes()
    refused = 0
    for place in np.random.default_rng(2).integers(0, len(whole), 60):
        path.write_bytes(whole[:place])
        with pytest.raises(pica.PicaError, match="lightmap"):
            LightMap.load(path)
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0x55]) + whole[place + 1 :])
        try:
            found = LightMap.load(path)
        except pica.PicaError:
            refused += 1
        else:
            np.testing.assert_array_equal(found.harmonics, light_map.harmonics)
    assert refused > 20, "bytes that nobody asks for may be anything"
    with pytest.raises(pica.PicaError, match="no such file"):
        LightMap.load(tmp_path / "missing.lightmap")


@pytest.mark.parametrize(
    ("name", "value", "fault"),
    [
        ("format", np.int32(99), "format 99"),
        ("spacing", np.float64(np.nan), "nowhere"),
        ("spacing", np.float64(0), "nowhere"),
        ("spacing", np.float64(1e-300), "nowhere"),
        ("origin", np.float64([0, 0, 1e300]), "nowhere"),
        ("size", np.int32([1 << 20, 1 << 20, 1 << 20]), "large"),
        ("size", np.int32([1 << 22, 1 << 22, 1 << 22]), "large"),  # 0 in 64 bits
        ("size", np.int32([1 << 8, 1 << 8, 1 << 8]), "room"),
        ("size", np.int32([0, 2, 2]), "large"),
        ("places", [0, 0, 0, 3], "level"),
        ("places", [0, 0, 0, -1], "level"),
        ("places", [1, 0, 0, 1], "not in its place"),
        ("places", [1 << 30, 0, 0, 0], "not in its place"),
        ("places", "twice", "twice"),
        ("places", np.zeros((0, 4), np.int32), "bricks"),
        ("places", np.zeros((1 << 20, 4), np.int32), "1048576 bricks"),
        ("places", np.int32([[0, 0, 0, 0]]), "probes"),
        ("harmonics", np.full((3, HARMONICS, 3), np.inf, np.float16), "probes"),
        ("scale", np.float32(1e36), "brighter"),
        ("content", np.array("a" * 31, "<U32"), "baked for"),
        ("harmonics", np.zeros((3, HARMONICS), np.float16), "<f2"),
        ("scale", np.float32(np.inf), "finite"),
        ("scale", np.float64(1), "<f8"),
        ("seen", None, "no array"),
    ],
)
def test_what_does_not_fit_together_is_refused(light_map, tmp_path, name, value, fault):
    path = tmp_path / "a.lightmap"
    light_map.save(path)
    members = members_of(path)
    if value is None:
        del members[f"{name}.npy"]
    else:
        if isinstance(value, list):  # one brick of the others
            value = np.int32([value, *light_map.bricks.places[1:]])
        elif isinstance(value, str):
            value = light_map.bricks.places[[0, 0, *range(2, len(light_map.bricks.places))]]
        members[f"{name}.npy"] = npy(value)
    write_members(path, members)
    with pytest.raises(pica.PicaError, match=fault):
        LightMap.load(path)


def test_pickles_are_refused(light_map, tmp_path):
    path = tmp_path / "a.lightmap"
    light_map.save(path)
    write_members(path, {**members_of(path), "harmonics.npy": npy(np.array([{}], object))})
    with pytest.raises(pica.PicaError, match=r"'harmonics' is .* of \|O"):
        LightMap.load(path)


def test_a_small_file_takes_little_memory(light_map, tmp_path):
    """Whatever it says that it has, and however well that compresses."""
    path = tmp_path / "a.lightmap"
    light_map.save(path)
    count = 1 << 11
    places = np.zeros((count, 4), np.int32)
    places[:, 0] = np.arange(count)
    probes = CORNERS * CORNERS * (CELLS * count + 1)
    much = {
        "size": np.int32([count, 1, 1]),
        "places": places,
        "harmonics": np.zeros((probes, HARMONICS, 3), np.float16),
        "in_the_open": np.zeros(probes, bool),
        "seen": np.zeros((count, SEEN_PER_BRICK), np.uint8),
    }
    whole = members_of(path)
    bomb = {**whole, **{f"{name}.npy": npy(array) for name, array in much.items()}}
    for way in (zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2):
        write_members(path, bomb, way)
        assert path.stat().st_size < 1e5
        tracemalloc.start()
        with pytest.raises(pica.PicaError, match="compressed in another way"):
            LightMap.load(path)
        assert tracemalloc.get_traced_memory()[1] < 2e6
        tracemalloc.stop()


def test_forged_files_are_refused_in_one_line_or_harmless(light_map, tmp_path):
    """Whatever is changed: bytes of the archive, of its members' headers and data, ways to compress, numbers."""
    path = tmp_path / "a.lightmap"
    small = bricks_around(np.zeros(3), np.ones(3), 1.0, *[np.zeros((1, 1, 1), bool)] * 2)
    count = len(small.probes)
    harmonics = np.linspace(-1, 1, count * HARMONICS * 3).reshape(count, HARMONICS, 3).astype(np.float16)
    seen = np.full((len(small.places), SEEN_PER_BRICK), 255, np.uint8)
    light_map = LightMap(small, 3.0, harmonics, np.ones(count, bool), seen, "0" * 32, "f" * 32)
    light_map.save(path)
    whole, members = path.read_bytes(), members_of(path)
    random = np.random.default_rng(5)
    refused, began = 0, time.process_time()
    for number in range(MUTANTS):
        forged(path, random, whole, members)
        try:
            found = LightMap.load(path)
        except pica.PicaError as error:
            assert str(path) in str(error) and "\n" not in str(error)
            refused += 1
        else:
            brightest = np.float32(found.scale) * np.abs(found.harmonics.astype(np.float32)).max()
            assert np.isfinite(16 * brightest), number
            assert found.bricks.probe_of.max() < len(found.harmonics)
            entries = found.bricks.finest_at
            assert (
                found.bricks.positions.shape == (len(found.harmonics), 3) and np.isfinite(found.bricks.positions).all()
            )
            assert (entries[entries != NOWHERE] >> 2).max() < len(found.bricks.places)
    assert MUTANTS / 2 < refused < MUTANTS
    assert time.process_time() - began < 0.05 * MUTANTS


def test_another_scene_is_refused_and_one_that_moved_is_told(light_map):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        light_map.check_scene(a_scene())
    for other in ({"shade": 0.6}, {"light": 4.0}, {"sky": 0.6}):
        with pytest.raises(pica.SceneError, match="another scene"):
            light_map.check_scene(a_scene(**other))
    with pytest.warns(UserWarning, match="elsewhere"):
        light_map.check_scene(a_scene(place=(1, 0, 0)))


def test_pictures_count_and_scenes_made_anew_are_the_same():
    assert content_of(pica.scenes.machine_world()) == content_of(pica.scenes.machine_world())

    def pictured(texel):
        pixels = checkered().pixels.copy()
        pixels[3, 5, 1] = texel
        return content_of(scene_of(placed(box(1, lambert(base_color_texture=Texture(Image(pixels)))))))

    assert pictured(7) == pictured(7) != pictured(8)

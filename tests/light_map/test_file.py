"""Light maps in files, which may come from anybody."""

import warnings
import zipfile
from io import BytesIO

import numpy as np
import pytest

import pica
from pica.light_map.bricks import bricks_around
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
    assert refused > 40
    with pytest.raises(pica.PicaError, match="no such file"):
        LightMap.load(tmp_path / "missing.lightmap")


@pytest.mark.parametrize(
    ("name", "value", "fault"),
    [
        ("format", np.int32(99), "format 99"),
        ("spacing", np.float64(np.nan), "nowhere"),
        ("spacing", np.float64(0), "nowhere"),
        ("size", np.int32([1 << 20, 1 << 20, 1 << 20]), "large"),
        ("size", np.int32([0, 2, 2]), "large"),
        ("places", np.int32([[0, 0, 0, 3]]), "level"),
        ("places", np.int32([[0, 0, 0, -1]]), "level"),
        ("places", np.int32([[1, 0, 0, 1]]), "place"),
        ("places", np.int32([[1 << 30, 0, 0, 0]]), "place"),
        ("places", np.zeros((0, 4), np.int32), "bricks"),
        ("places", np.int32([[0, 0, 0, 0]]), "probes"),
        ("harmonics", np.full((3, HARMONICS, 3), np.inf, np.float16), "probes"),
        ("harmonics", np.zeros((3, HARMONICS), np.float16), "float16"),
        ("scale", np.float32(np.inf), "finite"),
        ("scale", np.float64(1), "float64"),
        ("seen", None, "no array"),
    ],
)
def test_what_does_not_fit_together_is_refused(light_map, tmp_path, name, value, fault):
    path = tmp_path / "a.lightmap"
    light_map.save(path)
    with zipfile.ZipFile(path) as archive:
        members = {info: archive.read(info) for info in archive.namelist()}
    if value is None:
        del members[f"{name}.npy"]
    else:
        member = BytesIO()
        np.save(member, value)
        members[f"{name}.npy"] = member.getvalue()
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for info, content in members.items():
            archive.writestr(info, content)
    with pytest.raises(pica.PicaError, match=fault):
        LightMap.load(path)


def test_pickles_and_small_files_for_much_memory_are_refused(light_map, tmp_path):
    path = tmp_path / "a.lightmap"
    light_map.save(path)
    objects, zeros = BytesIO(), BytesIO()
    np.save(objects, np.array([{}], object), allow_pickle=True)
    np.save(zeros, np.zeros((1000, SEEN_PER_BRICK), np.uint8))
    for name, content in (("harmonics", objects.getvalue()), ("seen", zeros.getvalue())):
        with zipfile.ZipFile(path, "a", zipfile.ZIP_LZMA) as archive, warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the name is there twice
            archive.writestr(f"{name}.npy", content)
        with pytest.raises(pica.PicaError, match=name):
            LightMap.load(path)
        light_map.save(path)


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

"""Unwrapped meshes: charts that do not overlap, in a file that need not be trusted."""

import numpy as np
import pytest

from pica.scene.material import Material
from pica.scenes.basic_meshes import box, sphere, torus
from pica.texture_space import unwrap as module
from pica.texture_space.texture_maps import _places, _sides
from pica.texture_space.unwrap import unwrap
from pica.texture_space.unwrap_progress import REPORTS


def places(corners: np.ndarray) -> np.ndarray:
    """(triangles, 3, 2) in 0 to 1."""
    return np.stack([corners & 0xFFFF, corners >> 16], -1) / 65535


def across(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


MESHES = [lambda: sphere(1, Material(), 24), lambda: box(1, Material()), lambda: torus(1, 0.3, Material(), 24)]


@pytest.mark.parametrize("made", MESHES, ids=["sphere", "box", "torus"])
def test_no_texel_is_in_two_triangles(made):
    section, side = made(), 128
    corners = places(unwrap([(section, side)])[0]) * side
    owners = np.zeros((side, side), int)
    for a, b, c in corners:
        low, high = np.floor(np.min([a, b, c], 0)).astype(int), np.ceil(np.max([a, b, c], 0)).astype(int)
        x, y = np.meshgrid(np.arange(low[0], high[0]) + 0.5, np.arange(low[1], high[1]) + 0.5)
        p, area = np.stack([x, y], -1) - a, across(b - a, c - a)
        u, v = across(p, c - a) / area, across(b - a, p) / area
        inside = (u > 1e-3) & (v > 1e-3) & (u + v < 1 - 1e-3)
        owners[low[1] : high[1], low[0] : high[0]] += inside
    assert owners.max() == 1
    assert owners.mean() > 0.25


def test_it_is_kept_by_content_and_a_damaged_file_is_made_anew(monkeypatch, tmp_path):
    monkeypatch.setattr(module, "caches", lambda: tmp_path)
    section = sphere(1, Material(), 12)
    (first,) = unwrap([(section, 64)])
    (file,) = (path for path in tmp_path.rglob("*.npy"))
    monkeypatch.setattr(module, "_unwrapped", lambda *_: pytest.fail("unwrapped again"))
    np.testing.assert_array_equal(unwrap([(section, 64)])[0], first)
    monkeypatch.undo()
    monkeypatch.setattr(module, "caches", lambda: tmp_path)
    file.write_bytes(file.read_bytes()[:100])
    np.testing.assert_array_equal(unwrap([(section, 64)])[0], first)
    np.testing.assert_array_equal(np.load(file), first)


def test_progress_is_of_the_triangles_that_the_cache_does_not_have(monkeypatch, tmp_path):
    monkeypatch.setattr(module, "caches", lambda: tmp_path)
    known, first, second = sphere(1, Material(), 12), box(1, Material()), torus(1, 0.3, Material(), 12)
    unwrap([(known, 64)])
    said = []
    with REPORTS.to(lambda *counts: said.append(counts)):
        corners = unwrap([(first, 64), (known, 64), (second, 64)])
        unwrap([(known, 64), (second, 64)])
    assert [len(each) for each in corners] == [len(section.indices) for section in (first, known, second)]
    total = len(first.indices) + len(second.indices)
    assert said == [(0, total), (len(first.indices), total), (total, total)]


def test_maps_share_the_texture_without_overlap():
    sides = _sides([100.0, 9.0, 4.0, 1.0, *[0.01] * 30], 256)
    taken = np.zeros((256, 256), int)
    for (x, y), side in zip(_places(sides), sides, strict=True):
        assert x + side <= 256
        assert y + side <= 256
        taken[y : y + side, x : x + side] += 1
    assert taken.max() == 1
    assert sides == sorted(sides, reverse=True)
    assert len(sides) == 34


def test_more_objects_than_tiles_leave_the_smallest_out():
    assert _sides([1.0] * 1000, 64) == [16] * 16

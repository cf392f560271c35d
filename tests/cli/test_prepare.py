"""`pica prepare`: which scenes and settings it asks for."""

import json
from types import SimpleNamespace

import pytest

import pica
from pica.programs.scene_features import BUNDLES, features_of_mesh, features_of_scene, supported_features
from pica.settings import PRESETS, Settings

BUILT_IN = 9


class Preparing:
    """Stands for a renderer that has all programs already; `asked` tells which it was to make."""

    asked: list[tuple[str, Settings]] = []  # noqa: RUF012

    def __init__(self, scene, size, settings=None, device=None, light_map=None):
        self.scene, self.settings = scene, settings
        self.device = SimpleNamespace(cache="the cache")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def prepare(self):
        Preparing.asked.append((self.scene, self.settings))


@pytest.fixture
def asked(monkeypatch, calls):
    monkeypatch.setitem(vars(pica), "Renderer", Preparing)
    monkeypatch.setattr(Preparing, "asked", [])
    return Preparing.asked


def test_a_scene_with_its_settings(run, asked):
    code, out, err = run("prepare", "m.glb", "--preset", "balanced", "--set", "shadows.mode=hard")
    assert code == 0 and out.startswith("m.glb, balanced: ready in the cache") and "Preparing" in err
    assert [settings for _, settings in asked] == [Settings.preset("balanced").with_values({"shadows.mode": "hard"})]
    assert json.loads(run("prepare", "m.glb", "--json")[1])["presets"] == ["quality"]
    assert asked[1][1] == Settings()


def test_all_scenes_for_each_preset(run, asked, monkeypatch):
    """And one of all that materials and lights can have, first: its programs do for the others' too."""
    for name in pica.scenes.__all__:
        monkeypatch.setattr(pica.scenes, name, lambda name=name: name)
    assert run("prepare", "--all")[0] == 0
    assert len(asked) == (1 + BUILT_IN) * len(PRESETS)
    whole = asked[0][0]
    found = features_of_scene(whole).union(*(features_of_mesh(node.mesh) for node in whole.nodes()))
    assert found == supported_features((BUNDLES[-1],))
    assert {scene for scene, _ in asked[len(PRESETS) :]} == set(pica.scenes.__all__)


def test_either_a_scene_or_all(run, asked):
    for arguments in ([], ["m.glb", "--all"], ["--all", "--env", "sky.hdr"]):
        code, _, err = run("prepare", *arguments)
        assert code == 2 and "--all" in err

"""Programs leave out what a scene does not have, know it once it comes, and those that know more will do."""

import numpy as np
import pytest

import pica
from pica.frame.aovs import gbuffer_aovs
from pica.programs import preparation
from pica.programs.library import programs
from pica.programs.material_types import STANDARD_ONLY
from pica.programs.scene_features import EMISSIVE_TEXTURES, TEXTURES, features_of
from pica.scene import material_registry
from pica.scene.material import AlphaMode, Image, Material, Texture
from pica.scenes.basic_meshes import plane
from pica.scenes.placing import move, turn
from tests.building import RASTER, RAYS, lambert, orthographic, placed, scene_of, settings, uniform

GREY = Texture(Image(np.full((4, 4, 4), 128, np.uint8)))
SLOTS = ["base_color", "metallic_roughness", "normal", "occlusion", "specular", "specular_color", "transmission"]
CAMERA = orthographic((0, 0, 2), (0, 0, 0), 2.0)
QUICK = {"shadows.mode": "off", **RASTER}


def textured(**textures) -> Material:
    return Material(roughness=1.0, metallic=0.0, **textures)


def test_what_materials_ask_for():
    assert features_of(Material()) == ()
    for slot in SLOTS:
        assert features_of(textured(**{f"{slot}_texture": GREY})) == (TEXTURES,)
    assert features_of(textured(emissive_texture=GREY)) == (TEXTURES, EMISSIVE_TEXTURES)


def backdrop():
    return scene_of(placed(plane(2, 2, lambert(0.6)), move(0, 0, -1) @ turn("x", 90)), environment=uniform(1, 1, 1))


def wall(material: Material):
    return placed(plane(2, 2, material), turn("x", 90))


def seen(renderer: pica.Renderer, name: str) -> float:
    """What a frame shows in the middle."""
    picture = gbuffer_aovs(renderer.advance(CAMERA), renderer.view, CAMERA)[name].fetch()
    return float(picture[8, 8, 0])


def renderer_of(device, scene) -> pica.Renderer:
    return pica.Renderer(scene, (16, 16), settings(QUICK), device)


@pytest.fixture
def nothing_cached(device, monkeypatch):
    """No program covers more than was asked for, whatever other tests have compiled."""
    monkeypatch.setattr(programs(device).compiled, "has", lambda program: False)


def test_a_texture_that_comes_to_a_running_renderer_waits_for_programs_that_read_it(device, nothing_cached):
    scene = backdrop()
    renderer = renderer_of(device, scene)
    assert seen(renderer, "albedo") == pytest.approx(0.6, abs=0.01)
    assert renderer.view.material_types == STANDARD_ONLY
    scene.add(wall(textured(base_color_texture=GREY)))
    before = [seen(renderer, "albedo")]
    while renderer.pending_shaders:
        before.append(seen(renderer, "albedo"))
    assert before[0] == pytest.approx(0.6, abs=0.01), "frames went on without it"
    assert seen(renderer, "albedo") == pytest.approx(0.216, abs=0.01)  # 128 of sRGB
    assert renderer.view.material_types == (*STANDARD_ONLY, TEXTURES)


def test_emission_is_read_from_its_texture(device, nothing_cached):
    renderer = renderer_of(device, scene_of(wall(textured(emission=(2, 2, 2), emissive_texture=GREY))))
    assert seen(renderer, "emission") == pytest.approx(0.432, abs=0.01)
    assert renderer.view.material_types == (*STANDARD_ONLY, TEXTURES, EMISSIVE_TEXTURES)


def test_programs_that_know_more_are_taken_where_the_caches_have_them(device, monkeypatch):
    monkeypatch.setattr(programs(device).compiled, "has", lambda program: TEXTURES in program[1])
    monkeypatch.setattr(preparation, "_wanted", lambda device, types: [(None, types)])
    assert preparation._covering(device, STANDARD_ONLY) == (*STANDARD_ONLY, TEXTURES)
    assert preparation._covering(device, (*STANDARD_ONLY, TEXTURES)) == (*STANDARD_ONLY, TEXTURES)
    monkeypatch.setattr(programs(device).compiled, "has", lambda program: False)
    assert preparation._covering(device, STANDARD_ONLY) == STANDARD_ONLY


HALF = """
import materials.material_type;
struct Half : IMaterialType
{
    override static float coverage(MaterialInput input) { return input.position.x < 0 ? 1 : 0; }
    static void evaluate(MaterialInput input, inout Surface surface) { surface.brdf.baseColor = .25; }
}
"""


@pytest.mark.parametrize("values", [RASTER, RAYS])
def test_types_that_come_after_a_feature_keep_their_hit_groups(device, nothing_cached, monkeypatch, tmp_path, values):
    monkeypatch.setattr(material_registry, "_registered", {})
    (tmp_path / "half.slang").write_text(HALF)
    pica.register_material("half", tmp_path / "half.slang")
    behind = placed(plane(2, 2, textured(base_color_texture=GREY)), move(0, 0, -1) @ turn("x", 90))
    scene = scene_of(behind, wall(Material(type="half", alpha_mode=AlphaMode.MASK)))
    renderer = pica.Renderer(scene, (16, 16), settings({**QUICK, **values}), device)
    found = renderer.render(1, CAMERA)
    assert [entry.name for entry in renderer.view.material_types] == ["standard", "feature/textures", "half"]
    assert found.aov("albedo")[8, [4, 12], 0] == pytest.approx([0.25, 0.216], abs=0.01)

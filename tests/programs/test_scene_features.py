"""Programs leave out what a scene does not have, know it once it comes, and those that know more will do."""

import numpy as np
import pytest

import pica
from pica.programs import preparation, scene_features
from pica.programs.library import ProgramLibrary, programs
from pica.programs.material_types import STANDARD_ONLY, Bundle
from pica.programs.program_round import ProgramRound
from pica.programs.scene_features import (
    ALPHA,
    ANISOTROPY,
    BUNDLES,
    COATS,
    DIFFUSE_TRANSMISSION,
    EMISSIVE_TEXTURES,
    ENVIRONMENT,
    FILMS,
    FLAT_LIGHTS,
    LIGHTS,
    LOBES,
    SHEEN,
    TEXTURES,
    TRANSMISSION,
    TUBES,
    features_of,
    features_of_light,
    features_of_mesh,
    supported_features,
    with_features,
)
from pica.rhi.recipes import ComputeRecipe
from pica.scene import material_registry
from pica.scene.anisotropy import Anisotropy
from pica.scene.coat import Coat
from pica.scene.iridescence import Iridescence
from pica.scene.light import DirectionalLight, DiskLight, PointLight, RectangleLight, SphereLight, SpotLight, TubeLight
from pica.scene.material import AlphaMode, Image, Material, Texture
from pica.scene.sheen import Sheen
from pica.scenes.basic_meshes import box, plane
from pica.scenes.placing import aim, move, rotate
from tests.building import RASTER, RAYS, lambert, leaves, orthographic, placed, scene_of, settings, shining, uniform

GREY = Texture(Image(np.full((4, 4, 4), 128, np.uint8)))
ALL_BUT_LOBES, OPAQUE_WITH_COATS, WITH_COATS = BUNDLES[5:8]
"""What scenes of these tests need is among them; each lobe more takes a minute to compile."""
SLOTS = ["base_color", "metallic_roughness", "normal", "occlusion", "specular", "specular_color", "transmission"]
CAMERA = orthographic((0, 0, 2), (0, 0, 0), 2.0)
QUICK = {"shadows.mode": "off", **RASTER}
LAMP = PointLight(intensity=30.0)
ABOVE = move(0, 0, 1.5)


def textured(**textures) -> Material:
    return Material(roughness=1.0, metallic=0.0, **textures)


def test_what_materials_ask_for():
    assert features_of(Material()) == set()
    for slot in SLOTS:
        assert features_of(textured(**{f"{slot}_texture": GREY})) == {TEXTURES}
    assert features_of(textured(emissive_texture=GREY)) == {TEXTURES, EMISSIVE_TEXTURES}
    for mode in (AlphaMode.MASK, AlphaMode.BLEND):
        assert features_of(Material(alpha_mode=mode)) == {ALPHA}
    assert features_of(Material(transmission=0.5)) == {TRANSMISSION}
    assert features_of(Material(diffuse_transmission=0.5)) == {DIFFUSE_TRANSMISSION}
    assert features_of(Material(coats=(Coat(),))) == {COATS}
    assert features_of(Material(iridescence=Iridescence())) == {LOBES, FILMS}
    assert features_of(Material(anisotropy=Anisotropy())) == {LOBES, ANISOTROPY}
    assert features_of(Material(sheen=Sheen())) == {LOBES, SHEEN}


def test_what_lights_ask_for():
    assert features_of_light(None) == set()
    for light in (DirectionalLight(), PointLight(), SpotLight(), SphereLight()):
        assert features_of_light(light) == {LIGHTS}
    for light in (RectangleLight(), DiskLight()):
        assert features_of_light(light) == {LIGHTS, FLAT_LIGHTS}
    assert features_of_light(TubeLight()) == {LIGHTS, FLAT_LIGHTS, TUBES}
    node = placed([plane(1, 1, leaves()), plane(1, 1, Material(transmission=1.0))])
    assert features_of_mesh(node.mesh) == {TEXTURES, ALPHA, TRANSMISSION}


def test_the_smallest_bundle_that_will_do_takes_one_place():
    assert with_features(STANDARD_ONLY, set()) is STANDARD_ONLY
    lit = with_features(STANDARD_ONLY, {LIGHTS})
    assert lit == (*STANDARD_ONLY, BUNDLES[1]) and supported_features(lit) == {LIGHTS, FLAT_LIGHTS, ENVIRONMENT}
    assert with_features(lit, {FLAT_LIGHTS}) is lit
    textured_too = with_features((*lit, STANDARD_ONLY[0]), {TEXTURES})
    assert textured_too == (*STANDARD_ONLY, BUNDLES[4], *STANDARD_ONLY), "others keep their places"
    assert with_features(with_features(STANDARD_ONLY, {TEXTURES}), {LIGHTS}) == textured_too[:2], (
        "however it came about"
    )
    assert with_features(STANDARD_ONLY, {TUBES}) == (*STANDARD_ONLY, ALL_BUT_LOBES)
    coated = with_features(STANDARD_ONLY, {COATS})
    assert coated == (*STANDARD_ONLY, OPAQUE_WITH_COATS)
    assert with_features(coated, {TRANSMISSION}) == (*STANDARD_ONLY, WITH_COATS)
    assert supported_features((BUNDLES[-1],)) == supported_features(BUNDLES)


def test_what_takes_long_to_compile_comes_by_itself():
    most = supported_features((ALL_BUT_LOBES,))
    passing = {TRANSMISSION, DIFFUSE_TRANSMISSION}
    for some in ({COATS}, {LOBES, FILMS}, {COATS, LOBES, ANISOTROPY}, {LOBES, FILMS, SHEEN}):
        assert supported_features(with_features(STANDARD_ONLY, some)) == some | most - passing
        assert supported_features(with_features(STANDARD_ONLY, some | {TRANSMISSION})) == some | most


def backdrop(environment=None):
    return scene_of(placed(plane(2, 2, lambert(0.6)), move(0, 0, -1) @ rotate("x", 90)), environment=environment)


def wall(material: Material):
    return placed(plane(2, 2, material), rotate("x", 90))


def seen(renderer: pica.Renderer, name: str) -> float:
    """What a frame shows in the middle."""
    renderer.advance(CAMERA, capture=(name,))
    return float(renderer.captured[name]()[8, 8, 0])


def lit(renderer: pica.Renderer) -> bool:
    """Whether a frame shows light in the middle."""
    return float(renderer.advance(CAMERA)["color"].to_numpy()[8, 8, 0]) > 0.1


def renderer_of(device, scene) -> pica.Renderer:
    return pica.Renderer(scene, size=(16, 16), settings=settings(QUICK), device=device)


def known(renderer: pica.Renderer) -> set:
    return supported_features(renderer.view.material_types)


@pytest.fixture
def nothing_cached(monkeypatch):
    """No program covers more than was asked for, whatever other tests have compiled."""
    monkeypatch.setattr(preparation, "_covering", lambda device, types: types)


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
    assert known(renderer) == {TEXTURES, EMISSIVE_TEXTURES, ALPHA, ENVIRONMENT}


@pytest.mark.parametrize("way", ["a node comes", "a node is given it"])
def test_a_light_that_comes_to_a_running_renderer_waits_for_programs_that_know_it(device, nothing_cached, way):
    scene = backdrop()
    bulb = shining(LAMP, ABOVE)
    if way == "a node is given it":
        bulb.light = None
        scene.add(bulb)
    renderer = renderer_of(device, scene)
    assert not lit(renderer)
    if way == "a node is given it":
        bulb.light = LAMP
    else:
        scene.add(bulb)
    assert not lit(renderer), "frames went on without it"
    bulb.transform = move(0, 0, 1.4)  # nor does it come before its time because it moves
    while renderer.pending_shaders:
        assert not lit(renderer) or not renderer.pending_shaders
    assert lit(renderer)
    assert known(renderer) == {LIGHTS, FLAT_LIGHTS, ENVIRONMENT}
    scene.remove(bulb)
    assert not lit(renderer)


def test_a_light_that_changes_its_kind_shines_as_it_was_until_programs_know_it(device, nothing_cached):
    bulb = shining(LAMP, ABOVE)
    scene = backdrop()
    scene.add(bulb)
    renderer = renderer_of(device, scene)
    assert lit(renderer)
    bulb.light = TubeLight(radiance=1e-6)
    assert lit(renderer), "as it was"
    bulb.light = PointLight(intensity=1e-6)
    assert not lit(renderer), "this kind is known"
    assert renderer.render(1, camera=CAMERA).color[8, 8, 0] < 0.1, "nor is the other waited for"
    assert known(renderer) == {LIGHTS, FLAT_LIGHTS, ENVIRONMENT}


def test_a_light_that_goes_while_it_waits_is_not_waited_for(device, nothing_cached):
    scene = backdrop()
    renderer = renderer_of(device, scene)
    assert not lit(renderer)
    bulb = scene.add(shining(LAMP, ABOVE))
    assert not lit(renderer)
    scene.remove(bulb)
    while renderer.pending_shaders:
        assert not lit(renderer)
    assert not lit(renderer)


def test_whoever_waits_sees_a_new_light_at_once(device, nothing_cached):
    scene = backdrop()
    renderer = renderer_of(device, scene)
    assert renderer.render(1, camera=CAMERA).color.max() == 0
    scene.add(shining(LAMP, ABOVE))
    assert renderer.render(1, camera=CAMERA).color[8, 8, 0] > 0.1


def test_emission_is_read_from_its_texture(device, nothing_cached):
    renderer = renderer_of(device, scene_of(wall(textured(emission=(2, 2, 2), emissive_texture=GREY))))
    assert seen(renderer, "emission") == pytest.approx(0.432, abs=0.01)


DOWN = aim((0.5, 1.5, 0.5), (0, 0, 0))
GLASS = Material(base_color=(0.2, 0.9, 0.3, 1.0), metallic=0.0, roughness=0.1, transmission=1.0)
VEIL = Material(base_color=(0.9, 0.9, 0.9, 0.3), alpha_mode=AlphaMode.BLEND)


def above(material: Material, height: float):
    return placed(plane(1, 1, material), move(0, height, 0))


WITH = {
    "directional": lambda: shining(DirectionalLight(angular_diameter=0.05), DOWN),
    "point": lambda: shining(PointLight(intensity=9.0, radius=0.1), DOWN),
    "rectangle": lambda: shining(RectangleLight(radiance=20.0), DOWN),
    "disk": lambda: shining(DiskLight(radiance=20.0), DOWN),
    "tube": lambda: shining(TubeLight(radiance=20.0), DOWN),
    "environment": lambda: placed(box(0.1, lambert())),
    "textures": lambda: above(textured(base_color_texture=GREY), 0.1),
    "emissive textures": lambda: above(textured(emission=(2, 3, 4), emissive_texture=GREY), 0.1),
    "alpha": lambda: above(VEIL, 0.3),
    "transmission": lambda: above(GLASS, 0.5),
    "coats": lambda: above(Material(coats=(Coat(),)), 0.1),
}
SMALL = [what for what in WITH if what not in ("tube", "transmission", "coats")]
"""What needs no program that knows all."""


def pictured(device, what: str, way: str = "hybrid", **values: str):
    """(height, width, 3) a floor and a box with what is asked for, and the material types."""
    scene = scene_of(placed(plane(4, 4, lambert(0.6))), placed(box(0.3, lambert(0.4)), move(0.4, 0.2, 0)))
    node = scene.add(WITH[what]())
    if what == "environment":
        scene.environment = uniform(0.4, 0.5, 0.6)
    elif node.light is None and what != "emissive textures":
        scene.add(shining(DirectionalLight(), DOWN))
    camera = pica.Camera.look_at((0, 2, 2.5), (0, 0, 0))
    given = settings({"shadows.denoiser": "off", **values})
    if way == "hybrid":
        made = pica.Renderer(scene, size=(24, 16), settings=given, device=device)
    else:
        made = pica.PathTracer(scene, size=(24, 16), max_depth=3, settings=given, device=device)
    found = made.render(4, camera=camera).color, made.view.material_types
    made.close()
    return found


@pytest.mark.parametrize(
    ("what", "way"), [*((what, "hybrid") for what in SMALL), ("point", "path traced"), ("environment", "path traced")]
)
def test_programs_as_large_as_the_scene_show_it_as_those_that_know_all(device, nothing_cached, monkeypatch, what, way):
    """A constant that is not set for a scene that needs it leaves something out."""
    small, types = pictured(device, what, way)
    monkeypatch.setattr(scene_features, "BUNDLES", (ALL_BUT_LOBES,))
    large, all_types = pictured(device, what, way)
    assert ALL_BUT_LOBES in all_types and ALL_BUT_LOBES not in types
    assert small.max() > 0.01
    np.testing.assert_allclose(small, large, rtol=1e-3, atol=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("way", ["hybrid", "path traced"])
def test_glass_is_the_same_to_programs_that_know_of_coats(device, nothing_cached, monkeypatch, way):
    small, types = pictured(device, "transmission", way)
    monkeypatch.setattr(scene_features, "BUNDLES", (WITH_COATS,))
    large, all_types = pictured(device, "transmission", way)
    assert COATS not in supported_features(types) and COATS in supported_features(all_types)
    np.testing.assert_allclose(small, large, rtol=1e-3, atol=1e-4)


def test_tubes_shine_and_glass_lets_light_through(device, nothing_cached):
    assert pictured(device, "tube")[0].max() > 0.01
    through, opaque = (pictured(device, "transmission", **{"shadows.transparent": way})[0] for way in ("true", "false"))
    assert (through - opaque).max() > 0.05


def test_programs_that_know_more_are_taken_where_the_caches_have_them(device, monkeypatch):
    def types(number: int):
        return (*STANDARD_ONLY, BUNDLES[number])

    monkeypatch.setattr(programs(device).compiled, "has", lambda program: TEXTURES in supported_features(program[1]))
    monkeypatch.setattr(preparation, "_required", lambda device, types: [(None, types)])
    assert preparation._covering(device, STANDARD_ONLY) == types(2)
    assert preparation._covering(device, types(1)) == types(4)
    assert preparation._covering(device, types(4)) == types(4)
    monkeypatch.setattr(programs(device).compiled, "has", lambda program: False)
    assert preparation._covering(device, STANDARD_ONLY) == STANDARD_ONLY


def test_passes_for_a_feature_are_made_for_scenes_that_have_it(device, monkeypatch):
    library = ProgramLibrary(device)
    kept = library.compute_with(TUBES, "rhi/scatter.slang")
    monkeypatch.setattr(device, "has", lambda recipe: False)
    assert library.planned_for((*STANDARD_ONLY, Bundle((LIGHTS,)))) == []
    assert library.planned_for((*STANDARD_ONLY, Bundle((LIGHTS, TUBES)))) == [ComputeRecipe("rhi/scatter.slang")]
    monkeypatch.setattr(device, "has", lambda recipe: True)
    assert library.planned_for((Bundle((TUBES,)),)) == []
    del kept


def test_a_round_makes_the_passes_of_features_that_come(device, monkeypatch):
    """Or the frame in which a first light comes would compile the filters of its shadow."""
    monkeypatch.setattr(programs(device).compiler, "submit", lambda task: None)
    kept = programs(device).compute_with(LIGHTS, "rhi/scatter.slang")
    monkeypatch.setattr(device, "has", lambda recipe: False)
    coming = ProgramRound(device, STANDARD_ONLY, (*STANDARD_ONLY, BUNDLES[1]))
    assert (ComputeRecipe("rhi/scatter.slang"), ()) in [(task.recipe, task.types) for task in coming._tasks]
    del kept


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
    behind = placed(plane(2, 2, textured(base_color_texture=GREY)), move(0, 0, -1) @ rotate("x", 90))
    scene = scene_of(behind, wall(Material(type="half", alpha_mode=AlphaMode.MASK)))
    renderer = pica.Renderer(scene, size=(16, 16), settings=settings({**QUICK, **values}), device=device)
    found = renderer.render(1, camera=CAMERA)
    assert [entry.name for entry in renderer.view.material_types] == ["standard", "features/", "half"]
    assert found.aov("albedo")[8, [4, 12], 0] == pytest.approx([0.25, 0.216], abs=0.01)

"""The picture before antialiasing is the sum of its parts, each of which can be asked for."""

import numpy as np
import pytest

import pica
from pica.scene.light import DirectionalLight, PointLight, RectangleLight, SphereLight
from pica.scene.material import Material
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import aim, move, rotate
from tests.building import CAMERA, lambert, placed, scene_of, settings, shining, sky

SIZE = (48, 32)
PARTS = ("diffuse_direct", "glossy_direct", "diffuse_indirect", "reflections", "emission", "environment")
METAL = Material(base_color=(0.9, 0.7, 0.4, 1), metallic=1.0, roughness=0.3)
PLASTIC = Material(base_color=(0.3, 0.5, 0.8, 1), metallic=0.0, roughness=0.4)


def lamps(count):
    """Small ones above the floor; only a few of many have slots of their own."""
    return [shining(SphereLight(radiance=40.0, radius=0.05), move(i - count / 2, 1.6, 0.5)) for i in range(count)]


def a_room(material=PLASTIC, *lights):
    """All kinds of light: lights with slots of their own and one that others share, a glowing box, a sky with a sun."""
    return scene_of(
        placed(plane(4, 4, material)),
        placed(sphere(0.4, METAL), move(-0.6, 0.4, 0)),
        placed(box(0.4, lambert(0.2, emission=(2.0, 1.0, 0.5))), move(0.6, 0.2, 0) @ rotate("y", 30)),
        shining(DirectionalLight(illuminance=2.0, angular_diameter=0.02), aim((1, 2, 1.5), (0, 0, 0))),
        *(lights or lamps(6)),
        environment=sky(),
    )


CASES = {
    **{preset: (preset, {}) for preset in pica.settings.PRESETS},
    **{
        f"global_illumination {mode}": ("quality", {"global_illumination.mode": mode})
        for mode in ("off", "restir", "surfels", "light_map")
    },
    "reflections screen_space": ("quality", {"reflections.mode": "screen_space"}),
    "reflections off": ("quality", {"reflections.mode": "off"}),
    "transparent": ("quality", {"visibility.background": "transparent"}),
    "upscaled": ("quality", {"antialiasing.upscale": "1.5"}),
    "unfiltered": ("quality", {"debug.filters": "false"}),
}


@pytest.mark.parametrize("name", CASES)
def test_parts_add_up_to_the_picture_before_antialiasing(device, name):
    preset, values = CASES[name]
    chosen, scene = pica.Settings.preset(preset).with_values(values), a_room()
    found = None
    if chosen.global_illumination.mode == "light_map":
        found = pica.bake(scene, spacing=1.0, samples=16, device=device)
    with pica.Renderer(scene, size=SIZE, settings=chosen, device=device, light_map=found) as renderer:
        there = [part for part in PARTS if part not in renderer.missing_aovs]
        assert len(there) >= len(PARTS) - 1
        for _ in range(3):
            frame = renderer.render(1, camera=CAMERA, aovs=(*there, "combined", "instance"))
        parts = {part: frame.aov(part) for part in there}
        combined = frame.aov("combined")
        np.testing.assert_allclose(sum(parts.values()), combined, rtol=2e-6, atol=1e-7)
        nothing = frame.aov("instance") == 0
        assert 0.05 < nothing.mean() < 0.9
        for part, light in parts.items():
            if part == "environment":
                assert not light[~nothing].any()
                assert light[nothing].all() or name == "transparent"
            else:
                assert not light[nothing].any() and light.max() > 0.01, part
        if name == "transparent":
            assert not combined[nothing].any() and frame.aov("combined")[~nothing].mean() > 0.01


def test_the_first_picture_is_its_only_sample(device):
    """Antialiasing begins with it, through the pixels' centres."""
    frame = pica.Renderer(a_room(), size=SIZE, device=device).render(1, camera=CAMERA, aovs=["combined"])
    np.testing.assert_allclose(frame.color, frame.aov("combined"), rtol=1e-6)


@pytest.mark.parametrize("shared", [False, True])
@pytest.mark.parametrize(
    ("material", "without"), [(lambert(0.6), "glossy_direct"), (METAL, "diffuse_direct")], ids=["lambert", "metal"]
)
def test_direct_light_is_by_what_of_the_surface_reflects_it(device, material, without, shared):
    """Of lights with slots of their own, and of those that share one."""
    lights = lamps(9) if shared else [shining(RectangleLight(radiance=9.0), aim((0, 2, 0.1), (0, 0, 0)))]
    scene = scene_of(placed(plane(4, 4, material)), *lights)
    values = {"shadows.max_lights": "2"} if shared else {}
    with pica.Renderer(scene, size=SIZE, settings=settings(values), device=device) as renderer:
        frame = renderer.render(4, camera=CAMERA)
        assert (len(renderer.single_lights) < len(lights)) == shared
    other = {"diffuse_direct": "glossy_direct", "glossy_direct": "diffuse_direct"}[without]
    assert not frame.aov(without).any()
    assert frame.aov(other).mean() > 0.001


def test_light_of_shared_slots_is_part_of_direct_light(device):
    """It is the same light, whether lights have slots of their own or share one."""

    def mean(slots):
        values = settings({"shadows.max_lights": str(slots), "shadows.mode": "hard"})
        scene = scene_of(
            placed(plane(4, 4, PLASTIC)), *(shining(PointLight(intensity=3.0), move(x, 1, 0)) for x in (-1, 0, 1))
        )
        with pica.Renderer(scene, size=SIZE, settings=values, device=device) as renderer:
            frames = [renderer.render(1, camera=CAMERA, aovs=("diffuse_direct", "glossy_direct")) for _ in range(48)]
        return [np.mean([frame.aov(name) for frame in frames]) for name in ("diffuse_direct", "glossy_direct")]

    np.testing.assert_allclose(mean(1), mean(3), rtol=0.03)


def test_rays_over_the_picture_see_it_without_reflections(device):
    """The pass that gives it to them is for no others."""
    for mode, there in (("screen_space", True), ("ray_traced", False)):
        values = pica.Settings().with_values({"reflections.mode": mode})
        with pica.Renderer(a_room(), size=SIZE, settings=values, device=device) as renderer:
            timings = renderer.render(2, camera=CAMERA, aovs=()).timings
        assert "composite" in timings and ("composite_so_far" in timings) == there


def test_parts_are_channels_of_an_exr(device, tmp_path):
    frame = pica.Renderer(a_room(), size=SIZE, device=device).render(1, camera=CAMERA, aovs=[*PARTS, "combined"])
    frame.save(tmp_path / "parts.exr")
    channels = pica.read_exr(tmp_path / "parts.exr")
    for part in (*PARTS, "combined"):
        saved = np.stack([channels[f"{part}.{letter}"] for letter in "RGB"], axis=-1)
        np.testing.assert_array_equal(saved, frame.aov(part), part)

"""Each stage off alone: the frame goes on, and only the light that docs/how-it-works/stages.md names is lost."""

import re
import warnings
from pathlib import Path
from typing import get_args, get_type_hints

import numpy as np
import pytest

import pica
from pica.errors import PicaError
from pica.scene.light import DirectionalLight, RectangleLight
from pica.scene.material import Material
from pica.scenes.basic_meshes import box, plane, sphere
from pica.scenes.placing import aim, move, rotate
from pica.settings.settings import GROUPS
from pica.tracing import fallbacks
from tests.building import CAMERA, lambert, placed, scene_of, shining, sky

SIZE = (48, 32)
PARTS = (
    "diffuse_direct",
    "glossy_direct",
    "diffuse_indirect",
    "subsurface",
    "reflections",
    "transmission",
    "emission",
    "environment",
)
PAGE = Path(__file__).parents[2] / "docs" / "how-it-works" / "stages.md"


def room():
    """A room whose light passes every stage."""
    metal = Material(base_color=(0.9, 0.7, 0.4, 1), metallic=1.0, roughness=0.2)
    glass = Material(base_color=(0.7, 0.9, 0.8, 1), metallic=0.0, roughness=0.0, transmission=1.0)
    leaf = lambert(0.8, 0.6, 0.4, diffuse_transmission=0.8, thin_walled=True)
    return scene_of(
        placed(plane(4, 4, Material(base_color=(0.6, 0.5, 0.4, 1), metallic=0.0, roughness=0.4))),
        placed(plane(4, 2, lambert(0.7, 0.3, 0.3)), move(0, 1, -1.2) @ rotate("x", 90)),
        placed(sphere(0.4, metal), move(-0.8, 0.4, 0)),
        placed(sphere(0.3, glass), move(0.1, 0.3, 0.6)),
        placed(plane(0.6, 0.6, leaf), move(0.9, 0.5, 0.3) @ rotate("x", 75)),
        placed(box(0.3, lambert(0.2, emission=(4.0, 3.0, 2.0))), move(0.5, 0.15, -0.6)),
        shining(DirectionalLight(illuminance=2.0, angular_diameter=0.02), aim((1, 2, 1.5), (0, 0, 0))),
        shining(RectangleLight(radiance=4.0, width=0.6, height=0.6), aim((-0.5, 1.8, 0.2), (0, 0, 0))),
        environment=sky(),
    )


@pytest.fixture(scope="module")
def mean_parts(device):
    """The mean of each part of the light with some settings, of 24 frames after 8, as parts of the default's sum."""
    renderer = pica.Renderer(room(), size=SIZE, device=device)

    def measure(values, frames=24):
        renderer.configure(pica.Settings().with_values(values))
        renderer.reset()
        there = [part for part in PARTS if part not in renderer.missing_aovs]
        totals = dict.fromkeys((*there, "combined"), 0.0)
        for number in range(frames + 8):
            frame = renderer.render(1, camera=CAMERA, aovs=(*there, "combined"))
            arrays = {name: frame.aov(name) for name in totals}
            assert np.isfinite(arrays["combined"]).all()
            np.testing.assert_allclose(
                sum(arrays[part] for part in there), arrays["combined"], rtol=2e-6, atol=2e-6, err_msg=str(values)
            )
            if number >= 8:
                totals = {name: totals[name] + arrays[name].mean() / frames for name in totals}
        return renderer, totals

    _, default = measure({})
    whole = default["combined"]
    default = {name: mean / whole for name, mean in default.items()}

    def relative(values):
        _, means = measure(values)
        return renderer, default, {name: mean / whole for name, mean in means.items()}

    yield relative
    renderer.close()


# Of each stage that is off: the AOV that is gone with it, and parts that have more or less light, by at least so much
# of the whole. All others stay.
OFF = {
    "shadows.mode": ("shadows", {"diffuse_direct": 0.03, "transmission": None}),
    "lighting.environment": (
        None,
        {"diffuse_direct": -0.2, "diffuse_indirect": -0.03, "reflections": -0.03, "subsurface": -0.01}
        | {"transmission": None},
    ),
    "reflections.mode": ("reflections", {"glossy_direct": 0.02, "transmission": None}),
    "transparency.mode": ("transmission", {"diffuse_direct": 0.01, "glossy_direct": None, "reflections": None}),
    "translucency.mode": ("subsurface", {"diffuse_direct": 0.04, "diffuse_indirect": 0.004, "transmission": None}),
    "global_illumination.mode": (
        "diffuse_indirect",
        {"reflections": -0.003, "transmission": None},
    ),
    "ambient_occlusion.mode": ("ambient_occlusion", {}),
}


@pytest.mark.parametrize("setting", OFF)
def test_a_stage_that_is_off_takes_its_own_light_alone(mean_parts, setting):
    gone, changes = OFF[setting]
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # nothing that was asked for is missing
        renderer, default, means = mean_parts({setting: "off"})
    if gone is not None:
        assert gone in renderer.missing_aovs
        with pytest.raises(PicaError, match=f"'{gone}'.*{setting.partition('.')[0]}"):
            renderer.render(1, camera=CAMERA, aovs=[gone])
    for part in set(means) - {"combined"}:
        difference, least = means[part] - default[part], changes.get(part, 0.0)
        if least == 0.0:
            assert abs(difference) < 0.003, part
        elif least is not None:
            assert difference / least > 1, part
    if setting == "reflections.mode":
        lost = default["reflections"] - (means["glossy_direct"] - default["glossy_direct"])
        assert 0.01 < lost < default["reflections"], "emitters are seen, other surfaces are not"


WAYS = {
    "visibility.primary": ("raster", "rays"),
    "ambient_occlusion.mode": ("ray_traced", "ground_truth"),
    "transparency.mode": ("screen_space",),
    "translucency.mode": ("screen_space",),
    "reflections.mode": ("screen_space",),
    "global_illumination.mode": ("restir", "surfels"),
}


@pytest.mark.slow
@pytest.mark.parametrize(("setting", "way"), [(name, way) for name, ways in WAYS.items() for way in ways])
def test_another_way_has_about_the_same_light(mean_parts, setting, way):
    """What is seen in screen space alone is named by docs/how-it-works/light-paths.md."""
    _, default, means = mean_parts({setting: way})
    assert means["combined"] == pytest.approx(default["combined"], rel=0.02)


def test_indirect_light_from_a_light_map_that_is_not_there_says_so_once(device):
    device.shared(fallbacks.WarningLog).messages.clear()
    values = pica.Settings().with_values({"global_illumination.mode": "light_map"})
    with pytest.warns(UserWarning, match="light_map without a light map: no indirect light") as caught:
        for _ in range(2):
            pica.Renderer(room(), size=SIZE, settings=values, device=device).close()
    assert len(caught) == 1


def test_the_page_has_every_stage_and_way():
    """Every value of a stage's setting, and of those that exist alone."""
    text = PAGE.read_text()
    told = set(re.findall(r"`(\w+\.\w+)=(\w+)`", text))
    for setting in {*OFF, *WAYS, "shadows.method"}:
        group, name = setting.split(".")
        values = set(get_args(get_type_hints(GROUPS[group])[name])) - {"auto", "soft", "hard"}
        assert {value for path, value in told if path == setting} == values, setting
    assert all(f"`{preset}`" in text for preset in ("pica_pica", "ue4_reflections", "ue4_speed_of_light"))

import copy
import json
import pickle
from dataclasses import fields, is_dataclass, replace
from types import SimpleNamespace
from typing import Literal, get_args, get_origin, get_type_hints

import numpy as np
import pytest

from pica.cli import options
from pica.errors import SettingsError
from pica.settings import PRESETS, AmbientOcclusionSettings, DebugSettings, PostSettings, Settings, ShadowsSettings
from tools import settings_page

GROUPS = {each.name: getattr(Settings(), each.name) for each in fields(Settings)}
GROUPS = {name: group for name, group in GROUPS.items() if is_dataclass(group)}
SCHEMA = Settings.schema()
LEVELS = [(name, level) for name, group in GROUPS.items() for level in group.levels]


def lookup(settings, path):
    group, _, name = path.rpartition(".")
    return getattr(getattr(settings, group) if group else settings, name)


def test_values_given_as_text_take_the_setting_s_type():
    settings = Settings().with_values(
        {
            "shadows.mode": "hard",
            "shadows.max_lights": "3",
            "post.exposure": "-1.5",
            "post.auto_exposure": "FALSE",
            "seed": "7",
        }
    )
    assert settings.shadows == ShadowsSettings(mode="hard", max_lights=3)
    assert settings.post == PostSettings(exposure=-1.5, auto_exposure=False)
    assert settings.seed == 7
    assert settings.lighting == Settings().lighting


@pytest.mark.parametrize("preset", PRESETS)
def test_settings_become_values_and_back(preset):
    settings = replace(Settings.preset(preset), seed=3, shadows=ShadowsSettings(mode="hard", history=9))
    values = settings.values()
    assert set(values) == set(SCHEMA["settings"]) and values["shadows.mode"] == "hard"
    assert Settings().with_values(json.loads(json.dumps(values))) == settings


def test_values_may_have_their_own_types():
    values = {"shadows.mode": "hard", "shadows.max_lights": 3, "post.exposure": -1.5, "post.auto_exposure": False}
    assert Settings().with_values(values) == Settings().with_values({name: str(each) for name, each in values.items()})


def test_scalars_of_numpy_become_plain():
    settings = Settings().with_values(
        {
            "shadows.mode": np.str_("hard"),
            "shadows.max_lights": np.int64(3),
            "post.exposure": np.float32(1.5),
            "post.auto_exposure": np.bool_(False),
            "seed": np.array(7),
        }
    )
    for path, value in {"shadows.mode": "hard", "shadows.max_lights": 3, "post.exposure": 1.5, "seed": 7}.items():
        assert lookup(settings, path) == value and type(lookup(settings, path)) is type(value)
    assert settings.post.auto_exposure is False


@pytest.mark.parametrize(
    ("path", "value", "says"),
    [
        ("shadows.max_lights", "30", "setting shadows.max_lights: 30 is outside 0 to 29 lights"),
        ("shadows.max_lights", "2.5", "shadows.max_lights: '2.5' is not a whole number"),
        ("shadows.max_lights", 3.0, "shadows.max_lights: 3.0 is not a whole number"),
        ("shadows.max_lights", True, "shadows.max_lights: True is not a whole number"),
        ("shadows.mode", "fuzzy", "shadows.mode: 'fuzzy' is not one of soft, hard, off"),
        ("shadows.mode", 3, "shadows.mode: 3 is not one of soft, hard, off"),
        ("post.exposure", "nan", "post.exposure: nan is outside -30.0 to 30.0 stops"),
        ("post.exposure", float("nan"), "post.exposure: nan is outside"),
        ("post.exposure", "bright", "post.exposure: 'bright' is not a number"),
        ("post.exposure", np.float64(31), "post.exposure: 31.0 is outside"),
        ("post.exposure", np.zeros(2), "post.exposure: array([0., 0.]) is not a number"),
        ("post.exposure", np.zeros((2, 1)), "array([[0.], [0.]]) is not a number"),
        ("post.exposure", "x" * 10_000, "xxx... is not a number"),
        ("shadows." + "x" * 10_000, 1, "xxx... is not one of"),
        ("post.auto_exposure", "maybe", "post.auto_exposure: 'maybe' is not true or false"),
        ("post.auto_exposure", 1, "post.auto_exposure: 1 is not true or false"),
        ("shadow.mode", "hard", "setting 'shadow.mode' does not exist; did you mean 'shadows.mode'?"),
        ("exposure", "1", "setting 'exposure' does not exist; did you mean 'post.exposure' or 'post.auto_exposure'?"),
        ("shadows.mod", "hard", "setting 'shadows.mod' does not exist; did you mean 'mode'?"),
        ("zzz.mode", "hard", "setting 'zzz.mode' does not exist; "),
        ("shadows.tint", "red", "setting 'shadows.tint' does not exist; 'tint' is not one of denoised_lights, "),
        ("shadows.mode.x", "hard", "setting 'shadows.mode.x' does not exist; did you mean 'mode'?"),
        ("shadows", "hard", "setting shadows: 'hard' is not one of low, medium, high; or write shadows.name=value"),
        ("shadows", ShadowsSettings, "is not one of low, medium, high"),
        ("debug", "high", "setting debug: 'high' is not a level, there are none; write debug.name=value"),
        ("seed.x", "1", "setting 'seed.x' does not exist; write seed=value"),
        ("seed", "-1", "setting seed: -1 is outside 0 to 2147483647"),
        ("", "1", "setting '' does not exist"),
        (".seed", "1", "setting '.seed' does not exist"),
        ("seed.", "1", "setting 'seed.' does not exist; write seed=value"),
        (7, "1", "settings: {7: '1'} is not a mapping such as"),
        (("shadows", "mode"), "hard", "is not a mapping such as"),
        ("seed", [np.float64(1.5)], "setting seed: [1.5] is not a whole number"),
        ("shadows.mode", "\x1b[31m", "setting shadows.mode: '\\x1b[31m' is not one of"),
    ],
)
def test_a_bad_value_names_the_setting_the_value_and_the_range(path, value, says):
    with pytest.raises(SettingsError, match=r".") as caught:
        Settings().with_values({path: value})
    assert says in str(caught.value)
    assert isinstance(caught.value, ValueError) and len(str(caught.value)) < 300
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("values", [None, 7, "seed", [("seed", 7)], np.zeros(2), Settings()])
def test_values_come_by_name(values):
    with pytest.raises(SettingsError, match="is not a mapping such as"):
        Settings().with_values(values)


@pytest.mark.parametrize("name", [None, 7, ["quality"], {}, "", "\x1b\n"])
def test_presets_of_other_kinds(name):
    with pytest.raises(SettingsError, match="is not one of performance"):
        Settings.preset(name)


def test_values_are_checked_when_made_in_python_too():
    with pytest.raises(SettingsError, match="max_lights"):
        ShadowsSettings(max_lights=True)
    with pytest.raises(SettingsError, match="auto_exposure"):
        PostSettings(auto_exposure=1)  # type: ignore[arg-type]
    with pytest.raises(SettingsError, match="'3' is not a whole number"):
        ShadowsSettings(max_lights="3")  # type: ignore[arg-type]
    with pytest.raises(SettingsError, match=r"^setting seed: -1 is outside"):
        Settings(seed=-1)
    with pytest.raises(SettingsError, match=r"^setting shadows: 'high' is not ShadowsSettings"):
        Settings(shadows="high")  # type: ignore[arg-type]


def test_distances_are_checked_together_however_they_are_ordered():
    far = {"ambient_occlusion.min_distance": 5, "ambient_occlusion.max_distance": 20}
    assert Settings().with_values(far).ambient_occlusion == AmbientOcclusionSettings(min_distance=5, max_distance=20)
    with pytest.raises(SettingsError, match=r"ambient_occlusion\.min_distance: 5 is not below max_distance 2\.0"):
        Settings().with_values({"ambient_occlusion.min_distance": 5})


def test_settings_do_not_change():
    with pytest.raises(SettingsError, match=r"^settings: seed: stays as it was made; .*: dataclasses\.replace"):
        Settings().seed = 1  # type: ignore[misc]


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Settings(shadow=ShadowsSettings()), "settings: no field 'shadow'; did you mean 'shadows'?"),
        (lambda: ShadowsSettings(mod="hard"), "shadows settings: no field 'mod'; did you mean 'mode'?"),
        (lambda: ShadowsSettings(zzz=1), "shadows settings: no field 'zzz'; there are method, mode, "),
    ],
)
def test_misspelt_fields_are_named(make, says):
    with pytest.raises(SettingsError) as caught:
        make()
    assert str(caught.value).startswith(says)


def test_settings_can_be_copied():
    settings = Settings.preset("raster")
    for copied in (copy.deepcopy(settings), pickle.loads(pickle.dumps(settings)), replace(settings)):
        assert copied == settings and hash(copied) == hash(settings)
    assert replace(settings, seed=1) == settings.with_values({"seed": 1}) != settings


def test_presets():
    assert Settings.preset("quality") == Settings()
    assert Settings.preset("raster").shadows.method == "maps"
    with pytest.raises(SettingsError, match=f"preset 'nonsense' is not one of {', '.join(PRESETS)}"):
        Settings.preset("nonsense")


def test_the_command_line_names_all_presets():
    (option,) = options.Preset.__metadata__
    assert all(preset in option.help for preset in PRESETS)


def test_presets_trade_pixels_and_rays():
    """And never light: none has fewer bounces than the default."""
    pixels = [Settings.preset(name).antialiasing.upscale for name in ("performance", "balanced", "quality")]
    assert pixels == sorted(set(pixels), reverse=True) and pixels[-1] == 1
    for name in ("performance", "balanced", "cinematic"):
        assert Settings.preset(name).global_illumination.bounces == Settings().global_illumination.bounces
    assert Settings.preset("cinematic").shadows == ShadowsSettings(max_lights=4)


@pytest.mark.parametrize("preset", PRESETS)
def test_presets_and_levels_leave_debug_alone(preset):
    assert Settings.preset(preset).debug == DebugSettings()
    assert not DebugSettings.levels


@pytest.mark.parametrize(("group", "level"), LEVELS)
def test_a_level_changes_its_group_alone_and_takes_back_what_another_changed(group, level):
    settings = Settings().with_values({group: level})
    assert settings.changed_groups(Settings()) == (set() if level == "medium" else {group})
    for other in GROUPS[group].levels:
        assert Settings().with_values({group: other}).with_values({group: level}) == settings


@pytest.mark.parametrize("level", ["low", "medium", "high"])
def test_levels_leave_the_technique_to_presets(level):
    techniques = {path: each for path, each in SCHEMA["settings"].items() if each["type"] != "integer"}
    raster = Settings.preset("raster")
    settings = raster.with_values({name: at for name, at in LEVELS if at == level})
    for path in techniques:
        assert lookup(settings, path) == lookup(raster, path)


def test_a_preset_s_level_gives_way_to_a_group_s_and_that_to_a_value_in_any_order():
    values = {"shadows.denoised_lights": "1", "shadows": "high"}
    for given in (values, dict(reversed(values.items()))):
        settings = Settings.preset("balanced").with_values(given)
        assert settings.shadows == ShadowsSettings(max_lights=4, denoised_lights=1)
        assert settings.lighting == Settings.preset("balanced").lighting


def test_changed_groups():
    settings = Settings()
    assert settings.changed_groups(Settings()) == set()
    other = settings.with_values({"shadows.mode": "hard", "post.exposure": 1, "seed": 3})
    assert settings.changed_groups(other) == other.changed_groups(settings) == {"shadows", "post", "seed"}


def test_every_group_names_itself_in_errors_as_on_the_command_line():
    for name, group in GROUPS.items():
        first = fields(group)[0].name
        with pytest.raises(SettingsError, match=rf"^setting {name}\.{first}: "):
            replace(group, **{first: SimpleNamespace()})


def test_the_schema_is_json_and_has_every_setting():
    assert json.loads(json.dumps(SCHEMA, allow_nan=False)) == SCHEMA
    paths = {f"{name}.{each.name}" for name, group in GROUPS.items() for each in fields(group)} | {"seed"}
    assert set(SCHEMA["settings"]) == paths
    assert list(SCHEMA["groups"]) == list(GROUPS)
    for preset in PRESETS:
        assert Settings().with_values(SCHEMA["presets"][preset]["values"]) == Settings.preset(preset)


@pytest.mark.parametrize("path", SCHEMA["settings"])
def test_the_schema_tells_what_a_setting_is(path):
    setting = SCHEMA["settings"][path]
    group, _, name = path.rpartition(".")
    hint = get_type_hints(type(GROUPS[group]) if group else Settings)[name]
    assert len(setting["text"]) > 10 and setting["text"].endswith(".")
    assert setting["default"] == lookup(Settings(), path)
    if get_origin(hint) is Literal:
        assert setting["type"] == "choice"
        assert tuple(setting["choices"]) == get_args(hint)
        assert all(text.endswith(".") for text in setting["choices"].values())
        assert setting["default"] in setting["choices"]
    else:
        assert {bool: "boolean", int: "integer", float: "number"}[hint] == setting["type"]
    if hint in (int, float):
        low, high = setting["range"]
        assert type(low) is type(high) is type(setting["default"]) is hint
        assert low <= setting["default"] <= high
        for end, beyond in ((low, low - 1), (high, high + 1)):
            assert lookup(Settings().with_values({**room(path), path: end}), path) == end
            with pytest.raises(SettingsError, match="is outside"):
                Settings().with_values({path: beyond})
        if path != "seed":
            assert setting["unit"] and setting["higher"] and setting["lower"]
    if "levels" in setting:
        assert len(set(setting["levels"].values())) == len(setting["levels"]), "levels that do not differ"


def room(path):
    """What else must be set for the whole range of a setting to be allowed."""
    return {
        "ambient_occlusion.min_distance": {"ambient_occlusion.max_distance": 10000.0},
        "ambient_occlusion.max_distance": {"ambient_occlusion.min_distance": 0.0},
    }.get(path, {})


def test_groups_and_levels_have_texts():
    for name, group in SCHEMA["groups"].items():
        assert group["text"] and list(group["levels"]) == list(GROUPS[name].levels)
        assert all(text.endswith(".") for text in group["levels"].values())
        assert list(group["levels"]) in ([], ["medium", "high"], ["low", "medium", "high"])


def test_the_page_has_today_s_tables():
    page = settings_page.PAGE.read_text(encoding="utf-8")
    assert settings_page.renewed(page) == page, "run: python tools/settings_page.py"

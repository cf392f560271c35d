from dataclasses import FrozenInstanceError, fields, is_dataclass, replace

import pytest

from pica.errors import SettingsError
from pica.settings import PRESETS, PostSettings, Settings, ShadowsSettings


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


@pytest.mark.parametrize(
    ("path", "text", "says"),
    [
        ("shadows.max_lights", "30", "shadows.max_lights: 30 is outside 1 to 29"),
        ("shadows.max_lights", "2.5", "shadows.max_lights: '2.5' is not a int"),
        ("shadows.mode", "fuzzy", "shadows.mode: 'fuzzy' is not one of soft, hard, off"),
        ("post.exposure", "nan", "post.exposure: nan is outside"),
        ("post.auto_exposure", "maybe", "post.auto_exposure: 'maybe' is not true or false"),
        ("shadow.mode", "hard", "'shadow' is not one of"),
        ("shadows.tint", "red", "'tint' is not one of"),
        ("shadows", "hard", "write group.name=value"),
        ("seed.x", "1", "write group.name=value"),
        ("seed", "-1", "seed: -1 is outside"),
        ("", "1", "does not exist"),
    ],
)
def test_a_bad_value_names_the_setting_the_value_and_the_range(path, text, says):
    with pytest.raises(SettingsError, match=r".") as caught:
        Settings().with_values({path: text})
    assert says in str(caught.value)
    assert isinstance(caught.value, ValueError)


def test_values_are_checked_when_made_in_python_too():
    with pytest.raises(SettingsError, match="max_lights"):
        ShadowsSettings(max_lights=True)
    with pytest.raises(SettingsError, match="auto_exposure"):
        PostSettings(auto_exposure=1)  # type: ignore[arg-type]


def test_settings_do_not_change():
    with pytest.raises(FrozenInstanceError):
        Settings().seed = 1  # type: ignore[misc]


def test_presets():
    assert Settings.preset("hybrid") == Settings()
    assert Settings.preset("raster").shadows.method == "maps"
    with pytest.raises(SettingsError, match=", ".join(PRESETS)):
        Settings.preset("nonsense")


def test_every_group_names_itself_in_errors_as_on_the_command_line():
    settings = Settings()
    for group in fields(settings):
        value = getattr(settings, group.name)
        if is_dataclass(value):
            first = fields(value)[0].name
            with pytest.raises(SettingsError, match=rf"^setting {group.name}\.{first}: "):
                replace(value, **{first: "neither"})

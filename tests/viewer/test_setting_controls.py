"""Controls from the settings' schema."""

from pica.settings import Settings
from pica.viewer.setting_controls import level_of, preset_of, presets, setting_controls


def test_every_setting_has_one_control_that_its_default_fits():
    controls = [control for group in setting_controls() for control in group.controls]
    assert [control.path for control in controls] == list(Settings.schema()["settings"])
    for control in controls:
        assert Settings().with_values({control.path: control.default}) == Settings()
        assert control.text and control.label
        if control.kind in ("integer", "number"):
            assert control.low <= control.default <= control.high
        if control.kind == "choice":
            assert control.default in control.choices


def test_groups_have_their_levels_and_texts():
    groups = {group.name: group for group in setting_controls()}
    assert list(groups["shadow_maps"].levels) == ["low", "medium", "high"]
    assert groups["ambient_occlusion"].label == "Ambient occlusion" and groups["ambient_occlusion"].text
    assert [control.path for control in groups[""].controls] == ["seed"]


def test_levels_and_presets_are_recognized():
    settings = Settings().with_values({"shadow_maps": "high"})
    assert level_of("shadow_maps", settings) == "high"
    assert level_of("shadow_maps", settings.with_values({"shadow_maps.taps": 5})) == ""
    assert level_of("post", settings) == ""
    assert preset_of(Settings.preset("raster")) == "raster" and preset_of(settings) == ""
    assert list(presets()) == list(Settings.schema()["presets"])


def test_texts_say_what_values_do():
    [upscale] = [c for group in setting_controls() for c in group.controls if c.path == "antialiasing.upscale"]
    assert "1 to 3 " in upscale.text and "Higher:" in upscale.text

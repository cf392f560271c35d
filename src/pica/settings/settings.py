"""All settings together: presets, values by name, and the schema that describes them."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, get_type_hints

from pica.errors import SettingsError, plain, shown
from pica.names import checked_names, did_you_mean
from pica.settings.groups import (
    AmbientOcclusionSettings,
    DebugSettings,
    LightingSettings,
    RaysSettings,
    ShadowMapsSettings,
    ShadowsSettings,
    VisibilitySettings,
)
from pica.settings.indirect_groups import (
    GlobalIlluminationSettings,
    ReflectionsSettings,
    TranslucencySettings,
    TransparencySettings,
)
from pica.settings.picture_groups import AntialiasingSettings, PostSettings
from pica.settings.setting import Group, Level, Value, declared, dotted, number


@dataclass(frozen=True)
class Settings(Group):
    """Everything that can be set: `Settings(shadows=ShadowsSettings(mode="hard"))`, or by dotted names, `with_values`.

    Immutable: `with_values` or `dataclasses.replace` make variants.
    """

    visibility: VisibilitySettings = field(default_factory=VisibilitySettings)
    rays: RaysSettings = field(default_factory=RaysSettings)
    shadows: ShadowsSettings = field(default_factory=ShadowsSettings)
    ambient_occlusion: AmbientOcclusionSettings = field(default_factory=AmbientOcclusionSettings)
    shadow_maps: ShadowMapsSettings = field(default_factory=ShadowMapsSettings)
    lighting: LightingSettings = field(default_factory=LightingSettings)
    reflections: ReflectionsSettings = field(default_factory=ReflectionsSettings)
    translucency: TranslucencySettings = field(default_factory=TranslucencySettings)
    transparency: TransparencySettings = field(default_factory=TransparencySettings)
    global_illumination: GlobalIlluminationSettings = field(default_factory=GlobalIlluminationSettings)
    antialiasing: AntialiasingSettings = field(default_factory=AntialiasingSettings)
    post: PostSettings = field(default_factory=PostSettings)
    debug: DebugSettings = field(default_factory=DebugSettings)
    seed: int = number(0, range=(0, 2**31 - 1), unit="", text="Another seed, another noise of the same strength.")

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, group in GROUPS.items():
            if not isinstance(getattr(self, name), group):
                raise SettingsError(f"setting {name}: {shown(plain(getattr(self, name)))} is not {group.__name__}")

    @staticmethod
    def preset(name: str) -> "Settings":
        """Named settings, one of PRESETS: "quality" is the default. Raises SettingsError."""
        if not isinstance(name, str) or name not in PRESETS:
            fault = f"preset {shown(name)} is not one of {', '.join(PRESETS)}"
            raise SettingsError(fault + did_you_mean(name, PRESETS))
        return Settings().with_values(PRESETS[name].values)

    def with_values(self, values: Mapping[str, Value]) -> "Settings":
        """A copy with other levels and values, {"shadows": "high", "shadows.mode": "hard", "seed": 7}.

        Values may also be given as text, as on the command line. Levels are applied first, in any order,
        so that a single setting overrides the level of its group. Raises SettingsError.
        """
        if not isinstance(values, Mapping) or not all(isinstance(path, str) for path in values):
            raise SettingsError(f'settings: {shown(values)} is not a mapping such as {{"shadows.mode": "hard"}}')
        groups: dict[str, dict[str, Any]] = {}
        others: dict[str, Any] = {}
        for path in sorted(values, key=lambda path: path not in GROUPS):
            first, dot, name = path.partition(".")
            if first in GROUPS and not dot:
                groups.setdefault(first, {}).update(GROUPS[first].level_values(values[path]))
            elif first in GROUPS:
                groups.setdefault(first, {})[name] = _value(GROUPS[first], path, name, values[path])
            elif dot and first in declared(Settings):
                raise SettingsError(f"setting {shown(path)} does not exist; write {first}=value")
            else:
                others[first] = _value(Settings, path, first, values[path])
        changed = {name: replace(getattr(self, name), **group) for name, group in groups.items()}
        return replace(self, **changed, **others)

    def values(self) -> dict[str, Value]:
        """Every setting by its dotted name; `Settings().with_values` of it equals these settings."""
        return {
            dotted(type(group), name): getattr(group, name)
            for group in [*(getattr(self, name) for name in GROUPS), self]
            for name in declared(type(group))
        }

    def summary(self) -> str:
        """The nearest preset and the differences from it, such as "quality, shadows.mode=hard"."""
        own = self.values()
        presets = {name: Settings.preset(name).values() for name in PRESETS}
        differing = {
            name: [f"{path}={value}" for path, value in own.items() if value != values[path]]
            for name, values in presets.items()
        }
        nearest = min(differing, key=lambda name: len(differing[name]))
        return ", ".join([nearest, *differing[nearest]])

    def changed_groups(self, other: "Settings") -> frozenset[str]:
        """The differences from other settings: names of groups, and "seed"."""
        return frozenset(item.name for item in fields(self) if getattr(self, item.name) != getattr(other, item.name))

    @staticmethod
    def schema() -> dict[str, Any]:
        """The schema of all settings, as plain values that JSON can hold.

        "settings": by dotted name "type" (integer, number, choice, boolean), "default", "text", for numbers "unit",
        "range" [low, high] and what "higher" and "lower" values buy, for choices "choices" {value: text}, and "levels"
        {level: value} where levels of its group change it. "groups": by name "text" and "levels" {level: text}.
        "presets": by name "text" and "values" {dotted name: value}, where they differ from the defaults.
        """
        settings = {}
        classes: list[type[Group]] = [*GROUPS.values(), Settings]
        for group in classes:
            levels = {level: group.level_values(level) for level in group.levels}
            for name, setting in declared(group).items():
                at = {level: values[name] for level, values in levels.items() if name in values}
                settings[dotted(group, name)] = setting.describe() | ({"levels": at} if at else {})
        groups = {
            name: {"text": group.__doc__, "levels": {level: item.text for level, item in group.levels.items()}}
            for name, group in GROUPS.items()
        }
        presets = {}
        for name, preset in PRESETS.items():
            values = Settings.preset(name).values()
            changed = {path: value for path, value in values.items() if value != settings[path]["default"]}
            presets[name] = {"text": preset.text, "values": changed}
        return {"settings": settings, "groups": groups, "presets": presets}


GROUPS = {
    name: hint for name, hint in get_type_hints(Settings).items() if isinstance(hint, type) and issubclass(hint, Group)
}

for group_type in (*GROUPS.values(), Settings):
    checked_names(SettingsError)(group_type)


PRESETS = {
    "performance": Level(
        "A quarter of the pixels, upscaled.", {"antialiasing.upscale": 2.0, "antialiasing.first_samples": 1}
    ),
    "balanced": Level("Less than half of the pixels, upscaled.", {"antialiasing.upscale": 1.5}),
    "quality": Level("The default: raster or rays find what pixels see, rays its light."),
    "cinematic": Level(
        "Rays of their own for 4 lights, resampled paths, more mirrors in mirrors and glass in glass: half as fast,"
        " for films.",
        {
            "shadows": "high",
            "lighting": "high",
            "lighting.area_shadows": "ratio_estimator",
            "reflections.bounces": 3,
            "transparency": "high",
            "global_illumination.mode": "restir",
        },
    ),
    "raster": Level(
        "No rays at all.",
        {
            "visibility.primary": "raster",
            "shadows.method": "maps",
            "ambient_occlusion.mode": "ground_truth",
            "lighting.environment": "prefiltered",
            "reflections.mode": "screen_space",
            "translucency.mode": "off",
            "transparency.mode": "screen_space",
            "global_illumination.mode": "light_map",
        },
    ),
    "pica_pica": Level(
        "The frame of RTG 25, PICA PICA: surfels with occlusion in screen space, sun shadows by SVGF, one reflection"
        " for four pixels, glass in texture space.",
        {
            "shadows.denoiser": "svgf",
            "ambient_occlusion.mode": "ground_truth",
            "reflections.rays": "quarter",
            "reflections.bounces": 1,
            "reflections.simplified_materials": True,
            "transparency.texture_space": "all",
            "global_illumination.mode": "surfels",
        },
    ),
    "ue4_reflections": Level(
        "The frame of RTG 19's demo Reflections: filtered shadows of area lights as a ratio, mirror rays of two"
        " bounces, indirect rays that end in a light map, translucency in screen space.",
        {
            "shadows": "high",
            "lighting.area_shadows": "ratio_estimator",
            "reflections.reconstruction": "mirror_rays",
            "reflections.simplified_materials": True,
            "translucency.mode": "screen_space",
            "transparency.texture_space": "off",
        },
    ),
    "ue4_speed_of_light": Level(
        "The frame of RTG 19's demo Speed of Light: area lights met by reflection rays, two bounces of indirect light.",
        {
            "shadows": "high",
            "reflections.area_lights": True,
            "reflections.reconstruction": "mirror_rays",
            "reflections.simplified_materials": True,
            "translucency.mode": "screen_space",
            "transparency.texture_space": "off",
            "global_illumination.bounces": 2,
        },
    ),
}
"""What `Settings.preset` knows. The last three are frames of publications (docs/how-it-works/stages.md)."""


def _value(group: type[Group], path: str, name: str, value: Any) -> Any:
    """The value of a setting, read if it is text. Raises SettingsError if there is no such setting."""
    settings = declared(group)
    if name not in settings:
        groups = [*GROUPS.values(), Settings] if group is Settings else [group]
        names = [*settings, *GROUPS] if group is Settings else list(settings)
        all_paths = [dotted(item, setting) for item in groups for setting in declared(item)]
        hint = did_you_mean(path, [*all_paths, *GROUPS]) if group is Settings else did_you_mean(name, names)
        listed = f"; {shown(name)} is not one of {', '.join(sorted(names))}"
        raise SettingsError(f"setting {shown(path)} does not exist{hint or listed}")
    return settings[name].read(value) if isinstance(value, str) else value

"""Every setting of the renderer. docs/guide/settings.md lists them; a new one is declared in `groups`,
`indirect_groups` or `picture_groups`."""

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
from pica.settings.settings import PRESETS, Settings

__all__ = [
    "PRESETS",
    "AmbientOcclusionSettings",
    "AntialiasingSettings",
    "DebugSettings",
    "GlobalIlluminationSettings",
    "LightingSettings",
    "PostSettings",
    "RaysSettings",
    "ReflectionsSettings",
    "Settings",
    "ShadowMapsSettings",
    "ShadowsSettings",
    "TranslucencySettings",
    "TransparencySettings",
    "VisibilitySettings",
]

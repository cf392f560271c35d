"""Every setting of the renderer: its unit, its range and what more or less of it buys."""

import re
from dataclasses import dataclass, field, fields, is_dataclass, replace
from typing import Any, Literal, get_args, get_origin, get_type_hints

from pica.errors import SettingsError


def _range(low: float, high: float, default: float) -> Any:
    return field(default=default, metadata={"range": (low, high)})


class _Checked:
    """Checks every field of a settings group against its type and range."""

    def __post_init__(self) -> None:
        hints = get_type_hints(type(self))
        for setting in fields(self):  # type: ignore[arg-type]
            value, hint = getattr(self, setting.name), hints[setting.name]
            group = re.sub("(?<!^)(?=[A-Z])", "_", type(self).__name__.removesuffix("Settings")).lower()
            where = f"{group}.{setting.name}"
            if get_origin(hint) is Literal and value not in get_args(hint):
                raise SettingsError(f"setting {where}: {value!r} is not one of {', '.join(map(str, get_args(hint)))}")
            if hint is bool and not isinstance(value, bool):
                raise SettingsError(f"setting {where}: {value!r} is not true or false")
            if "range" in setting.metadata:
                low, high = setting.metadata["range"]
                numeric = isinstance(value, (int, float)) and not isinstance(value, bool)
                if not numeric or (hint is int and not isinstance(value, int)) or not low <= value <= high:
                    raise SettingsError(f"setting {where}: {value!r} is outside {low} to {high}")


@dataclass(frozen=True)
class VisibilitySettings(_Checked):
    """What each pixel sees first."""

    primary: Literal["auto", "raster", "rays"] = "auto"
    """How triangles reach the pixels; auto takes what is faster on the device. Both give the same G-buffer."""


@dataclass(frozen=True)
class GeometrySettings(_Checked):
    """Meshes that deform."""

    rebuild_at: float = _range(0.0, 100.0, 1.5)
    """Cost of a refitted bottom-level structure over its cost when built at which it is built anew. Higher: fewer
    rebuilds, slower rays in between; 0: always."""


@dataclass(frozen=True)
class RaysSettings(_Checked):
    """How rays are traced."""

    scheduler: Literal["auto", "pipeline", "buffers"] = "auto"
    """pipeline: ray generation shaders; buffers: rays and hits go through buffers, which tracers outside of shaders
    need; auto: buffers where the tracer is Embree, else pipeline."""
    tracer: Literal["auto", "device", "embree"] = "auto"
    """What traces ray buffers. device: its own ray tracing pipeline; embree: Embree on the processor, if embreex
    and numba are installed; auto: Embree where the device runs on the processor too and Embree is installed."""
    simplified_materials: bool = False
    """Reflection rays meet materials without normal maps and with coarse textures (docs/materials.md). Cheaper, and
    reflections lose their small detail. The path tracer, as the reference, never simplifies."""


@dataclass(frozen=True)
class ShadowsSettings(_Checked):
    """Shadows of every light."""

    method: Literal["rays", "maps"] = "rays"
    """rays: traced from every pixel; maps: shadow maps, which need no rays and only approximate soft shadows."""
    mode: Literal["soft", "hard", "off"] = "soft"
    """soft: one ray a frame to a random point of the light; hard: to its centre; off: no shadows."""
    transparent: bool = True
    """Shadow rays go on through materials that let light through and take their colour; false: those are opaque. Costs
    nothing in scenes without any, else a ray for each surface on the way. The path tracer follows it too."""
    max_lights: int = _range(1, 29, 8)
    """Lights with a shadow ray of their own. Higher: less noise with many lights, more rays and memory;
    the lights beyond and all emissive triangles share one ray. Visibility has 32 bits a pixel."""
    denoiser: Literal["anisotropic", "svgf", "off"] = "anisotropic"
    """Filter of soft shadows, for lights that choose none themselves. anisotropic: along the penumbra that light and
    occluder make, for rays that also find the occluder's distance; follows the shadows of lights that move; svgf: as
    wide as the variance asks for (docs/shadows.md compares them); off: none, for light that converges over many frames
    without any bias."""
    denoised_lights: int = _range(0, 16, 4)
    """Soft lights, strongest first, whose shadows are filtered. Higher: less noise with many lights; each takes about
    50 bytes a pixel and time for its filter."""
    history: int = _range(1, 64, 8)
    """Frames that filtered shadows remember while something moves; 1: none, so each frame stands alone. Higher: less
    noise, shadows that lag behind. While nothing moves all frames count."""


@dataclass(frozen=True)
class AmbientOcclusionSettings(_Checked):
    """How open the surroundings of each surface are: dims ambient light that has no shadows of its own."""

    mode: Literal["off", "ray_traced", "ground_truth"] = "off"
    """ray_traced: rays about the normal; ground_truth: GTAO, from the depth buffer alone. A sampled environment
    has shadows of its own and is not dimmed."""
    rays: int = _range(1, 16, 1)
    """Rays a pixel and frame (ray_traced). Higher: less noise, more time."""
    min_distance: float = _range(0.0, 1000.0, 0.0)
    """Metres; what is nearer hides nothing. Above 0: fine detail, dimmed by its textures already, stays bright."""
    max_distance: float = _range(0.001, 10000.0, 2.0)
    """Metres; what is further hides nothing. Near field: about 0.5; far field: about 20. Higher: slower rays."""
    filter: bool = True
    """Smooth over neighbours and earlier frames. false: this frame's rays or horizons alone."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.min_distance >= self.max_distance:
            raise SettingsError(
                f"setting ambient_occlusion.min_distance: {self.min_distance} is not below max_distance"
                f" {self.max_distance}"
            )


@dataclass(frozen=True)
class ShadowMapsSettings(_Checked):
    """Shadow maps, where shadows.method is "maps"."""

    max_lights: int = _range(0, 16, 4)
    """Lights with maps, the strongest first; the others throw no shadow. Higher: more memory and time a light."""
    cascades: int = _range(1, 6, 4)
    """Maps of a directional light, one behind the other along the view. Higher: finer far away, more to draw."""
    cascade_size: int = _range(64, 8192, 2048)
    """Texels along the edge of each cascade. Higher: sharper and more memory, 4 bytes a texel."""
    cascade_split: float = _range(0.0, 1.0, 0.75)
    """Between cascades of equal depth (0) and of equal depth ratio (1). Higher: finer near the camera."""
    cascade_margin: float = _range(0.0, 1.0, 0.25)
    """Share by which a cascade is larger than need be. Higher: drawn more seldom as the camera moves, but coarser."""
    face_size: int = _range(64, 4096, 512)
    """Texels along the edge of a spot light's map and of each of the six or five of other lights."""
    taps: int = _range(4, 64, 16)
    """Places at which a soft shadow looks for what is in the way, and then how much. Higher: less noise, slower."""


@dataclass(frozen=True)
class LightingSettings(_Checked):
    """Direct light."""

    environment: Literal["sampled", "prefiltered", "off"] = "sampled"
    """sampled: one ray a frame, by importance, with shadows; prefiltered: no rays, no shadows, no noise."""
    candidates: int = _range(1, 64, 16)
    """Samples among which the shared ray of many lights chooses, by the light that they would bring without shadows.
    Higher: less noise, more time; no bias with any. Never more than there are such lights and emissive triangles."""
    area_lights: Literal["ltc", "sampled"] = "ltc"
    """Light of slots with filtered shadows. ltc: all of it at once, by linearly transformed cosines, times the shadow;
    no noise but that of the shadow. sampled: from the point that the shadow ray went to."""
    area_shadows: Literal["split_sum", "ratio"] = "split_sum"
    """What a filtered shadow is the share of. split_sum: of the light's irradiance, exact on matte surfaces; ratio: of
    what the surface reflects of it, so that a hidden part of the light leaves the highlight too. For noisier shadows on
    glossy surfaces, and time for the BRDF in the shadow rays."""
    filter: bool = True
    """Smooth the light that one ray brings of many lights, emissive triangles, the sampled environment and the soft
    lights beyond shadows.denoised_lights, over neighbours and earlier frames. false: this frame's samples alone."""


@dataclass(frozen=True)
class PostSettings(_Checked):
    """From scene radiance to the display."""

    exposure: float = _range(-30.0, 30.0, 0.0)
    """Stops added to the automatic exposure, or the exposure itself (2**-exposure nits is white) without it."""
    auto_exposure: bool = True
    """Choose the exposure from the picture's average luminance."""


@dataclass(frozen=True)
class Settings(_Checked):
    """Everything that can be set. Immutable: `dataclasses.replace` or `with_values` make variants."""

    visibility: VisibilitySettings = field(default_factory=VisibilitySettings)
    geometry: GeometrySettings = field(default_factory=GeometrySettings)
    rays: RaysSettings = field(default_factory=RaysSettings)
    shadows: ShadowsSettings = field(default_factory=ShadowsSettings)
    ambient_occlusion: AmbientOcclusionSettings = field(default_factory=AmbientOcclusionSettings)
    shadow_maps: ShadowMapsSettings = field(default_factory=ShadowMapsSettings)
    lighting: LightingSettings = field(default_factory=LightingSettings)
    post: PostSettings = field(default_factory=PostSettings)
    seed: int = _range(0, 2**31 - 1, 0)
    """Another seed, another noise of the same strength."""

    @staticmethod
    def preset(name: str) -> "Settings":
        """Named settings: "hybrid" (the default) or "raster" (no rays at all). Raises SettingsError."""
        if name not in PRESETS:
            raise SettingsError(f"preset {name!r} is not one of {', '.join(PRESETS)}")
        return PRESETS[name]

    def with_values(self, values: dict[str, str]) -> "Settings":
        """A copy with settings given as text, {"shadows.mode": "hard"}. Raises SettingsError."""
        settings = self
        for path, text in values.items():
            settings = _with_value(settings, path, path.split("."), text)
        return settings


def _with_value(group: Any, path: str, names: list[str], text: str) -> Any:
    known = {setting.name for setting in fields(group)}
    if names[0] not in known:
        raise SettingsError(f"setting {path!r} does not exist; {names[0]!r} is not one of {', '.join(sorted(known))}")
    current = getattr(group, names[0])
    if is_dataclass(current) != (len(names) > 1):
        raise SettingsError(f"setting {path!r} does not exist; write group.name=value")
    value = _with_value(current, path, names[1:], text) if len(names) > 1 else _parsed(path, current, text)
    return replace(group, **{names[0]: value})


def _parsed(path: str, current: Any, text: str) -> Any:
    try:
        if isinstance(current, bool):
            return {"true": True, "false": False}[text.lower()]
        return type(current)(text)
    except (KeyError, ValueError):
        kind = "true or false" if isinstance(current, bool) else f"a {type(current).__name__}"
        raise SettingsError(f"setting {path}: {text!r} is not {kind}") from None


PRESETS = {
    "hybrid": Settings(),
    "raster": Settings(
        visibility=VisibilitySettings("raster"),
        shadows=ShadowsSettings("maps"),
        ambient_occlusion=AmbientOcclusionSettings("ground_truth"),
        lighting=LightingSettings("prefiltered"),
    ),
}

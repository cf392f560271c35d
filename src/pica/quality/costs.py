"""What a frame costs by effect, beside what publications state: the rows of RTG 25, figure 25-31."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class EffectCost:
    """A row of the table of `pica bench --table`."""

    effect: str
    ms: float
    """GPU milliseconds of a frame while the camera moves."""
    rest_ms: float
    """While nothing moves."""
    rays: int
    """Paths started in a moving frame."""
    bytes: int
    """Device memory of its textures and buffers; that of "shared" effects use one after the other."""
    published: str
    """What a publication states of its own effect, scene and card; "" where none does."""
    source: str


_PUBLISHED = {
    "global_illumination": ("0.35 ms, 250,000 surfels, a ray each; pre-release Turing", "RTG 25, 25.2.6"),
    "reflections": ("a quarter of a ray a pixel, and one to a light", "RTG 25, 25.2.2"),
    "shadows": ("a ray a pixel for each light", "RTG 25, 25.2.1"),
    "ambient_occlusion": ("1 or 2 rays a pixel", "RTG 25, 25.2.3"),
    "frame": ("60 frames a second at 1920x1080; Titan V", "RTG 25, 25.3, and the talk"),
}
"""By effect: the numbers that stand in the text. Those of figure 25-31 itself are in a picture."""


def effect_costs(moving: Mapping[str, Any], rest: Mapping[str, Any]) -> list[EffectCost]:
    """Rows of what `pica.quality.benchmark.benchmark` measured of the same renderer twice, and their sum, "frame"."""
    ms, rest_ms = (figures.get("effect_ms", {}) for figures in (moving, rest))
    rays, memory = moving.get("effect_rays", {}), moving.get("effect_bytes", {})
    costs = []
    for name in dict.fromkeys([*ms, *rest_ms, *rays, *memory]):
        cost = _row(name, ms.get(name, 0.0), rest_ms.get(name, 0.0), rays.get(name, 0), memory.get(name, 0))
        if cost.ms or cost.rest_ms or cost.rays or cost.bytes:
            costs.append(cost)
    frame, rest_frame = (figures["gpu_ms"]["frame"] for figures in (moving, rest))
    return [*costs, _row("frame", frame, rest_frame, sum(rays.values()), sum(memory.values()))]


def _row(name: str, ms: float, rest_ms: float, rays: int, size: int) -> EffectCost:
    return EffectCost(name, ms, rest_ms, rays, size, *_PUBLISHED.get(name, ("", "")))

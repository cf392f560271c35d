"""The content of each AOV: its unit, its channels, its value at the background, and its frame."""

from dataclasses import dataclass
from math import inf, nan
from typing import Literal


@dataclass(frozen=True)
class AovInfo:
    """The content of an AOV."""

    name: str
    meaning: str = ""
    unit: str = ""
    """Empty: none."""
    channels: int | None = None
    """1: the array is (height, width); None: not the same for all scenes."""
    background: float | None = None
    """The channels' value at the background; None: it varies."""
    frame: Literal["first", "last"] = "last"
    """Which frame of a `render` call it is from. All have the last frame's picture."""
    on_request: bool = False
    """Whether only `render(aovs=[...])` with its name makes it."""


def _table(*rows: AovInfo) -> dict[str, AovInfo]:
    return {row.name: row for row in rows}


AOVS = _table(
    AovInfo("depth", "distance along the view axis", "metres", 1, inf, "first"),
    AovInfo("position", "place in the world", "metres", 3, nan, "first"),
    AovInfo("normal", "with normal maps, world space, unit length", "", 3, 0, "first"),
    AovInfo("geometric_normal", "without normal maps, world space, unit length", "", 3, 0, "first"),
    AovInfo("albedo", "base colour, linear Rec. 709", "", 3, 0, "first"),
    AovInfo("metallic", "0 to 1", "", 1, 0, "first"),
    AovInfo("roughness", "0 to 1; GGX's alpha is its square", "", 1, 0, "first"),
    AovInfo("emission", "light that the surface emits, linear Rec. 709", "nits", 3, 0, "first"),
    AovInfo("motion", "right and down to where the place was in the frame before", "pixels", 2, None, "first"),
    AovInfo("instance", "number of the node, see `Frame.ids`", "", 1, 0, "first"),
    AovInfo("material", "number of the material, see `Frame.material_ids`", "", 1, 0, "first"),
    AovInfo("uv", "first texture coordinates, v down", "", 2, nan, "first", on_request=True),
    AovInfo("shadows", "1 where the light's sample arrives, else 0; a channel a light slot", "", None, None),
    AovInfo("ambient_occlusion", "open share of the surroundings, 0 to 1", "", 1, None),
    AovInfo("diffuse_direct", "light of emitters that surfaces reflect diffusely, linear Rec. 709", "nits", 3, 0),
    AovInfo("glossy_direct", "the same by their specular part, but for what is in `reflections`", "nits", 3, 0),
    AovInfo("diffuse_indirect", "light that surfaces reflect diffusely of others, linear Rec. 709", "nits", 3, 0),
    AovInfo("subsurface", "light that surfaces let through, linear Rec. 709", "nits", 3, 0),
    AovInfo("reflections", "light that surfaces mirror, of emitters too, linear Rec. 709", "nits", 3, 0),
    AovInfo(
        "transmission",
        "what transmissive and blended surfaces change: light through and off them, less that of what they hide",
        "nits",
        3,
        None,
    ),
    AovInfo(
        "combined", "the last frame's picture before antialiasing, linear Rec. 709", "nits", 3, None, on_request=True
    ),
    AovInfo(
        "environment", "what is seen of the surroundings themselves, linear Rec. 709", "nits", 3, None, on_request=True
    ),
    AovInfo("alpha", "covered share of the picture's pixel, 0 to 1; if the background is transparent", "", 1, 0),
)
"""All but debug AOVs and those of inserted effects, by name."""


def aov_info(name: str) -> AovInfo:
    """Of one AOV; those that are not in the table are from the last frame."""
    return AOVS.get(name) or AovInfo(name)

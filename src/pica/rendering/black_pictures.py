"""Pictures that are nearly black: why, in one line, once for each renderer."""

import warnings
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any
from weakref import ref

import numpy as np
from numpy.typing import NDArray

from pica.color import luminance
from pica.scene.illumination import emitted_illuminance, has_lights
from pica.scene.model import Scene
from pica.settings import PostSettings, Settings

Lazy = Callable[[], NDArray[Any]]

_DARK = 2.0
"""Of 255, the mean of a picture, and of the surfaces in it, below which either is nearly black."""
_STEP = 4
"""Every so many pixels are looked at, each way, while nothing is suspicious."""
_LEAST_SEEN = 1e-3
"""Of the picture; surfaces in less of it are as good as none."""
_NEAR = 1e-3
"""Of the scene's diagonal: if all visible surfaces are nearer, the camera is probably inside an object."""


class BlackPictures:
    """Checks pictures when they are fetched, and warns of the first that is nearly black."""

    def __init__(self) -> None:
        self._warned = False

    def watched(self, pictures: Mapping[str, Lazy], scene: Scene, settings: Settings) -> tuple[Lazy, Lazy]:
        """Functions that fetch pictures["color"] and pictures["display"], and warn if they are nearly black.

        If one seems black, the other one and pictures["depth"] are fetched too; without depth nothing is reported. The
        scene is referenced weakly.
        """
        if "depth" not in pictures:
            return pictures["color"], pictures["display"]
        still_there = ref(scene)

        def fetch(name: str) -> NDArray[Any]:
            picture = pictures[name]()
            if not self._warned and seem_black(name, picture).any():
                images = {
                    other: picture if other == name else pictures[other]() for other in ("display", "color", "depth")
                }
                reason = why_black(**images, scene=still_there(), post=settings.post)
                if reason:
                    self._warned = True
                    warnings.warn(f"the picture is nearly black: {reason}", stacklevel=2)
            return picture

        return partial(fetch, "color"), partial(fetch, "display")


def seem_black(name: str, pictures: NDArray[Any]) -> NDArray[np.bool_]:
    """Which of (..., height, width, 3) pictures, "color" or "display", deserve a second look."""
    seen = pictures[..., ::_STEP, ::_STEP, :].mean(axis=(-3, -2, -1))
    return np.asarray(seen <= (_DARK if name == "display" else 0))


def why_black(
    display: NDArray[Any], color: NDArray[Any], depth: NDArray[Any], scene: Scene | None, post: PostSettings
) -> str:
    """Why a picture (height, width, 3) of `depth` (height, width) is nearly black, and a remedy; empty if it is not,
    if hardly any surface is visible, or if the scene (None once it is freed) would be needed."""
    visible = np.isfinite(depth)
    if visible.mean() < _LEAST_SEEN:
        return "the camera sees hardly any surface; another camera may (without one, the whole scene is shown)"
    if display[visible].mean() >= _DARK or scene is None:
        return ""
    if not has_lights(scene) and not emitted_illuminance(scene) and not _environment_shines(scene):
        return "nothing in the scene gives light; add a light or an environment (--env)"
    lit = luminance(color[visible])
    lit = lit[lit > 0]
    if len(lit) and not post.auto_exposure:
        white, level = 2.0**-post.exposure, float(np.percentile(lit, 90))
        if level < white / 8:
            says = f"post.exposure={post.exposure:.3g} makes {white:.3g} nits white, and what is seen has {level:.3g}"
            return f"{says}; try post.exposure={-np.log2(level):.3g}, or post.auto_exposure=true"
    low, high = scene.bounds()
    if depth[visible].max() < _NEAR * np.linalg.norm(high - low):
        return "all that the camera sees is right in front of it, as if it stood inside of something; move it"
    return "hardly any light reaches what is seen; move the lights, or add an environment (--env)"


def _environment_shines(scene: Scene) -> bool:
    environment = scene.environment
    return environment is not None and bool(environment.radiance.max() * environment.strength > 0)

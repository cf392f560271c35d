"""Environment and background, in the extras of the scene."""

from typing import Any

from pica.scene.environment import Environment
from pica.scene.gltf_export.container import Asset, differing
from pica.scene.light import Color


def environment_entry(asset: Asset, environment: Environment | None) -> dict[str, Any] | None:
    """What the scene's extras have of an environment; its radiance is an accessor, so that no digit is lost."""
    if environment is None:
        return None
    _, width, _ = environment.radiance.shape
    return {"radiance": asset.accessor(environment.radiance.reshape(-1, 3)), "width": width} | differing(
        strength=(environment.strength, 1.0), rotation=(environment.rotation, 0.0), name=(environment.name, "")
    )


def background_entry(asset: Asset, background: Color | Environment | None) -> Color | dict[str, Any] | None:
    """The same of Scene.background."""
    return environment_entry(asset, background) if isinstance(background, Environment) else background

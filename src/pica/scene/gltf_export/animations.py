"""Animations (3.11), and KHR_animation_pointer."""

from collections.abc import Iterable
from typing import Any

from pica.scene.animation import Animation, Channel
from pica.scene.field_channel import FieldChannel
from pica.scene.gltf.curves import Curve
from pica.scene.gltf_export.container import Asset
from pica.scene.gltf_export.field_animations import pointers
from pica.scene.gltf_export.materials import Materials
from pica.scene.node import Node


def add_animations(asset: Asset, animations: Iterable[Animation], rows: dict[Node, int], materials: Materials) -> None:
    """Add animations of nodes, whose indices are `rows`, and of fields."""
    for animation in animations:
        if animation.drivers:
            asset.leave_out("animations by code", len(animation.drivers))
        kept = [part for channel in animation.channels for part in _parts(asset, channel, rows, materials)]
        if not kept:
            continue
        last = max(float(curve.times[-1]) for _, curve in kept)
        entry = {
            "name": animation.name,
            "channels": [{"sampler": row, "target": target} for row, (target, _) in enumerate(kept)],
            "samplers": [_sampler(asset, target["path"], curve) for target, curve in kept],
            "extras": asset.extras({}, {"duration": animation.duration if animation.duration > last else None}),
        }
        asset.add("animations", entry)


def _parts(
    asset: Asset, channel: Channel | FieldChannel, rows: dict[Node, int], materials: Materials
) -> list[tuple[dict[str, Any], Curve]]:
    """The targets that a channel becomes, with a curve for each."""
    if channel.times[0] < 0:
        asset.leave_out("animations that start before 0 s")
        return []
    if isinstance(channel, FieldChannel):
        curves = pointers(asset, channel, rows, materials)
        if not curves:
            asset.leave_out("animations of fields")
        extensions = [asset.extensions(KHR_animation_pointer={"pointer": pointer}) for pointer in curves]
        targets = [{"path": "pointer", "extensions": extension} for extension in extensions]
        return list(zip(targets, curves.values(), strict=True))
    if channel.node not in rows:
        asset.leave_out("animations of nodes outside the scene")
        return []
    target = {"node": rows[channel.node], "path": channel.path}
    return [(target, Curve(channel.times, channel.values, channel.interpolation))]


def _sampler(asset: Asset, path: str, curve: Curve) -> dict[str, Any]:
    rows = curve.values.reshape(-1, 1 if path == "weights" else curve.values.shape[-1])
    sampler = {"input": asset.accessor(curve.times, bounded=True), "output": asset.accessor(rows)}
    return sampler if curve.interpolation == "LINEAR" else sampler | {"interpolation": curve.interpolation}

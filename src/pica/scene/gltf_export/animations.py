"""Animations (3.11)."""

from collections.abc import Iterable
from typing import Any

from pica.scene.animation import Animation, Channel
from pica.scene.gltf_export.container import Asset
from pica.scene.node import Node


def add_animations(asset: Asset, animations: Iterable[Animation], rows: dict[Node, int]) -> None:
    """Add animations of nodes, whose indices are `rows`."""
    for animation in animations:
        if animation.drivers:
            asset.leave_out("animations by code", len(animation.drivers))
        channels = [channel for channel in animation.channels if _is_kept(asset, channel, rows)]
        if not channels:
            continue
        samplers = [_sampler(asset, channel) for channel in channels]
        targets = [{"node": rows[channel.node], "path": channel.path} for channel in channels]
        last = max(float(channel.times[-1]) for channel in channels)
        entry = {
            "name": animation.name,
            "channels": [{"sampler": row, "target": target} for row, target in enumerate(targets)],
            "samplers": samplers,
            "extras": asset.extras({}, {"duration": animation.duration if animation.duration > last else None}),
        }
        asset.add("animations", entry)


def _is_kept(asset: Asset, channel: Channel, rows: dict[Node, int]) -> bool:
    if channel.node not in rows:
        asset.leave_out("animations of nodes outside the scene")
        return False
    if channel.times[0] < 0:
        asset.leave_out("animations that start before 0 s")
        return False
    return True


def _sampler(asset: Asset, channel: Channel) -> dict[str, Any]:
    values = channel.values
    rows = values.reshape(-1, 1 if channel.path == "weights" else values.shape[-1])
    sampler = {"input": asset.accessor(channel.times, bounded=True), "output": asset.accessor(rows)}
    return sampler if channel.interpolation == "LINEAR" else sampler | {"interpolation": channel.interpolation}

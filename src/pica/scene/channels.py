"""Lighting channels: which lights and which meshes have to do with each other (RTG 19, 19.2.1.8)."""

from collections.abc import Iterable
from functools import cache
from operator import index

from pica.errors import SceneError, shown

CHANNEL_COUNT = 6
ALL_CHANNELS = frozenset(range(CHANNEL_COUNT))


def checked_channels(channels: Iterable[int]) -> frozenset[int]:
    """The channels as a set. Raises SceneError for anything else."""
    try:
        chosen = frozenset(index(channel) for channel in channels)
    except Exception:  # raised by iteration
        chosen = None
    if chosen is None or not chosen <= ALL_CHANNELS:
        raise SceneError(f"lighting channels {shown(channels)}: must be some of the numbers 0 to {CHANNEL_COUNT - 1}")
    return chosen


@cache
def channel_bits(channels: frozenset[int]) -> int:
    """Bit n is channel n."""
    return sum(1 << channel for channel in channels)

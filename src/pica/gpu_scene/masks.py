"""Instance masks: which ray types hit a node's mesh; bits as in gpu_scene/table_rows.slang."""

from pica.scene.channels import ALL_CHANNELS, channel_bits
from pica.scene.model import Node

SEEN_BY_CAMERA, SEEN_BY_SURFACES, FIRST_SHADOW_BIT = 1, 2, 2
INSTANCE_MASK = 0xFF
"""The bits of `mask_and_channels` that are the instance mask."""
_ALL = channel_bits(ALL_CHANNELS)


def instance_mask(node: Node) -> int:
    """One bit for camera rays, one for surface rays, and one for the shadow rays of each lighting channel."""
    shadows = shadow_mask(node.lighting_channels) if node.casts_shadows else 0
    return SEEN_BY_CAMERA * node.visible_to_camera | SEEN_BY_SURFACES * node.visible_to_reflections | shadows


def shadow_mask(channels: frozenset[int]) -> int:
    """Mask of shadow rays to a light of these channels."""
    return channel_bits(channels) << FIRST_SHADOW_BIT


def mask_and_channels(node: Node) -> int:
    """As the instances of shaders have it."""
    return instance_mask(node) | channel_bits(node.lighting_channels) << 8


def is_masked(bits: int) -> bool:
    """Whether `mask_and_channels` exclude the mesh from some light, or have it hit by only one of shadow and surface
    rays."""
    casts_shadows, seen_by_surfaces = bits >> FIRST_SHADOW_BIT & _ALL != 0, bits & SEEN_BY_SURFACES != 0
    return bits >> 8 != _ALL or casts_shadows != seen_by_surfaces

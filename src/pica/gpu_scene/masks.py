"""Which rays meet a node's mesh: bits of its instance mask, as gpu_scene/scene_types.slang has them."""

from pica.scene.channels import ALL_CHANNELS, channel_bits
from pica.scene.model import Node

SEEN_BY_CAMERA, SEEN_BY_SURFACES, FIRST_SHADOW_BIT = 1, 2, 2


def instance_mask(node: Node) -> int:
    """One bit for camera rays, one for surface rays, and one for the shadow rays of each lighting channel."""
    shadows = shadow_mask(node.lighting_channels) if node.casts_shadows else 0
    return SEEN_BY_CAMERA * node.visible_to_camera | SEEN_BY_SURFACES * node.visible_to_reflections | shadows


def shadow_mask(channels: frozenset[int]) -> int:
    """What shadow rays to a light of these channels may meet."""
    return channel_bits(channels) << FIRST_SHADOW_BIT


def mask_and_channels(node: Node) -> int:
    """As the instances of shaders have it."""
    return instance_mask(node) | channel_bits(node.lighting_channels) << 8


def is_masked(node: Node) -> bool:
    """Whether some light does not reach the mesh, or shadow rays and surface rays differ about it."""
    return node.lighting_channels != ALL_CHANNELS or node.casts_shadows != node.visible_to_reflections

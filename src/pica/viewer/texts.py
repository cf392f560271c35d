"""What user interfaces tell of pictures, cameras and what was picked."""

from collections.abc import Mapping, Sequence

from pica.renderer import Picked
from pica.rhi.device import Device
from pica.scene.camera import Camera
from pica.scene.node import Node
from pica.viewer.costs import Costs
from pica.viewer.viewer import Picture


def status(picture: Picture) -> str:
    """The size of a picture and its time."""
    width, height = picture.size
    return f"{width}x{height}, {picture.frames} frames, {1000 * picture.seconds:.0f} ms a frame"


def span(costs: Costs) -> str:
    """How the time of frames has changed."""
    sums = costs.sums or [0.0]
    return f"{sums[-1]:.2f} ms in all; {min(sums):.2f} to {max(sums):.2f} in the last {len(sums)} samples"


def ray_lines(rays: Mapping[str, int]) -> list[str]:
    """Numbers of rays by pass, most first, of a frame at rest."""
    rows = sorted(((name, count) for name, count in rays.items() if count > 0), key=lambda row: -row[1])
    return [f"{count:,} {name.replace('_', ' ')}" for name, count in rows]


def memory(device: Device) -> str:
    """What pica has allocated on a device."""
    return f"{device.memory / 1e6:.0f} MB of device memory"


def camera_names(cameras: Sequence[Camera]) -> list[str]:
    """Distinct names of a scene's cameras."""
    return [f"{number}: {camera.name or 'camera'}" for number, camera in enumerate(cameras)]


def picked_rows(picked: Picked) -> list[tuple[str, str]]:
    """What is known of a picked surface: names and texts."""
    part = f"section {picked.section}" if picked.section is not None else f"primitives {picked.primitives}"
    return [
        ("node", _path(picked.node) + (f", instance {picked.instance}" if picked.node.instances is not None else "")),
        ("mesh", f"{picked.mesh.name or '(no name)'}, {part}, element {picked.element}"),
        ("material", picked.material.name or "(no name)"),
        ("position", ", ".join(f"{value:.4g}" for value in picked.position) + " m"),
        ("normal", ", ".join(f"{value:.3f}" for value in picked.normal)),
        ("distance", f"{picked.distance:.4g} m"),
    ]


def _path(node: Node) -> str:
    above = "" if node.parent is None else f"{_path(node.parent)}/"
    return above + (node.name or "#")

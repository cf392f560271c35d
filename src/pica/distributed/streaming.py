"""Samples that are rendered while a network trains on them."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pica.distributed.samples import LABELS, checked_labels
from pica.distributed.viewpoints import SPHERE, Cameras
from pica.errors import PicaError, SettingsError
from pica.rendering.arguments import checked_count, checked_size
from pica.scene.camera import Camera
from pica.scene.model import Scene
from pica.scene.values import checked, instance, optional, text, whole
from pica.settings import Settings

if TYPE_CHECKING:
    from torch.utils.data import IterableDataset


def torch_dataset(
    scene: Scene | Callable[[], Scene],
    *,
    cameras: Cameras = SPHERE,
    camera: Camera | None = None,
    count: int | None = None,
    labels: Sequence[str] = LABELS,
    size: tuple[int, int] = (640, 360),
    frames: int = 8,
    settings: Settings | None = None,
    seed: int = 1,
    device: str | None = None,
) -> "IterableDataset[dict[str, Any]]":
    """A PyTorch IterableDataset that renders its samples as they are asked for; nothing is written.

    Arguments as in `pica.dataset`; `count` None goes on for ever. Each iteration begins with the same samples. The
    workers of a DataLoader have a renderer each and render different samples; start them by
    `multiprocessing_context="spawn"` if this process has rendered already.

    A sample is a dictionary: "number"; "picture", (height, width, 3) uint8 sRGB; each label as in `Frame.aov`,
    "instance" and "semantic" as int64; "intrinsics" (3, 3) and "pose" (4, 4) as OpenCV has them, float64. Without
    workers, tensors are where `Frame.torch` puts them, else on the processor.

    Raises PicaError for impossible arguments, and where PyTorch is not installed.
    """
    try:
        from pica.distributed.rendered_dataset import RenderedDataset
    except ImportError:
        raise PicaError("torch_dataset: PyTorch is not installed; pip install torch") from None
    checked("torch_dataset: settings", optional(instance(Settings)), settings, SettingsError)
    noise = checked("torch_dataset: seed", whole(0, 2**31 - 1), seed, PicaError)
    return RenderedDataset(
        scene=scene if callable(scene) else checked("torch_dataset: scene", instance(Scene), scene),
        cameras=cameras if isinstance(cameras, str | Path) else tuple(cameras),
        camera=checked("torch_dataset: camera", optional(instance(Camera)), camera),
        count=checked("torch_dataset: count", optional(whole(1)), count, PicaError),
        labels=checked_labels(labels),
        size=checked_size(size),
        frames=checked_count("torch_dataset: frames", frames),
        settings=(settings or Settings()).with_values({"seed": noise}),
        device=checked("torch_dataset: device", optional(text), device, PicaError),
    )

"""The IterableDataset of `torch_dataset`; imports PyTorch."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import count
from typing import Any

import torch
from torch.utils.data import IterableDataset, get_worker_info

from pica.distributed.samples import Sample, Sampler
from pica.distributed.viewpoints import Cameras, viewpoints
from pica.rhi.adapters import for_worker
from pica.scene.camera import Camera
from pica.scene.model import Scene
from pica.settings import Settings


@dataclass(eq=False)
class RenderedDataset(IterableDataset[dict[str, Any]]):  # type: ignore[misc]  # not installed with pica
    """The arguments of `torch_dataset`, checked, and a renderer since the first iteration in this process."""

    scene: Scene | Callable[[], Scene]
    cameras: Cameras
    camera: Camera | None
    count: int | None
    labels: tuple[str, ...]
    size: tuple[int, int]
    frames: int
    settings: Settings
    device: str | None

    def __post_init__(self) -> None:
        self._opened: tuple[Scene, Sampler] | None = None

    def __iter__(self) -> Iterator[dict[str, Any]]:
        info = get_worker_info()
        first, step = (0, 1) if info is None else (info.id, info.num_workers)
        scene, sampler = self._open(first, info is not None)
        places = viewpoints(self.cameras, scene, self.size, self.count, self.settings.seed, self.camera)
        numbers = count(first, step) if self.count is None else range(first, self.count, step)
        for number, sample in sampler.each(numbers, places, self.labels):
            tensors = self._tensors(sample)
            yield {"number": number, **(tensors if info is None else _on_processor(tensors))}

    def _open(self, worker: int, is_worker: bool) -> tuple[Scene, Sampler]:
        if self._opened is None:
            scene = self.scene if isinstance(self.scene, Scene) else self.scene()
            device = for_worker(worker) if is_worker and self.device is None else self.device
            self._opened = scene, Sampler(scene, self.size, self.settings, self.frames, device)
        return self._opened

    def _tensors(self, sample: Sample) -> dict[str, torch.Tensor]:
        camera = sample.viewpoint.now.camera
        tensors = {"picture": sample.picture.torch("display"), "pose": torch.from_numpy(camera.pose("opencv"))}
        if camera.orthographic_height is None:
            tensors["intrinsics"] = torch.from_numpy(camera.intrinsics(self.size))
        for name in self.labels:
            if name == "semantic":
                tensors[name] = torch.from_numpy(sample.semantic.labels).long()
            else:
                tensor = sample.labels.torch(name)
                tensors[name] = tensor.long() if name == "instance" else tensor
        return tensors

    def __getstate__(self) -> dict[str, Any]:
        return vars(self) | {"_opened": None}


def _on_processor(tensors: dict[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    """Workers cannot lend memory of a card to the process that trains."""
    return {name: tensor.cpu() for name, tensor in tensors.items()}

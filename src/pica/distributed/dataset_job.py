"""A data set as work in shards: what its folder holds, and what is missing there."""

import hashlib
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from pica.distributed import coco
from pica.distributed.readme import readme
from pica.distributed.samples import Sample, Sampler, described, encoded, record
from pica.distributed.shards import Files, is_whole, records, write_shard
from pica.distributed.viewpoints import Cameras, Viewpoints, viewpoints
from pica.errors import PicaError, SceneError
from pica.files import open_file, read
from pica.images.saving import write_whole
from pica.rhi.adapters import for_worker
from pica.scene.camera import Camera
from pica.scene.model import Scene
from pica.settings import Settings

_DESCRIPTION, _NODES, _ANNOTATIONS, _README = "dataset.json", "nodes.json", "annotations.json", "README.md"
_LARGEST_DESCRIPTION = 1_000_000
"""Bytes."""


@dataclass(frozen=True)
class DatasetJob:
    """The arguments of `dataset`, checked; a chunk of its work is a shard."""

    scene: Scene | Callable[[], Scene]
    output: Path
    cameras: Cameras
    camera: Camera | None
    count: int
    labels: tuple[str, ...]
    size: tuple[int, int]
    frames: int
    settings: Settings
    device: str | None
    shard: int
    """Samples of a shard."""

    def begin(self, resume: bool) -> list[int]:
        """Prepare the folder; returns the numbers of the shards that are missing. Raises PicaError."""
        scene = self._scene()
        description = self._description(scene, self._viewpoints(scene))
        try:
            content = [entry for entry in self.output.iterdir() if not entry.name.startswith(".")]
        except FileNotFoundError:
            content = []
        except OSError as error:
            raise PicaError(f"{self.output}: cannot be used ({error.strerror})") from None
        if content and not resume:
            raise PicaError(f"{self.output}: is not empty; resume the data set in it, or give another folder")
        if content:
            self._check_same(description)
        for folder in (self.output, self._images, self._shards):
            try:
                folder.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise PicaError(f"{folder}: cannot be made ({error.strerror})") from None
        _write_text(self.output / _DESCRIPTION, json.dumps(description, indent=1) + "\n")
        _write_text(self.output / _README, readme(self.labels))
        return [shard for shard in self._all_shards if not self._is_whole(shard)]

    def weight(self, shard: int) -> int:
        """See Work: its samples."""
        return len(self._numbers(shard))

    def open(self, worker: int) -> Callable[[int], None]:
        """See Work: loads the scene and makes a renderer for all shards of this worker."""
        scene = self._scene()
        places = self._viewpoints(scene)
        device = self.device if self.device is not None else for_worker(worker)
        sampler = Sampler(scene, self.size, self.settings, self.frames, device)
        return lambda shard: self._render(shard, sampler, places)

    def finish(self) -> None:
        """Write the annotations of all samples. Raises PicaError if a shard cannot be read."""
        names = json.loads((self.output / _NODES).read_text())["categories"]
        samples = (sample for shard in self._all_shards for sample in records(self._shard(shard)))
        coco.write_annotations(self.output / _ANNOTATIONS, samples, names)

    def _render(self, shard: int, sampler: Sampler, places: Viewpoints) -> None:
        def files() -> Iterator[tuple[str, Files]]:
            for number, sample in sampler.each(self._numbers(shard), places, self.labels):
                content = encoded(sample, self.labels)
                name = f"{number:06d}.png"
                write_whole(self._images / name, partial(_write_bytes, content["png"]))
                content["json"] = json.dumps(record(sample, number, name)).encode()
                if number == self._numbers(shard)[0]:
                    _write_text(self.output / _NODES, _nodes(sample))
                yield f"{number:06d}", content

        write_shard(self._shard(shard), files())

    @property
    def _all_shards(self) -> range:
        return range(-(-self.count // self.shard))

    def _is_whole(self, shard: int) -> bool:
        numbers = self._numbers(shard)
        pictures = all((self._images / f"{number:06d}.png").is_file() for number in numbers)
        return pictures and (self.output / _NODES).is_file() and is_whole(self._shard(shard), len(numbers))

    def _numbers(self, shard: int) -> range:
        return range(shard * self.shard, min((shard + 1) * self.shard, self.count))

    @property
    def _images(self) -> Path:
        return self.output / "images"

    @property
    def _shards(self) -> Path:
        return self.output / "shards"

    def _shard(self, number: int) -> Path:
        return self._shards / f"{number:06d}.tar"

    def _scene(self) -> Scene:
        return self.scene if isinstance(self.scene, Scene) else self.scene()

    def _viewpoints(self, scene: Scene) -> Viewpoints:
        return viewpoints(self.cameras, scene, self.size, self.count, self.settings.seed, self.camera)

    def _description(self, scene: Scene, places: Viewpoints) -> dict[str, Any]:
        """What makes it the same data set."""
        digest = hashlib.sha256()
        for number in range(self.count):
            now = places.at(number).now
            digest.update(json.dumps([described(now.camera, self.size), now.time]).encode())
        return {
            "scene": scene.name,
            "cameras": digest.hexdigest(),
            "count": self.count,
            "labels": list(self.labels),
            "size": list(self.size),
            "frames": self.frames,
            "settings": self.settings.summary(),
            "shard": self.shard,
        }

    def _check_same(self, description: dict[str, Any]) -> None:
        path = self.output / _DESCRIPTION
        try:
            with open_file(path, str(path)) as file:
                before = json.loads(read(file, _LARGEST_DESCRIPTION, str(path)))
            differing = [name for name, value in description.items() if before.get(name) != value]
        except (SceneError, ValueError, AttributeError):
            raise PicaError(f"{self.output}: holds no data set to resume; give another folder") from None
        if differing:
            name = differing[0]
            was, now = json.dumps(before.get(name)), json.dumps(description[name])
            raise PicaError(f"{self.output}: holds another data set, whose {name} is {was}, not {now}")


def _nodes(sample: Sample) -> str:
    """The names behind the numbers of instances and categories."""
    categories = list(sample.semantic.names[1:])
    nodes = {number: label.path for number, label in sample.labels.ids.items() if label.mesh is not None}
    return json.dumps({"categories": categories, "nodes": nodes}, indent=1) + "\n"


def _write_bytes(content: bytes, path: Path) -> None:
    path.write_bytes(content)


def _write_text(path: Path, content: str) -> None:
    write_whole(path, lambda temporary: temporary.write_text(content, encoding="utf-8"))

"""A sample of a data set: a picture, its labels, its camera and its instances."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pica.color import srgb_encode
from pica.distributed import coco
from pica.distributed.shards import npy, png
from pica.distributed.viewpoints import Moment, Viewpoint, Viewpoints
from pica.errors import PicaError, shown
from pica.images.labels import Semantic
from pica.images.output import Frame
from pica.names import did_you_mean
from pica.renderer import Renderer
from pica.rhi.device import open_device
from pica.scene.camera import Camera
from pica.scene.model import Scene
from pica.scene.scene_views import SceneViews
from pica.settings import Settings

LABELS = ("depth", "normal", "instance", "semantic", "motion", "albedo")
"""What a sample can have beside its picture."""
_AOVS = ("depth", "normal", "motion", "albedo")
"""Of these, those that are AOVs as they are."""
_PIXELS = 1_200_000
"""Of samples that are rendered at once."""


@dataclass(frozen=True)
class Sample:
    """A rendered viewpoint."""

    picture: Frame
    """Its colour and display are the picture's."""
    labels: Frame
    """Its AOVs are those of the labels."""
    semantic: Semantic
    viewpoint: Viewpoint

    def label(self, name: str) -> NDArray[Any]:
        """A label by its name in LABELS, (height, width) or (height, width, channels)."""
        return self.semantic.labels if name == "semantic" else self.labels.aov(name)


class _AlikeViews(Renderer):
    """Its views make the pictures of a renderer of one."""

    _views_are_alike = True


class Sampler:
    """Renders samples of a scene; each depends on its viewpoint alone, not on those before or beside it."""

    def __init__(
        self,
        scene: Scene,
        size: tuple[int, int],
        settings: Settings,
        frames: int,
        device: Any = None,
        views: int | None = None,
    ) -> None:
        """`frames`: whose mean is a picture. `views`: samples that are rendered at once; None: several on graphics
        cards. Raises as Renderer."""
        opened = open_device(device)
        self.views = views or (1 if opened.is_software else views_for(size))
        animated = bool(scene.animations) and self.views > 1
        self._scenes = list(SceneViews(scene, self.views)) if animated else [scene] * self.views
        self.renderer = _AlikeViews(self._scenes, size=size, settings=settings, device=opened)
        self._frames = frames
        self._by_extras: bool | None = None

    def __call__(self, viewpoints: Sequence[Viewpoint], labels: Sequence[str]) -> list[Sample]:
        """Samples with these labels, as many as `views` or fewer."""
        aovs = {"instance", *(name for name in labels if name in _AOVS)}
        spare = [viewpoints[-1]] * (self.views - len(viewpoints))
        every = [*viewpoints, *spare]
        cameras = [each.now.camera for each in every]
        if "motion" in labels:
            self._go([each.before for each in every])
            self.renderer.labels(camera=[each.before.camera for each in every], aovs=())
            self._go([each.now for each in every])
            seen = self.renderer.labels(camera=cameras, aovs=aovs)
            pictures = self.renderer.render(self._frames, camera=cameras, cut=True, aovs=())
        else:
            self._go([each.now for each in every])
            seen = pictures = self.renderer.render(self._frames, camera=cameras, cut=True, aovs=aovs)
        if self._by_extras is None:
            self._by_extras = coco.has_classes(seen[0].ids.values())
        category = partial(coco.category_of, by_extras=self._by_extras)
        shown = zip(pictures, seen, viewpoints, strict=False)
        return [Sample(picture, labelled, labelled.semantic(category), at) for picture, labelled, at in shown]

    def each(self, numbers: Iterable[int], places: Viewpoints, labels: Sequence[str]) -> Iterator[tuple[int, Sample]]:
        """The samples of these numbers, one after the other, and their numbers."""
        left = iter(numbers)
        while together := list(islice(left, self.views)):
            yield from zip(together, self([places.at(number) for number in together], labels), strict=True)

    def _go(self, moments: Sequence[Moment]) -> None:
        for scene, moment in zip(self._scenes, moments, strict=True):
            if scene.animations:
                scene.animate(moment.time)


def views_for(size: tuple[int, int]) -> int:
    """Samples at once on a graphics card: a divisor of usual shards."""
    return next(views for views in (10, 5, 2, 1) if views == 1 or views * size[0] * size[1] <= _PIXELS)


def checked_labels(labels: Any) -> tuple[str, ...]:
    """Names of labels, each once. Raises PicaError for an unknown one."""
    names = () if isinstance(labels, str) else tuple(labels)
    if isinstance(labels, str) or not all(isinstance(name, str) for name in names):
        raise PicaError(f'labels: {shown(labels)}: must be names, such as ("depth", "instance")')
    for name in names:
        if name not in LABELS:
            raise PicaError(
                f"labels: no label {shown(name)}; there are {', '.join(LABELS)}{did_you_mean(name, LABELS)}"
            )
    return tuple(dict.fromkeys(names))


_ENCODERS: dict[str, tuple[str, Callable[[NDArray[Any]], bytes]]] = {
    "depth": ("depth.npy", npy),
    "normal": ("normal.npy", lambda values: npy(values.astype(np.float16))),
    "instance": ("instance.png", lambda values: png(_sixteen_bits(values))),
    "semantic": ("semantic.png", lambda values: png(_sixteen_bits(values))),
    "motion": ("motion.npy", npy),
    "albedo": ("albedo.png", lambda values: png((srgb_encode(values) * 255 + 0.5).astype(np.uint8))),
}
"""The end of the file's name, and the function that makes the file, by label."""


def encoded(sample: Sample, labels: Sequence[str]) -> dict[str, bytes]:
    """The files of a sample but for its record. Raises PicaError for ids that 16 bits cannot hold."""
    files = {"png": png(sample.picture.display)}
    for name in labels:
        end, encode = _ENCODERS[name]
        files[end] = encode(sample.label(name))
    return files


def _sixteen_bits(numbers: NDArray[Any]) -> NDArray[np.uint16]:
    if (highest := int(numbers.max(initial=0))) > 0xFFFF:
        raise PicaError(f"the scene has a node or category {highest}, and files of ids hold 65535 at most")
    return numbers.astype(np.uint16)


def record(sample: Sample, number: int, file_name: str) -> dict[str, Any]:
    """The .json of a sample."""
    width, height = sample.picture.size
    now = sample.viewpoint.now
    return {
        "id": number,
        "file_name": file_name,
        "width": width,
        "height": height,
        "time": now.time,
        "camera": described(now.camera, (width, height)),
        "camera_before": described(sample.viewpoint.before.camera, (width, height)),
        "annotations": coco.annotations(sample.labels.aov("instance"), sample.semantic),
    }


def described(camera: Camera, size: tuple[int, int]) -> dict[str, Any]:
    """Intrinsics and poses of a camera as JSON has them."""
    return {
        "intrinsics": None if camera.orthographic_height is not None else camera.intrinsics(size).tolist(),
        "pose_opencv": camera.pose("opencv").tolist(),
        "pose_opengl": camera.pose("opengl").tolist(),
        "orthographic_height": camera.orthographic_height,
    }

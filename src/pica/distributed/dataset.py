"""Data sets on disk: pictures with labels, cameras and instances, in shards that can be resumed."""

from collections.abc import Callable, Sequence
from pathlib import Path

from pica.distributed.cluster import check_installed, do_on_cluster
from pica.distributed.dataset_job import DatasetJob
from pica.distributed.samples import LABELS, checked_labels
from pica.distributed.viewpoints import ORBIT, Cameras
from pica.distributed.workers import do
from pica.errors import PicaError, SettingsError
from pica.rendering.arguments import Progress, check_progress, checked_count, checked_size
from pica.scene.camera import Camera
from pica.scene.model import Scene
from pica.scene.values import checked, flag, instance, optional, text, whole
from pica.settings import Settings

SHARD = 50
"""Samples of a shard, which one worker renders."""
_MOST = 1_000_000
"""Pictures."""


def dataset(
    scene: Scene | Callable[[], Scene],
    output: str | Path,
    *,
    cameras: Cameras = ORBIT,
    camera: Camera | None = None,
    count: int = 1000,
    labels: Sequence[str] = LABELS,
    size: tuple[int, int] = (640, 360),
    frames: int = 8,
    settings: Settings | None = None,
    seed: int = 1,
    workers: int = 1,
    cluster: str | None = None,
    resume: bool = False,
    device: str | None = None,
    progress: Progress | None = None,
) -> None:
    """Render a data set into a folder: WebDataset shards, pictures with COCO annotations, and a README with the units.

    `scene`: a scene, or a function that makes it, which each worker calls.
    `cameras`: "orbit", once round what the scene's default camera looks at; "sphere", random places around it; the name
    of a .csv file; or cameras. `camera`: in place of the default camera, for "orbit" and "sphere".
    `count`: pictures. `labels`: of "depth", "normal", "instance", "semantic", "motion" and "albedo". `size`: (width,
    height) in pixels. `frames`: whose mean is a picture. `seed`: of random places and times, and of the noise.
    `workers`: processes, which import the program anew, so that it must be guarded by `if __name__ == "__main__":`.
    `cluster`: "auto" or the address of a Ray cluster, whose machines render instead; they share the folder.
    `resume`: keep the shards that an earlier call with the same arguments has finished.
    `progress(done, pictures)` is called after each shard.

    Every file has the same bytes whatever the number of workers, and however often it was resumed; but for pictures of
    devices whose threads add in any order, where last bits may differ (docs/guide/scaling.md). Raises PicaError for
    impossible arguments and a folder with other content, and as `Renderer`.
    """
    check_progress("dataset", progress)
    processes = checked_count("dataset: workers", workers)
    go_on = checked("dataset: resume", flag, resume, PicaError)
    checked("dataset: settings", optional(instance(Settings)), settings, SettingsError)
    noise = checked("dataset: seed", whole(0, 2**31 - 1), seed, PicaError)
    job = DatasetJob(
        scene=scene if callable(scene) else checked("dataset: scene", instance(Scene), scene),
        output=Path(output).absolute(),
        cameras=cameras if isinstance(cameras, str | Path) else tuple(cameras),
        camera=checked("dataset: camera", optional(instance(Camera)), camera),
        count=checked("dataset: count", whole(1, _MOST), count, PicaError),
        labels=checked_labels(labels),
        size=checked_size(size),
        frames=checked_count("dataset: frames", frames),
        settings=(settings or Settings()).with_values({"seed": noise}),
        device=checked("dataset: device", optional(text), device, PicaError),
        shard=SHARD,
    )
    report = progress or (lambda done, total: None)
    if cluster is None:
        do(job, job.begin(go_on), processes, report)
    else:
        if processes > 1:
            raise PicaError(
                "dataset: workers are for this machine; a cluster has one for each card, or for a few cores"
            )
        check_installed()
        do_on_cluster(job, job.begin(go_on), checked("dataset: cluster", text, cluster, PicaError), report)
    job.finish()

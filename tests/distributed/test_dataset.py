import json
import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import numpy as np
import PIL.Image
import pytest

import pica
from pica.distributed import dataset as module
from pica.distributed.samples import LABELS, Sampler
from pica.distributed.shards import is_whole, records
from pica.errors import PicaError
from tests.building import CAMERA, still_life

SIZE = 32, 24
FEW = {"size": SIZE, "frames": 2, "count": 5, "cameras": "orbit", "camera": CAMERA}
SHARDS = 3


def scene():
    made = still_life()
    for number, node in enumerate(made.nodes()):
        node.name = f"{node.name}.{number:03}"
    return made


@pytest.fixture(autouse=True)
def _small_shards(monkeypatch):
    monkeypatch.setattr(module, "SHARD", 2)


def render(folder, **more):
    pica.dataset(scene(), folder, **{**FEW, **more})


def content(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture(scope="module")
def made(device, tmp_path_factory):
    folder = tmp_path_factory.mktemp("dataset") / "out"
    done = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "SHARD", 2)
        render(folder, progress=lambda *counts: done.append(counts), device=device.name)
    assert done == [(0, 5), (2, 5), (4, 5), (5, 5)]
    return folder


@pytest.fixture(scope="module")
def shards(made):
    webdataset = pytest.importorskip("webdataset", reason="webdataset is not installed")
    paths = sorted(str(path) for path in made.glob("shards/*.tar"))
    return list(webdataset.WebDataset(paths, shardshuffle=False).decode("rgb8"))


def test_webdataset_reads_all_samples(made, shards):
    assert [sample["__key__"] for sample in shards] == [f"{number:06d}" for number in range(5)]
    for sample in shards:
        height, width = SIZE[::-1]
        assert sample["png"].shape == (height, width, 3) and sample["png"].dtype == np.uint8
        assert np.array_equal(sample["png"], PIL.Image.open(made / "images" / f"{sample['__key__']}.png"))
        shapes = {"depth": (height, width), "normal": (height, width, 3), "motion": (height, width, 2)}
        assert {name: sample[f"{name}.npy"].shape for name in shapes} == shapes
        assert len(np.unique(sample["png"])) > 20 and np.isfinite(sample["depth.npy"]).mean() > 0.2


def test_coco_masks_are_the_instance_aov_exactly(made, device):
    coco = pytest.importorskip("pycocotools.coco", reason="pycocotools is not installed")
    annotations = coco.COCO(str(made / "annotations.json"))
    nodes = json.loads((made / "nodes.json").read_text())["nodes"]
    assert len(annotations.imgs) == 5
    names = {entry["id"]: entry["name"] for entry in annotations.cats.values()}
    assert {"floor", "ball", "box"} <= set(names.values())
    with pica.Renderer(scene(), size=SIZE, device=device) as renderer:
        for sample in (sample for path in sorted(made.glob("shards/*.tar")) for sample in records(path)):
            pose = np.array(sample["camera"]["pose_opengl"])
            camera = pica.Camera(pose, vertical_fov=CAMERA.vertical_fov, near=CAMERA.near)
            instance = renderer.labels(camera=camera, aovs=("instance",)).aov("instance")
            covered = np.zeros_like(instance)
            for entry in annotations.imgToAnns[sample["id"]]:
                mask = annotations.annToMask(entry).astype(bool)
                covered[mask] = entry["instance"]
                left, top, width, height = entry["bbox"]
                assert not mask[:top].any() and not mask[:, :left].any() and mask[top].any() and mask[:, left].any()
                assert mask[top + height - 1].any() and mask[:, left + width - 1].any() and mask.sum() == entry["area"]
                assert nodes[str(entry["instance"])].startswith(names[entry["category_id"]])
            assert np.array_equal(covered, instance) and len(np.unique(instance)) > 3


def test_cameras_and_motion_agree_with_depth(shards):
    """A pixel taken to the world by K, pose and depth, and into the picture before, is where its motion says."""
    rows, columns = np.mgrid[: SIZE[1], : SIZE[0]]
    pixels = np.stack([columns, rows, np.ones_like(rows)], axis=-1)
    for sample in shards[1:]:
        camera, before = sample["json"]["camera"], sample["json"]["camera_before"]
        depth = sample["depth.npy"]
        seen = np.isfinite(depth)
        rays = pixels @ np.linalg.inv(camera["intrinsics"]).T
        world = (rays * depth[..., None])[seen] @ np.array(camera["pose_opencv"])[:3, :3].T
        world += np.array(camera["pose_opencv"])[:3, 3]
        turn = np.linalg.inv(before["pose_opencv"])
        projected = (world @ turn[:3, :3].T + turn[:3, 3]) @ np.array(before["intrinsics"]).T
        expected = projected[:, :2] / projected[:, 2:] - pixels[seen][:, :2]
        motion = sample["motion.npy"][seen]
        near = np.abs(motion - expected).max(axis=1) < 0.02
        hidden = ~motion.any(axis=1)  # where nothing was there in the picture before
        assert (near | hidden).all() and near.mean() > 0.7 and np.abs(expected).max() > 2


def test_a_run_cut_short_and_resumed_gives_the_same_bytes(made, tmp_path, device):
    def stop(done, total):
        if done == 2:
            raise KeyboardInterrupt

    folder = tmp_path / "out"
    with pytest.raises(KeyboardInterrupt):
        render(folder, progress=stop, device=device.name)
    assert [path.name for path in folder.glob("shards/*")] == ["000000.tar"]
    first = folder / "shards" / "000000.tar"
    written = first.stat().st_mtime_ns
    broken = folder / "shards" / "000001.tar"
    broken.write_bytes((made / "shards" / "000001.tar").read_bytes()[:4000])
    done = []
    render(folder, resume=True, progress=lambda *counts: done.append(counts), device=device.name)
    assert done[-1] == (3, 3) and first.stat().st_mtime_ns == written
    assert content(folder) == content(made)


def test_samples_that_are_rendered_at_once_give_the_same_bytes(made, tmp_path, device, monkeypatch):
    """As on graphics cards; the last shard has fewer samples than views."""
    monkeypatch.setattr("pica.distributed.dataset_job.Sampler", partial(Sampler, views=2))
    render(tmp_path / "out", device=device.name)
    assert content(tmp_path / "out") == content(made)


@pytest.mark.slow
def test_workers_give_the_same_bytes_and_a_killed_run_can_be_resumed(made, tmp_path):
    program = f"""
import pica
from pica.distributed import dataset as module
from tests.distributed.test_dataset import render
module.SHARD = 2
if __name__ == "__main__":
    render({str(tmp_path / "out")!r}, workers=2, resume=True, progress=lambda *counts: print(*counts, flush=True))
"""
    script = tmp_path / "program.py"
    script.write_text(program)
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, str(script)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as run:
        assert run.stdout is not None and run.stdout.readline() == "0 5\n" and run.stdout.readline() != ""
        run.send_signal(signal.SIGKILL)
    time.sleep(5)  # its workers finish their shards
    assert 1 <= len(list((tmp_path / "out").glob("shards/*.tar"))) <= SHARDS
    subprocess.run(command, check=True, env=environment, timeout=200, capture_output=True)
    assert content(tmp_path / "out") == content(made)


def test_a_folder_with_other_content_is_left_alone(made, tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    for resume, fault in ((False, "is not empty; resume"), (True, "holds no data set to resume")):
        with pytest.raises(PicaError, match=fault):
            render(tmp_path, resume=resume)
    with pytest.raises(PicaError, match="another data set, whose frames is 2, not 3"):
        render(made, resume=True, frames=3)
    with pytest.raises(PicaError, match="another data set, whose cameras is"):
        render(made, resume=True, cameras="sphere")
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        ({"labels": ("dept",)}, r"labels: no label 'dept'; .*depth"),
        ({"labels": "depth"}, r"labels: 'depth': must be names"),
        ({"count": 0}, r"count.*0"),
        ({"workers": 0}, r"workers.*0"),
        ({"seed": -1}, r"seed.*-1"),
        ({"size": (0, 4)}, r"0x4"),
        ({"camera": 3}, r"camera"),
    ],
)
def test_impossible_arguments(tmp_path, arguments, fault):
    with pytest.raises(PicaError, match=fault):
        render(tmp_path / "out", **arguments)
    assert not (tmp_path / "out").exists()


def test_the_readme_names_the_files(made):
    text = (made / "README.md").read_text()
    assert all(name in text for name in (*LABELS, "pose_opencv", "annotations.json"))
    assert is_whole(made / "shards" / "000002.tar", 1) and not is_whole(made / "shards" / "000002.tar", 2)
    assert not is_whole(Path(made / "README.md"), 1)
